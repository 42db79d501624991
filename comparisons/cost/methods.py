"""The methods of one scene's ladder, from flat shading to the full plan, and their renderers.

Each method first loses what the scene's plan leaves out. Methods that do not differ in this scene
then become equal, and are merged; the result keeps all their names. Methods from outside come
before the full plan::

    from comparisons.cost.cost_record import Method
    from comparisons.cost.methods import declare

    declare(Method(name="no shadows", family="physical", without=("occlusion",), max_depth=2))
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import mitsuba as mi
from msgspec import structs

from comparisons.cost.cost_record import Method
from comparisons.hybrids.hybrids import HybridScenes, Pairs
from comparisons.options import Options
from comparisons.prepared import Prepared
from heuristic.errors import InputError
from heuristic.heuristics import PHONG, Heuristic, Interpolation, named
from reference.pairing.halves import INTEGRATOR
from reference.planning.effects import (
    EFFECTS,
    ENVIRONMENT,
    INTERREFLECTION,
    OCCLUSION,
    PrunedEffect,
    ReplacedEffect,
)
from reference.planning.plan import physical_integrator
from reference.rendering.renderer import Renderer, variant
from reference.rendering.sampler import with_sampler
from reference.scene.source import Source

DEPTHS = (3, 4, 5)
"""Depths of ``path`` that are methods, as Mitsuba counts: 2 is direct light."""

UNLIMITED = -1

KERNELS = (
    Method(name="flat kernel", family="kernel", interpolation=Interpolation.FLAT),
    Method(name="Gouraud kernel", family="kernel", interpolation=Interpolation.GOURAUD),
    Method(name="Phong kernel", family="kernel"),
    Method(name="kernel with shadows", family="kernel", shadows=True),
)

_INDIRECT = (INTERREFLECTION.label, ENVIRONMENT.label)

STAND_INS = tuple(
    Method(
        name=name,
        family="kernel",
        shadows="map" not in heuristic,
        heuristic=heuristic,
        stands_in_for=effects,
    )
    for name, heuristic, effects in (
        ("shadow map", "shadow-map", (OCCLUSION.label,)),
        ("filtered shadow map", "soft-shadow-map", (OCCLUSION.label,)),
        ("constant ambient", "mean-ambient", _INDIRECT),
        ("hemisphere ambient", "hemisphere-ambient", _INDIRECT),
    )
)
"""What engines use instead of transport, each with shadows and a textbook's lights."""

PHONG_BSDF = Method(
    name="phong BSDF, full transport",
    family="phong BSDF",
    without=tuple(effect.label for effect in EFFECTS if effect.part == "BSDF form"),
)
DIRECT = Method(name="direct", family="physical", without=(INTERREFLECTION.label,))
FULL_PLAN = Method(name="full plan", family="physical")

_DECLARED: dict[str, Method] = {}


def built_in(depths: tuple[int, ...] = DEPTHS) -> tuple[Method, ...]:
    """Return the package's own methods, cheapest idea first, with paths of some depths."""
    paths = [Method(name=f"path {depth}", family="physical", max_depth=depth) for depth in depths]
    return (*KERNELS, *STAND_INS, PHONG_BSDF, DIRECT, *paths, FULL_PLAN)


def all_methods(depths: tuple[int, ...] = DEPTHS) -> tuple[Method, ...]:
    """Return all methods, cheapest idea first."""
    *cheaper, full = built_in(depths)
    return (*cheaper, *_DECLARED.values(), full)


def declare(method: Method) -> Method:
    """Add a method to every ladder and return it; it replaces a declared one of the same name.

    ``InputError`` for a name of the package itself, and for an effect that a plan cannot leave out:
    it needs the kernel, or a second image.
    """
    if method.name in {own.name for own in built_in()}:
        raise InputError(
            f"method {method.name!r} is already declared by fotismos: give another name."
        )
    allowed = [
        effect.label
        for effect in EFFECTS
        if isinstance(effect, PrunedEffect)
        or (isinstance(effect, ReplacedEffect) and not effect.emission)
    ]
    for effect in method.without:
        if effect not in allowed:
            raise InputError(
                f"a method without {effect} is not possible: leave out some of"
                f" {', '.join(allowed)}."
            )
    _DECLARED[method.name] = method
    return method


