"""Parameters of the physical materials, as engines have them, for users' heuristics.

For each BSDF of a scene, physical or heuristic, before it is replaced:

======================  =================================  ===================  =========  =========
BSDF                    ``base_color``                     ``alpha``            ``ior``    ``metal-
                                                                                           lic``
======================  =================================  ===================  =========  =========
``diffuse``             ``reflectance``                    1                    1          0
``roughplastic``        ``diffuse_reflectance``            its own              inside     0
                                                                                over
                                                                                outside
``plastic``             ``diffuse_reflectance``            1e-4                 likewise   0
``roughconductor``,     albedo at normal incidence         its own, or 1e-4     1          1
``conductor``
``dielectric`` and its  0: nothing is reflected below the  its own, or 1e-4     likewise   0
rough and thin forms    surface
``principled``          its own                            ``roughness^2``      ``eta``    its own
``phong``               that of ``diffuse`` or             likewise             likewise   0
                        ``roughplastic`` as paired
``null``                0                                  1                    1          0
any other               albedo of its diffuse part at      measured             of its     0
                        normal incidence, as measured                           lobe's
                                                                                albedo
======================  =================================  ===================  =========  =========

``twosided``, ``mask``, ``bumpmap`` and ``normalmap`` take the values of the nested BSDF,
``blendbsdf`` the blend. Index 1 means no interface: it reflects nothing at normal incidence.
"""

from dataclasses import dataclass, fields
from math import sqrt
from typing import Any

import mitsuba as mi
import numpy as np

from heuristic.materials import SMALLEST_ALPHA
from reference.pairing import bsdfs, probe
from reference.pairing.bsdfs import WRAPPERS, Context
from reference.pairing.factors import Convention
from reference.scene import values
from reference.scene.graph import Graph

BSDF = mi.ObjectType.BSDF

LARGEST_IOR = 4.0
"""Limit of measured indices: germanium has 4."""


@dataclass(frozen=True)
class Partner:
    """The parameters of a physical material; values as in `reference.scene.values`."""

    base_color: Any = 0.0
    alpha: Any = 1.0
    ior: Any = 1.0
    metallic: Any = 0.0

    def named(self) -> dict[str, Any]:
        """Return them under the names of the plugin ``phong``."""
        found = {each.name: getattr(self, each.name) for each in fields(self)}
        colour = found["base_color"]
        found["base_color"] = mi.ScalarColor3f(colour) if isinstance(colour, tuple) else colour
        return found


def read(graph: Graph, convention: Convention) -> dict[int, Partner]:
    """Return the partner of each BSDF of a graph by index; blends add nodes to the graph."""
    return {index: _of(graph, index, convention) for index in graph.nodes(BSDF)}


def give(graph: Graph, partners: dict[int, Partner]) -> None:
    """Give the ``phong`` that replaces each BSDF the parameters of its partner."""
    for index, partner in partners.items():
        if graph.plugin(index) == "phong":
            for name, value in partner.named().items():
                graph.props(index)[name] = value


def _of(graph: Graph, index: int, convention: Convention) -> Partner:
    plugin = graph.plugin(index)
    if plugin in WRAPPERS:
        inner = [_of(graph, child, convention) for _, child in graph.children(index, BSDF)]
        return _wrapped(graph, index, plugin, inner)
    if plugin == "phong":
        return _of_phong(graph, index, convention)
    rule = _RULES.get(plugin, _measured)
    return rule(Context(graph, convention), index)


def _wrapped(graph: Graph, index: int, plugin: str, inner: list[Partner]) -> Partner:
    if len(inner) == 1:
        return inner[0]
    pairs = {each.name: [getattr(one, each.name) for one in inner[:2]] for each in fields(Partner)}
    if plugin == "twosided":
        return Partner(**{k: values.sides(graph, *pair) for k, pair in pairs.items()})
    weight = graph.props(index).get("weight", 0.5)
    return Partner(**{k: values.blend(graph, a, b, weight) for k, (a, b) in pairs.items()})


def _of_phong(graph: Graph, index: int, convention: Convention) -> Partner:
    plugin, found, _ = bsdfs.physical_partner(graph, index, convention)
    if plugin == "diffuse":
        return Partner(found["reflectance"])
    ior = found["int_ior"] / found["ext_ior"]
    return Partner(found["diffuse_reflectance"], found["alpha"], ior)


def _plastic(context: Context, index: int) -> Partner:
    base = context.value(index, "diffuse_reflectance", 0.5)
    return Partner(base, _alpha(context, index), _ior(context.graph, index, "polypropylene"))


def _conductor(context: Context, index: int) -> Partner:
    tint = context.value(index, "specular_reflectance", 1.0)
    white = probe.measured(context.graph, index, specular_reflectance=1.0)
    base = values.product(context.graph, white.reflected, tint)
    return Partner(base, _alpha(context, index), metallic=1.0)


def _dielectric(context: Context, index: int) -> Partner:
    return Partner(alpha=_alpha(context, index), ior=_ior(context.graph, index, "bk7"))


def _principled(context: Context, index: int) -> Partner:
    roughness = context.value(index, "roughness", 0.5)
    specular = values.plain(context.value(index, "specular", 0.5))
    # Mitsuba's reading of `specular`, F0 = 0.08 specular, as an index.
    ior = 2 / (1 - sqrt(0.08 * specular)) - 1 if isinstance(specular, float) else 1.5
    return Partner(
        context.value(index, "base_color", 0.5),
        _at_least(values.product(context.graph, roughness, roughness)),
        context.value(index, "eta", ior),
        context.value(index, "metallic", 0.0),
    )


def _measured(context: Context, index: int) -> Partner:
    found = probe.with_values(context.graph, index)
    if found is None:
        return Partner(0.5)
    level = values.plain(found.specular)
    root = sqrt(min(float(np.mean(level)) if level is not None else 0.04, 0.99))
    ior = min((1 + root) / (1 - root), LARGEST_IOR)
    return Partner(found.diffuse, min(max(found.alpha, SMALLEST_ALPHA), 1.0), ior)


def _alpha(context: Context, index: int) -> Any:
    rough = context.plugin(index).startswith("rough")
    along = context.value(index, "alpha_u", 0.1)
    return _at_least(context.value(index, "alpha", along if rough else 0.0))


def _at_least(alpha: Any) -> Any:
    known = values.plain(alpha)
    return alpha if known is None else max(known, SMALLEST_ALPHA)


def _ior(graph: Graph, index: int, inside: str) -> float:
    inner = values.index_of_refraction(graph, index, "int_ior", inside)
    return inner / values.index_of_refraction(graph, index, "ext_ior", "air")


_RULES = {
    "diffuse": lambda context, index: Partner(context.value(index, "reflectance", 0.5)),
    "null": lambda context, index: Partner(),
    "principled": _principled,
    **dict.fromkeys(("plastic", "roughplastic"), _plastic),
    **dict.fromkeys(("conductor", "roughconductor"), _conductor),
    **dict.fromkeys(("dielectric", "roughdielectric", "thindielectric"), _dielectric),
}
