"""Comparisons in a notebook, shown as in the page.

::

    from reports.notebook import compare

    compare(mitsuba.cornell_box(), spp=64, resolution=(128, 128))
"""

import heuristic  # noqa: F401  isort: skip  finds LLVM before Mitsuba is imported

from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from comparisons.compare import compare as compare_halves
from comparisons.options import Options
from comparisons.record import Comparison
from reference.scene.graph import Source, set_variant
from reports.page import page
from reports.run import output

HEIGHT = 720
"""Pixels of the frame; what is longer scrolls."""


@dataclass(frozen=True)
class Shown:
    """A comparison and the page that shows it.

    `comparison` has the record, ``comparison.data``, and the images, ``comparison.images``.
    """

    comparison: Comparison
    page: str

    def _repr_html_(self) -> str:
        """Show the page in a frame of its own: neither its styles nor its scripts get out."""
        return (
            f'<iframe sandbox="allow-scripts" style="width: 100%; height: {HEIGHT}px; border: 0"'
            f' title="Comparison" srcdoc="{escape(self.page)}"></iframe>'
        )


def compare(
    scene: Mapping[str, Any] | str | Path,
    name: str = "scene",
    variant: str = "llvm_ad_rgb",
    **options: Any,
) -> Shown:
    """Compare a scene as `comparisons.compare.compare` does.

    scene
        A dictionary as ``mitsuba.load_dict`` takes it, or the path of a Mitsuba file.
    options
        Those of `comparisons.options.Options`.

    Raises what `comparisons.compare.compare` raises.
    """
    set_variant(variant)
    comparison = compare_halves(Source(name, scene), Options(**options))
    with TemporaryDirectory() as folder:
        view = output.write_scene(Path(folder), "scene", comparison)
    return Shown(comparison, page.render([view | {"files": {}}]))