@dataclass(frozen=True)
class Traits:
    """What the scene has, according to its plan.

    ``effects`` are labels of those that make a difference when left out, ``kernel_shadows`` whether
    the heuristic half has its own shadows, ``max_depth`` the scene's own limit of path length, -1
    if unlimited, ``random`` whether direct light needs random numbers, and ``background`` whether
    the heuristic half has an environment, which its own ``I_a`` does not need.
    """

    effects: frozenset[str]
    kernel_shadows: bool
    max_depth: int
    random: bool
    background: bool


def distinct(
    scene: Traits, refusals: Mapping[str, str], depths: tuple[int, ...] = DEPTHS
) -> tuple[Method, ...]:
    """Return the methods that differ in a scene, cheapest idea first.

    ``refusals`` tell why the scene does not allow an interpolation or heuristic, by name; empty if
    it does. A merged method has the plainest name: the first of kernels, else the last, such as
    full plan.
    """
    found: dict[Method, list[Method]] = {}
    for method in all_methods(depths):
        if not why_not(method, scene, refusals):
            found.setdefault(_reduced(method, scene), []).append(method)
    made = []
    for reduced, merged in found.items():
        plainest = merged[0 if reduced.is_kernel else -1]
        is_indirect = INTERREFLECTION.label in scene.effects - set(reduced.without)
        made.append(
            structs.replace(
                reduced,
                name=plainest.name,
                family=plainest.family,
                stands_in_for=plainest.stands_in_for,
                names=tuple(method.name for method in merged),
                monte_carlo=not reduced.is_kernel and (scene.random or is_indirect),
            )
        )
    return tuple(made)


def shaded_by(heuristic: Heuristic, method: Method) -> Method:
    """Return a method; if a kernel, its name includes a heuristic other than Phong."""
    if heuristic is PHONG or not method.is_kernel or method.heuristic:
        return method
    name = f"{method.name}: {heuristic.label}"
    return structs.replace(method, name=name, names=(name, *method.names))


def why_not(method: Method, scene: Traits, refusals: Mapping[str, str]) -> str:
    """Return why a scene cannot have a method, in words; empty if it can."""
    # Without an environment in the heuristic half, a stand-in for it has no input.
    indirect = scene.effects - (frozenset() if scene.background else {ENVIRONMENT.label})
    if method.stands_in_for and not indirect.intersection(method.stands_in_for):
        effects = " or ".join(e.label for e in EFFECTS if e.label in method.stands_in_for)
        return f"it stands in for {effects}, which the scene does not have"
    if method.is_kernel:
        words = (refusals.get(name, "") for name in (method.interpolation.value, method.heuristic))
        return next(filter(None, words), "")
    depth = method.max_depth
    if depth is None or scene.max_depth == UNLIMITED or depth <= scene.max_depth:
        return ""
    return f"the scene's own paths end at depth {scene.max_depth}"


def _reduced(method: Method, scene: Traits) -> Method:
    """Return only what a method renders, without what the scene does not have."""
    if method.is_kernel:
        shadows = method.shadows and OCCLUSION.label in scene.effects
        return Method(
            name="",
            family="kernel",
            interpolation=method.interpolation,
            shadows=shadows or scene.kernel_shadows,
            heuristic=method.heuristic,
        )
    without = {*method.without, *([INTERREFLECTION.label] if method.max_depth == 2 else [])}
    is_indirect = INTERREFLECTION.label in scene.effects - without
    is_limited = is_indirect and method.max_depth != scene.max_depth
    return Method(
        name="",
        family="physical",
        without=tuple(sorted(without & scene.effects)),
        max_depth=method.max_depth if is_limited else None,
    )


