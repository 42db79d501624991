"""Rendering a point: both halves with the same camera rays, and the steps between them."""

from functools import lru_cache, partial
from itertools import pairwise
from numbers import Real
from typing import Any

import mitsuba as mi
import numpy as np

from comparisons.case import RGB, open_case
from comparisons.prepared import guarded
from comparisons.study.dataset import STEPPED, STEPS, Row, largest_miss, measure
from comparisons.study.design import OWN, StudyPart
from comparisons.study.scenes import SCENES, Point, bsdf
from heuristic.errors import InputError
from reference.pairing.halves import Pair
from reference.planning.effects import EFFECTS
from reference.planning.plan import Plan, physical_integrator
from reference.rendering.renderer import Renderer, passes
from reference.rendering.sums import Accumulator
from reference.scene.graph import Graph
from reference.scene.source import Source
from reference.scene.values import COLOURS

PASSES = 4
"""Few passes of many samples: each pass costs a launch, and stratifies its samples. Four suffice to
estimate the noise."""


def row(part: StudyPart, point: Point, identity: str) -> Row:
    """Render a point and return its columns.

    The columns :data:`comparisons.study.dataset.STEPS` are the root mean square changes of the
    image as each step is added; ``dominant`` names the largest. The scene is read once while its
    ``identity`` stays.
    """
    own, in_scene = split(point)
    source = source_of(part, point, identity)
    if part.scene not in SCENES:
        source = source.edited(partial(set_values, values=in_scene))
    ready = guarded(source, part.options)
    spp, scene = max(1, (part.options.spp or 0) // PASSES), ready.scene
    ready.heuristic.spp = spp
    parameters = mi.traverse(ready.heuristic.integrator)
    for name, value in own.items():
        parameters[name] = value
    parameters.update()
    renderers, plans = [ready.heuristic], _plans(ready.plan)
    for stage in plans.values():
        integrator = physical_integrator(stage, scene, ready.pair.hide_emitters)
        renderers.append(Renderer(scene, integrator, spp, "reference image"))
    sums = [Accumulator() for _ in renderers]
    difference = Accumulator()
    for one in passes(renderers, part.options.seed, PASSES):
        for total, image in zip(sums, one.images, strict=True):
            total.add(image)
        difference.add(one.images[0] - one.images[-1])
    images = [total.estimate().mean for total in sums]
    result = measure(images[0], images[-1], ready.counted, difference.estimate().noise)
    sizes = dict.fromkeys(STEPS, 0.0)
    for name, (before, after) in zip(plans, pairwise(images), strict=True):
        change = (after - before).mean(axis=2)[ready.counted]
        sizes[name] = float(np.sqrt(np.mean(change**2)))
    result |= sizes | {"dominant": max(sizes, key=sizes.__getitem__)}
    result["miss"] = largest_miss(ready.pair.pairing.misses)
    return result | (_derived(ready.pair) if part.scene in SCENES else {})


def split(point: Point) -> tuple[Point, Point]:
    """Return a point's parameters of the heuristic, without their prefix, and of the scene."""
    own = {k.removeprefix(OWN): value for k, value in point.items() if k.startswith(OWN)}
    return own, {name: value for name, value in point.items() if not name.startswith(OWN)}


def source_of(part: StudyPart, point: Point, identity: str = "") -> Source:
    """Return the scene of a point: a study scene is made, another is read."""
    if part.scene in SCENES and (make := SCENES[part.scene].make):
        return Source(part.scene, lambda: make(point, bsdf(point)))
    return _read(part.scene, identity)


@lru_cache(maxsize=4)
def _read(scene: str, identity: str) -> Source:
    """Read a user's scene or a built-in one once, while its files stay the same."""
    case = open_case(scene)
    if case.variant != RGB:
        raise InputError(f"{scene} needs {case.variant}: study a scene in RGB.")
    return case.source


def _plans(chosen: Plan) -> dict[str, Plan]:
    """Return the plan of each step that changes something; the last is the chosen plan."""
    simulated = set(EFFECTS) - set(STEPPED)
    plans = {STEPS[0]: chosen.simulating(simulated)}
    for effect in STEPPED:
        simulated.add(effect)
        more = chosen.simulating(simulated)
        if more != list(plans.values())[-1]:
            plans[effect.label] = more
    return plans


def _derived(pair: Pair) -> Point:
    """Return a study's parameters of the material that pairing derived."""
    for record in pair.pairing.bsdfs:
        values = record.parameters
        if (record.given, record.derived) == ("roughplastic", "phong"):
            return {"n": values["n"], "k_d": _red(values["k_d"]), "k_s": _red(values["k_s"])}
        if (record.given, record.derived) == ("phong", "roughplastic"):
            names = {name: values[name] for name in ("alpha", "int_ior")}
            return names | {"reflectance": _red(values["diffuse_reflectance"])}
    return {}


def _red(value: Any) -> float:
    """Return a grey coefficient, recorded as one number or as RGB."""
    return float(np.ravel(value)[0])


def set_values(graph: Graph, values: dict[str, float]) -> None:
    """Set values in a user's scene, by path: ``<id of the element>.<parameter>``.

    The scene must state the parameter as a number, or as RGB, which becomes grey.
    """
    in_use = [graph.props(index) for index in graph.nodes_in_use()]
    for path, value in values.items():
        identifier, _, key = path.rpartition(".")
        named = [props for props in in_use if props.id() == identifier and key in props]
        if not named:
            known = sorted(
                f"{props.id()}.{name}"
                for props in in_use
                for name, present in props.items()
                if props.id() and _is_number(present)
            )
            raise InputError(
                f"{graph.name} has no parameter {path!r}. Write <id>.<parameter>, such as one of:"
                f" {', '.join(known)}."
            )
        if not _is_number(named[0][key]):
            raise InputError(f"{graph.name}: {path} is not a number or RGB. Vary one that is.")
        is_colour = isinstance(named[0][key], COLOURS)
        named[0][key] = mi.ScalarColor3f(value) if is_colour else value


def _is_number(value: object) -> bool:
    return isinstance(value, (Real, *COLOURS)) and not isinstance(value, bool)
