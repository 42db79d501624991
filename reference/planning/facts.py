"""What the rules of planning reason from: a pair, and the structure of its physical half."""

from dataclasses import dataclass
from functools import cached_property

import mitsuba as mi

from heuristic.interpolation import Interpolation
from heuristic.plugins.phong import COEFFICIENTS
from reference.pairing.halves import Pair
from reference.planning.structure import BSDF, Structure
from reference.scene import values


@dataclass(frozen=True)
class Facts:
    """Facts about a pair in the current variant.

    Parameters
    ----------
    pair
        Both halves.
    structure
        Of the physical half.
    interpolation
        Of the heuristic half.
    """

    pair: Pair
    structure: Structure
    interpolation: Interpolation = Interpolation.PHONG

    @cached_property
    def kernel(self) -> mi.Properties:
        """The parameters of the heuristic half's integrator."""
        graph = self.pair.heuristic
        return graph.props(graph.nodes(mi.ObjectType.Integrator)[0])

    @property
    def has_shadows(self) -> bool:
        """Whether the heuristic half itself has shadows."""
        return self.kernel.get("occlusion", False)

    @cached_property
    def kernel_terms(self) -> tuple[str, ...]:
        """The coefficients that are not 0 in every material."""
        graph = self.pair.heuristic
        materials = [graph.props(i) for i in graph.nodes(BSDF) if graph.plugin(i) == "phong"]
        return tuple(
            name
            for name in COEFFICIENTS
            if any(name in props and values.may_be_nonzero(props[name]) for props in materials)
        )

    @property
    def lights_in_words(self) -> str:
        """The kinds of the physical half's lights, as evidence."""
        kinds = {light.kind for light in self.structure.lights}
        return f"lights: {', '.join(sorted(kinds)) or 'none'}"

    @cached_property
    def is_clear(self) -> bool:
        """Whether a BSDF of the physical half may let light through."""
        return any(not shape.opaque for shape in self.structure.shapes)
