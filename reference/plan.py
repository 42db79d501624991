"""Which integrator the reference needs: direct light alone, or paths."""

from dataclasses import dataclass

import mitsuba as mi

from reference import values

CONVEX_SHAPES = ("sphere", "rectangle", "disk", "cube")
"""Shapes no point of which sees another point of the same shape from outside."""


@dataclass(frozen=True)
class Effect:
    """An effect of light, whether the scene calls for it, and the rule that decided."""

    name: str
    called_for: bool
    rule: str


@dataclass(frozen=True)
class Plan:
    """How the reference is rendered.

    ``max_depth`` counts as Mitsuba's: 2 is direct light, -1 no limit.
    """

    integrator: str
    max_depth: int
    effects: tuple[Effect, ...]


def plan(pair):
    """Choose the integrator by what can be proven from the scene's structure.

    Light that a shape reflects can reach another point only if that point is seen. One convex shape
    alone therefore neither lights nor shadows itself, and its direct light is all its light.
    """
    graph = pair.physical
    shapes = [graph.plugin(index) for index in graph.nodes(mi.ObjectType.Shape)]
    alone = len(shapes) == 1 and shapes[0] in CONVEX_SHAPES
    if alone:
        rule = f"structural: one convex shape ({shapes[0]}) alone"
        return Plan("direct_all", 2, _effects(pair, False, rule))
    rule = f"structural: {len(shapes)} shapes, which may shadow and light each other"
    return Plan("path", pair.max_depth, _effects(pair, True, rule))


def _effects(pair, several, shapes_rule):
    """List the effects that structure decides, for the heuristic and the physical half."""
    graph = pair.heuristic
    phongs = [
        graph.props(index)
        for index in graph.nodes(mi.ObjectType.BSDF)
        if graph.plugin(index) == "phong"
    ]
    lights = [graph.plugin(index) for index in graph.nodes(mi.ObjectType.Emitter)]
    integrator = graph.props(graph.nodes(mi.ObjectType.Integrator)[0])
    has_ambient = "ambient" in integrator

    def coefficient(name):
        present = any(name in props and values.may_be_nonzero(props[name]) for props in phongs)
        return present, f"structural: {name} {'is not 0' if present else 'is 0'}" + (
            " in some material" if present else " in every material"
        )

    emission, ambient, diffuse, specular = map(coefficient, ("k_i", "k_a", "k_d", "k_s"))
    if not has_ambient:
        ambient = (False, "structural: no ambient light")
    physical = pair.physical
    kinds = [physical.plugin(index) for index in physical.nodes(mi.ObjectType.Emitter)]
    extended = [kind for kind in kinds if kind in ("area", "constant")]
    listing = ", ".join(sorted(set(extended))) or "none"
    return (
        Effect("emission", *emission),
        Effect("ambient", *ambient),
        Effect("diffuse", *diffuse),
        Effect("specular", *specular),
        Effect(
            "distance attenuation",
            any(kind != "directional" and kind != "constant" for kind in kinds),
            f"structural: lights of the physical half: {', '.join(sorted(set(kinds))) or 'none'}",
        ),
        Effect(
            "spot cone",
            "heuristic_spot" in lights,
            f"structural: {lights.count('heuristic_spot')} spots in the heuristic half",
        ),
        Effect("extended lights", bool(extended), f"structural: {listing}"),
        Effect("occlusion", several, shapes_rule),
        Effect("interreflection", several, shapes_rule),
    )
