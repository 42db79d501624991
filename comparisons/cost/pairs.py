"""The pairs of one scene, each derived once: in several variants, and with several kernels."""

from dataclasses import replace

import mitsuba as mi

from comparisons.compare import Prepared
from comparisons.options import Options
from heuristic.interpolation import Interpolation
from reference.pairing.halves import Pair
from reference.scene.source import Source


class Pairs:
    """Derives pairs on request, in the variant that is current then.

    Parameters
    ----------
    source, options
        See :func:`comparisons.compare.compare`.
    ready
        Its pair is the first.
    """

    def __init__(self, source: Source, options: Options, ready: Prepared) -> None:
        self._source, self._options = source, options
        key = ready.reference.variant, options.interpolation, options.tessellation
        self._known = {key: ready.pair}

    def interpolated(self, interpolation: Interpolation) -> Pair:
        """Return the pair with another interpolation, and the requested tessellation.

        Raises
        ------
        InputError
            When a shape cannot be a mesh, or flat and Gouraud shading have no viewpoint.
        """
        return self._of(interpolation, self._options.tessellation)

    def plain(self) -> Pair:
        """Return the pair with the scene's own geometry."""
        return self._of(Interpolation.PHONG, None)

    def _of(self, interpolation: Interpolation, tessellation: int | None) -> Pair:
        key = mi.variant(), interpolation, tessellation
        if key not in self._known:
            changed = replace(self._options, interpolation=interpolation, tessellation=tessellation)
            self._known[key] = changed.pair(self._source)
        return self._known[key]
