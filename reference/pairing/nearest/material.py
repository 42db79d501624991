"""The result of a rule of :mod:`reference.pairing.nearest`, and the tools that it may use."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import mitsuba as mi

from heuristic.errors import InputError
from heuristic.materials import COEFFICIENTS
from heuristic.terms import normalisation
from reference.pairing.factors import Convention
from reference.pairing.nearest import operations
from reference.scene.graph import Graph, properties

BSDF = mi.ObjectType.BSDF


@dataclass(frozen=True)
class Nearest:
    """The phong material that replaces a BSDF; values as in `nearest.operations`.

    Attributes
    ----------
    k_i, k_a, k_d, k_s, n, form, normalised, twosided, transmittance, tilt
        Parameters of the plugin ``phong``.
    lost
        Pairs of something that the heuristic model has no form for, and the rule for the rest.
    misses
        Quantities that were not reached, :class:`reference.pairing.factors.Miss`.
    """

    k_i: Any = 0.0
    k_a: Any = 0.0
    k_d: Any = 0.0
    k_s: Any = 0.0
    n: Any = 1.0
    form: str = "phong"
    normalised: bool = False
    twosided: bool = False
    transmittance: Any = 0.0
    tilt: Any = None
    lost: tuple[tuple[str, str], ...] = ()
    misses: tuple = ()

    def properties(self) -> mi.Properties:
        """Return the properties of the node ``phong``, without defaults."""
        props = properties("phong")
        for name in (*COEFFICIENTS, "n", "transmittance"):
            value = getattr(self, name)
            if name in ("k_d", "n") or not operations.is_zero(value):
                props[name] = mi.ScalarColor3f(value) if isinstance(value, tuple) else value
        for name in ("normalised", "twosided"):
            if getattr(self, name):
                props[name] = True
        if self.form != "phong":
            props["form"] = self.form
        if self.tilt is not None:
            props["tilt"] = self.tilt
        return props

    def parameters(self) -> dict[str, Any]:
        """Return the coefficients for records: numbers, or the word ``texture``."""
        found = {name: getattr(self, name) for name in ("k_a", "k_d", "k_s", "n")}
        if not operations.is_zero(self.transmittance):
            found["transmittance"] = self.transmittance
        return {
            name: "texture" if operations.plain(value) is None else operations.plain(value)
            for name, value in found.items()
        }


@dataclass(frozen=True)
class Context:
    """A graph that rules read and add nodes to.

    ``nearest(index)`` applies the rules to a nested BSDF.
    """

    graph: Graph
    convention: Convention
    nearest: Any = field(repr=False, default=None)

    def value(self, index: int, key: str, default: Any) -> Any:
        """Return a parameter as the parser keeps it."""
        return self.graph.props(index).get(key, default)

    def plugin(self, index: int) -> str:
        """Return a node's plugin."""
        return self.graph.plugin(index)


@dataclass(frozen=True)
class Rule:
    """How to find the nearest material of a BSDF, and what planning knows about the BSDF.

    ``reflectances`` are parameters with defaults; it reflects nothing if all are 0, and without any
    it may always reflect. It only reflects, on the side of the normal, if all ``transmittances``
    are 0; ``reflectances`` is None if that is not known. ``wraps`` is whether it is made of other
    BSDFs.
    """

    nearest: Callable[[Context, int], Nearest]
    reflectances: Mapping[str, float] | None = None
    transmittances: Mapping[str, float] = field(default_factory=dict)
    wraps: bool = False


RULES: dict[str, Rule] = {}
"""By plugin; filled by :func:`rule`."""


def rule(*plugins: str, **known: Any) -> Callable:
    """Declare a function as the :class:`Rule` of some plugins, with what is known about them."""

    def declared(nearest):
        RULES.update(dict.fromkeys(plugins, Rule(nearest, **known)))
        return nearest

    return declared


def alike(graph: Graph, first: Nearest, second: Nearest) -> tuple[Nearest, Nearest]:
    """Return two materials with their lobes scaled in the same way, so ``k_s`` can be mixed."""
    if first.normalised == second.normalised:
        return first, second
    return _normalised(graph, first), _normalised(graph, second)


def _normalised(graph: Graph, material: Nearest) -> Nearest:
    if material.normalised:
        return material
    if operations.is_zero(material.k_s):
        return replace(material, normalised=True)
    n = operations.plain(material.n)
    if n is None:
        raise InputError(
            f"{graph.name}: a phong whose n is a texture is mixed with a BSDF whose alpha is one:"
            " give the phong a single n, or make it normalised."
        )
    scale = 1 / float(normalisation(material.form, n))
    return replace(material, normalised=True, k_s=operations.product(graph, material.k_s, scale))
