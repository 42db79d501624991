"""Rendering a point: both halves with the same camera rays, and the steps between them."""

from dataclasses import replace
from functools import lru_cache, partial
from itertools import pairwise
from typing import Any

import numpy as np

from comparisons.case import RGB, open_case
from comparisons.study.columns import STEPPED, STEPS, Row
from comparisons.study.design import OWN, Part
from comparisons.study.editing import Kept, set_values
from comparisons.study.measure import largest_miss, measure
from comparisons.study.scenes import SCENES, Point, bsdf
from heuristic.arrays import Scene
from heuristic.errors import InputError
from reference.effects import EFFECTS
from reference.pairing import halves
from reference.pairing.halves import Pair
from reference.planning.plan import Plan, plan, sampler
from reference.rendering.gbuffer import gbuffer, image_size, require_surface
from reference.rendering.guard import Guard, Verdict, examine_plan
from reference.rendering.passes import passes
from reference.rendering.renderer import Renderer, physical_integrator
from reference.rendering.sums import Accumulator
from reference.scene.sampler import with_sampler
from reference.scene.source import Source

PASSES = 4
"""Few passes of many samples: each pass costs a launch, and stratifies its samples. Four suffice to
estimate the noise."""


def row(part: Part, point: Point, identity: str) -> Row:
    """Render a point and return its columns.

    For the identity see :class:`comparisons.study.point.Block`.

    The columns :data:`comparisons.study.columns.STEPS` are the root mean square changes of the
    image as each step is added; ``dominant`` names the largest.
    """
    source = _source(part, scene_parameters(point), identity)
    pair = halves.pair(source, part.convention, part.resolution, heuristic=part.heuristic)
    graph = pair.heuristic
    for name, value in own_parameters(point).items():
        graph.props(graph.nodes(halves.INTEGRATOR)[0])[name] = value
    kept = _kept(part.scene, identity)
    physical = kept[1].scene(with_sampler(pair.physical, sampler()))
    surface = gbuffer(physical, *image_size(physical))
    require_surface(surface.hit, part.scene)
    chosen = _guarded(part, identity, plan(pair, physical), physical, pair)
    heuristic = kept[0].scene(with_sampler(pair.heuristic, chosen.sampler))
    spp = part.spp // PASSES
    plans = _plans(chosen)
    renderers = [Renderer(heuristic, None, spp, "heuristic image")]
    for stage in plans.values():
        integrator = physical_integrator(stage, physical, pair.hide_emitters)
        renderers.append(Renderer(physical, integrator, spp, "reference image"))
    images, noise = _render(renderers, part.seed)
    counted = surface.hit
    result = measure(images[0], images[-1], counted, noise)
    result |= _steps(dict(zip(plans, pairwise(images), strict=True)), counted)
    result["miss"] = largest_miss(pair.misses)
    return result | (_derived(pair) if part.scene in SCENES else {})


def own_parameters(point: Point) -> Point:
    """Return a point's parameters of the heuristic, without their prefix."""
    return {k.removeprefix(OWN): value for k, value in point.items() if k.startswith(OWN)}


def scene_parameters(point: Point) -> Point:
    """Return a point's parameters of the scene."""
    return {name: value for name, value in point.items() if not name.startswith(OWN)}


def opened(scene: str) -> Source:
    """Open a user's scene or a built-in one.

    Raises
    ------
    InputError
        When it is neither a file nor built in, or is spectral.
    """
    case = open_case(scene)
    if case.variant != RGB:
        raise InputError(f"{scene} needs {case.variant}: study a scene in RGB.")
    return case.source


def _source(part: Part, point: Point, identity: str) -> Source:
    if part.scene in SCENES and (make := SCENES[part.scene].make):
        return Source(part.scene, lambda: make(point, bsdf(point)))
    return _opened(part.scene, identity).edited(partial(set_values, values=point))


def _guarded(part: Part, identity: str, chosen: Plan, physical: Scene, pair: Pair) -> Plan:
    """Return the plan, or the plan for everything if a probe disagrees.

    Only the first point of a part in this process is probed, for each way in which plans prune.
    """
    key = part.name, part.scene, identity, chosen.simulated
    if key not in _guards:
        width, height = image_size(physical)
        samples = part.spp * width * height
        _guards[key] = examine_plan(chosen, physical, pair.hide_emitters, samples, part.seed)
    found = _guards[key]
    if found.state is not Verdict.DISAGREED:
        return chosen
    # The scene already has its sampler, and both halves need the same one.
    return replace(chosen.unpruned("guard", found.words), sampler=chosen.sampler)


_guards: dict[tuple[object, ...], Guard] = {}


@lru_cache(maxsize=4)
def _opened(scene: str, identity: str) -> Source:
    """Open a scene once for all points in this process, while its files stay the same."""
    return opened(scene)


@lru_cache(maxsize=4)
def _kept(scene: str, identity: str) -> tuple[Kept, Kept]:
    """Return the cached scenes of both halves, for all points of a scene in this process."""
    return Kept(), Kept()


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


def _render(renderers: list[Renderer], seed: int) -> tuple[list[np.ndarray], np.ndarray]:
    """Render all in turn; return the mean images, and the noise of first minus last."""
    sums = [Accumulator() for _ in renderers]
    difference = Accumulator()
    for one in passes(renderers, seed, PASSES):
        for total, image in zip(sums, one.images, strict=True):
            total.add(image)
        difference.add(one.images[0] - one.images[-1])
    return [total.estimate().mean for total in sums], difference.estimate().noise


def _steps(stages: dict[str, tuple[np.ndarray, np.ndarray]], counted: np.ndarray) -> dict[str, Any]:
    """Return the root mean square change of each step, and the name of the largest."""
    sizes = dict.fromkeys(STEPS, 0.0)
    for name, (before, after) in stages.items():
        change = (after - before).mean(axis=2)[counted]
        sizes[name] = float(np.sqrt(np.mean(change**2))) if change.size else 0.0
    return sizes | {"dominant": max(sizes, key=sizes.__getitem__)}


def _derived(pair: Pair) -> Point:
    """Return a study's parameters of the material that pairing derived."""
    for record in pair.bsdfs:
        given = record.parameters
        if (record.given, record.derived) == ("roughplastic", "phong"):
            return {"n": given["n"], "k_d": given["k_d"][0], "k_s": given["k_s"][0]}
        if (record.given, record.derived) == ("phong", "roughplastic"):
            reflectance = given["diffuse_reflectance"][0]
            return {
                "alpha": given["alpha"],
                "int_ior": given["int_ior"],
                "reflectance": reflectance,
            }
    return {}