class Ladder:
    """The methods of a prepared comparison, and a renderer for each of them.

    ``depths`` are those of ``path`` that are methods, and ``stand_ins`` whether heuristics in place
    of transport are. ``left_out`` tells why the scene cannot have a method, by its name.
    """

    def __init__(
        self,
        source: Source,
        options: Options,
        ready: Prepared,
        depths: tuple[int, ...] = DEPTHS,
        stand_ins: bool = True,
    ) -> None:
        self.ready, self.viewing = ready, options.viewing
        self.pairs = Pairs(source, options, ready)
        self.scenes = HybridScenes(self.pairs.plain(), ready.plan, ready.scene)
        plan, differences = ready.plan, set(self.scenes.differences)
        # If both halves have shadows, a method without them differs from both.
        shadows = {OCCLUSION} if plan.calls_for(OCCLUSION) else set()
        sampled = {effect for effect in EFFECTS if effect.sampled}
        if plan.tabulated_environment:
            sampled.remove(ENVIRONMENT)
        self.traits = Traits(
            effects=frozenset(effect.label for effect in differences | shadows),
            kernel_shadows=self.scenes.facts.has_shadows,
            max_depth=plan.scene_depth,
            random=any(plan.calls_for(one) or one in differences for one in sampled),
            background=ready.heuristic.scene.environment() is not None,
        )
        refusals = self._refused_interpolations() | self._refused_heuristics(stand_ins)
        found = distinct(self.traits, refusals, depths)
        self.methods = tuple(shaded_by(named(options.heuristic), method) for method in found)
        reasons = {one.name: why_not(one, self.traits, refusals) for one in all_methods(depths)}
        self.left_out = {name: reason for name, reason in reasons.items() if reason}
        self._kernel_scene = cache(self._make_kernel_scene)

    @property
    def heuristic_variant(self) -> str:
        """The Mitsuba variant of the kernels."""
        return self.pairs.heuristic_variant

    def renderer(self, method: Method, spp: int, size: tuple[int, int] | None = None) -> Renderer:
        """Return a renderer of a method, with samples per pixel of a pass, and an image size."""
        if method.is_kernel:
            with variant(self.heuristic_variant):
                scene, integrator = self._kernel_scene(method.interpolation), self._kernel(method)
                return Renderer(scene, integrator, spp, "image of the kernel", size)
        simulated = {effect for effect in EFFECTS if effect.label not in method.without}
        plan = self.ready.plan.simulating(simulated, method.max_depth)
        scene = self.scenes.of(simulated)
        integrator = physical_integrator(plan, scene, self.ready.pair.hide_emitters)
        return Renderer(scene, integrator, spp, f"image of {method.name}", size)

    def forget(self) -> None:
        """Release the scenes of methods."""
        self._kernel_scene.cache_clear()
        self.scenes.forget()

    def _make_kernel_scene(self, interpolation: Interpolation) -> mi.Scene:
        if interpolation is self.pairs.options.polygon_shading:
            return self.ready.heuristic.scene
        graph = self.pairs.of(interpolation).heuristic
        return with_sampler(graph, self.ready.plan.sampler).instantiate()

    def _kernel(self, method: Method) -> mi.Integrator:
        """Return only the integrator: another scene would slow all others."""
        graph = self.pairs.of(method.interpolation).heuristic.copy()
        props = graph.props(graph.nodes(INTEGRATOR)[0])
        props["occlusion"] = method.shadows
        if method.heuristic:
            props["model"] = method.heuristic
        return graph.instantiate().integrator()

    def _refused_interpolations(self) -> dict[str, str]:
        """Return why shapes or sensor do not allow interpolations: some cannot be meshes."""
        refused = {}
        for interpolation in Interpolation:
            try:
                with variant(self.heuristic_variant):
                    self.pairs.of(interpolation)
            except InputError as error:
                if interpolation is Interpolation.PHONG:
                    raise
                refused[interpolation.value] = str(error)
        return refused

    def _refused_heuristics(self, stand_ins: bool) -> dict[str, str]:
        """Return why the scene does not allow the heuristics of methods that have their own."""
        refused = {}
        with variant(self.heuristic_variant):
            for name in {method.heuristic for method in all_methods()} - {""}:
                refuse = named(name).refuse
                if not stand_ins:
                    refused[name] = "A quick report does not measure it."
                elif refuse:
                    refused[name] = refuse(self.ready.heuristic.scene)
        return refused
