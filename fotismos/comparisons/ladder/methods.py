"""The methods of one scene's ladder, from flat shading to the full plan, and their renderers.

Each method first loses what the scene's plan leaves out. Methods that do not differ in this scene
then become equal, and are merged; the result keeps all their names. Methods from outside come
before the full plan::

    from fotismos.comparisons.records.cost import Method
    from fotismos.comparisons.ladder.methods import declare

    declare(Method(name="no shadows", family="physical", without=("occlusion",), max_depth=2))
"""

from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any, NamedTuple

import mitsuba as mi
from msgspec import structs

from fotismos.comparisons.hybrids import HybridScenes, Pairs
from fotismos.comparisons.prepared import Prepared
from fotismos.comparisons.records.cost import Method
from fotismos.heuristic.declared import Declared
from fotismos.heuristic.errors import InputError
from fotismos.heuristic.heuristics import PHONG, Interpolation, named
from fotismos.heuristic.plugins.interpolated import require_colours
from fotismos.heuristic.tessellation import RESOLUTION
from fotismos.reference.pairing.halves import INTEGRATOR
from fotismos.reference.planning.effects import (
    EFFECTS,
    ENVIRONMENT,
    INTERREFLECTION,
    MICROFACETS,
    OCCLUSION,
    ONE_INTENSITY,
    POLYGONS,
    SPECTRAL,
    TRANSMISSION,
    GlowingEffect,
    PrunedEffect,
    ReplacedEffect,
)
from fotismos.reference.planning.facts import SHAPE
from fotismos.reference.planning.plan import physical_integrator
from fotismos.reference.rendering.renderer import Renderer, variant
from fotismos.reference.rendering.sampler import with_sampler

UNLIMITED = -1

KERNELS = (
    Method(name="flat kernel", family="kernel", interpolation=Interpolation.FLAT),
    Method(name="Gouraud kernel", family="kernel", interpolation=Interpolation.GOURAUD),
    Method(name="Phong kernel", family="kernel"),
    Method(name="kernel with shadows", family="kernel", shadows=True),
)

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
        ("hemisphere ambient", "hemisphere-ambient", (INTERREFLECTION.label, ENVIRONMENT.label)),
    )
)
"""What engines use instead of transport, each with shadows and a textbook's lights."""

PHONG_BSDF = Method(
    name="phong BSDF, full transport",
    family="phong BSDF",
    without=(MICROFACETS.label, TRANSMISSION.label),
)
DIRECT = Method(name="direct", family="physical", without=(INTERREFLECTION.label,))
PATHS = tuple(
    Method(name=f"path {depth}", family="physical", max_depth=depth) for depth in (3, 4, 5)
)
"""Paths of some depths, as Mitsuba counts: 2 is direct light."""

FULL_PLAN = Method(name="full plan", family="physical")

BUILT_IN = (*KERNELS, *STAND_INS, PHONG_BSDF, DIRECT, *PATHS, FULL_PLAN)
"""The package's own methods, cheapest idea first."""


class Methods(Declared[Method]):
    """All methods; one from outside leaves out what a plan can leave out."""

    def declare(self, declaration: Method) -> Method:
        """Add a method to every ladder and return it; it replaces a declared one of its name.

        ``InputError`` for a name of the package itself, and for an effect that a plan cannot leave
        out: it needs the kernel, or a second image.
        """
        allowed = [
            effect.label
            for effect in EFFECTS
            if isinstance(effect, (PrunedEffect, ReplacedEffect))
            and not isinstance(effect, GlowingEffect)
        ]
        for effect in declaration.without:
            if effect not in allowed:
                raise InputError(
                    f"a method without {effect} is not possible: leave out some of"
                    f" {', '.join(allowed)}."
                )
        super().declare(declaration)
        return declaration


METHODS = Methods("method", "fotismos.methods")
"""All methods, the package's own first."""

for _method in BUILT_IN:
    METHODS.own(_method)

declare = METHODS.declare
"""Declare a method and return it; every ladder then has it."""


def all_methods(is_short: bool = False) -> tuple[Method, ...]:
    """Return all methods, cheapest idea first.

    A short ladder has only the shortest of the paths, and nothing that stands in for transport.
    """
    left_out = (FULL_PLAN, *STAND_INS, *PATHS[1:]) if is_short else (FULL_PLAN,)
    return (*(method for method in METHODS.values() if method not in left_out), FULL_PLAN)


class Step(NamedTuple):
    """Two methods of which the second has one effect more, and the step's weight in a sum.

    Without an ``effect``, both simulate the same: the kernel, and Mitsuba's integrator on the
    scene's own shapes.
    """

    effect: str
    weight: float
    before: Method
    after: Method


class Ladder:
    """The methods of a prepared comparison, and a renderer for each of them.

    ``left_out`` tells why the scene cannot have a method, by its name. All kernels have the same
    mesh, or the scene's own shapes.
    """

    def __init__(self, ready: Prepared, is_short: bool = False) -> None:
        # Flat and Gouraud shading need vertices: all kernels get a mesh, the default one.
        options = ready.options
        if options.polygon_shading is not Interpolation.PHONG and options.tessellation is None:
            options = options.changed(tessellation=RESOLUTION)
        self.ready = ready
        self.options = options
        self.pairs = Pairs(ready, options)
        self.scenes = HybridScenes(self.pairs.plain(), ready.plan, ready.scene)
        plan = ready.plan
        differences = set(self.scenes.differences)
        # If both halves have shadows, a method without them differs from both.
        shadows = {OCCLUSION} if plan.calls_for(OCCLUSION) else set()
        self._effects = frozenset(effect.label for effect in differences | shadows)
        sampled = {effect for effect in EFFECTS if effect.sampled}
        # Light from a table needs no random numbers.
        if plan.tabulated_environment:
            sampled.remove(ENVIRONMENT)
        self._is_random = any(plan.calls_for(effect) or effect in differences for effect in sampled)
        refusals = self._refused_interpolations() | self._refused_heuristics()
        merged: dict[Method, list[Method]] = {}
        self.left_out: dict[str, str] = {}
        for method in all_methods(is_short):
            if reason := self._why_not(method, refusals):
                self.left_out[method.name] = reason
            else:
                merged.setdefault(self._form(method), []).append(method)
        self._known = {form: self._merged(form, alike) for form, alike in merged.items()}
        # A scene is made when a method first needs it, and others share it.
        self._kernel_scene = cache(self._make_kernel_scene)
        self._plan_scene = cache(self.scenes.of)

    @property
    def methods(self) -> tuple[Method, ...]:
        """The methods that differ in the scene, cheapest idea first."""
        return tuple(self._known.values())

    def _form(self, method: Method) -> Method:
        """Return only what a method renders, without what the scene does not have."""
        if method.is_kernel:
            # Where the plan needs no shadow rays, they change nothing; the scene's own are kept.
            shadows = method.shadows and OCCLUSION.label in self._effects
            return Method(
                name="",
                family="kernel",
                interpolation=method.interpolation,
                shadows=shadows or self.scenes.facts.has_shadows,
                heuristic=method.heuristic,
            )
        # Paths of depth 2 are direct light, under another name.
        without = {*method.without, *([INTERREFLECTION.label] if method.max_depth == 2 else [])}
        is_limited = (
            INTERREFLECTION.label in self._effects - without
            and method.max_depth != self.ready.plan.scene_depth
        )
        return Method(
            name="",
            family="physical",
            without=tuple(sorted(without & self._effects)),
            max_depth=method.max_depth if is_limited else None,
        )

    def _merged(self, form: Method, alike: list[Method]) -> Method:
        """Return methods of one form as one, named as the first of kernels, or the last of plans.

        The name of a kernel includes a heuristic other than Phong.
        """
        plainest = alike[0 if form.is_kernel else -1]
        heuristic = named(self.options.heuristic)
        name = plainest.name
        names = tuple(method.name for method in alike)
        if form.is_kernel and heuristic is not PHONG and not form.heuristic:
            name = f"{name}: {heuristic.label}"
            names = (name, *names)
        is_indirect = INTERREFLECTION.label in self._effects - set(form.without)
        return structs.replace(
            form,
            name=name,
            family=plainest.family,
            stands_in_for=plainest.stands_in_for,
            names=names,
            monte_carlo=not form.is_kernel and (self._is_random or is_indirect),
        )

    def _why_not(self, method: Method, refusals: Mapping[str, str]) -> str:
        """Return why the scene cannot have a method, in words; empty if it can.

        ``refusals`` are ``{interpolation or heuristic: why it cannot be measured}``.
        """
        # Without an environment in the heuristic half, a stand-in for it has no input.
        has_background = self.ready.heuristic.scene.environment() is not None
        missing = self._effects - (set() if has_background else {ENVIRONMENT.label})
        if method.stands_in_for and not missing.intersection(method.stands_in_for):
            effects = " or ".join(e.label for e in EFFECTS if e.label in method.stands_in_for)
            return f"it replaces {effects}, which the scene does not have"
        if method.is_kernel:
            found = (refusals.get(name) for name in (method.interpolation.value, method.heuristic))
            return next(filter(None, found), "")
        depth = method.max_depth
        scene_depth = self.ready.plan.scene_depth
        is_there = depth is None or scene_depth == UNLIMITED or depth <= scene_depth
        return "" if is_there else f"the scene's own paths end at depth {scene_depth}"

    def renderer(self, method: Method, spp: int, size: tuple[int, int] | None = None) -> Renderer:
        """Return a renderer of a method, with samples per pixel of a pass, and an image size."""
        if method.is_kernel:
            with variant(method.variant or self.pairs.heuristic_variant):
                scene = self._kernel_scene(method.interpolation, mi.variant())
                return Renderer(
                    scene,
                    self._kernel(method),
                    pass_spp=spp,
                    label="image of the kernel",
                    size=size,
                )
        simulated = {effect for effect in EFFECTS if effect.label not in method.without}
        plan = self.ready.plan.simulating(simulated, method.max_depth)
        scene = self._plan_scene(self.scenes.key(simulated))
        integrator = physical_integrator(plan, scene, self.ready.pair.hide_emitters)
        return Renderer(scene, integrator, pass_spp=spp, label=f"image of {method.name}", size=size)

    def forget(self) -> None:
        """Release the scenes of methods."""
        self._kernel_scene.cache_clear()
        self._plan_scene.cache_clear()

    def steps(self) -> Iterator[Step]:
        """Yield the steps from the kernel as requested to the full plan, an effect at a time.

        The kernel gains the effects that it can have. Then plans gain the others, half of the
        weight in their order, and half in the reverse one.
        """
        effects = [effect.label for effect in self.pairs.effects(self.scenes.differences)]
        kernel = self._form(KERNELS[2])
        kernel = structs.replace(kernel, interpolation=self.options.polygon_shading)
        # What the kernel can have, one effect after another.
        changes: dict[str, dict[str, Any]] = {
            POLYGONS.label: {"interpolation": Interpolation.PHONG},
            OCCLUSION.label: {"shadows": True},
            SPECTRAL.label: {"variant": self.ready.reference.variant},
            ONE_INTENSITY.label: {},  # which the kernel has at no cost
        }
        for label, change in changes.items():
            if label in effects:
                before = self._named(kernel)
                kernel = structs.replace(kernel, **change)
                yield Step(effect=label, weight=1.0, before=before, after=self._named(kernel))
        # What an effect adds depends on what is there already: both orders count half.
        others = [effect for effect in effects if effect not in changes]
        for order in (others, others[::-1]):
            # Each plan leaves out one effect fewer; the last leaves out none.
            plans = [
                self._named(self._form(structs.replace(FULL_PLAN, without=tuple(order[number:]))))
                for number in range(len(order) + 1)
            ]
            yield Step(effect="", weight=0.5, before=self._named(kernel), after=plans[0])
            for label, before, after in zip(order, plans, plans[1:], strict=False):
                yield Step(effect=label, weight=0.5, before=before, after=after)

    def _named(self, form: Method) -> Method:
        """Return the ladder's method of a form, or the form with a name."""
        left_out = ", ".join(form.without)
        name = f"kernel in {form.variant}" if form.is_kernel else f"full plan without {left_out}"
        return self._known.get(form) or structs.replace(form, name=name)

    def _make_kernel_scene(self, interpolation: Interpolation, name: str) -> mi.Scene:
        is_pairs_variant = name == self.pairs.heuristic_variant
        if is_pairs_variant and interpolation is self.options.polygon_shading:
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
        with variant(self.pairs.heuristic_variant):
            smooth = self._shapes(Interpolation.PHONG)
            for interpolation in (Interpolation.FLAT, Interpolation.GOURAUD):
                try:
                    require_colours()
                    # On other shapes, a time would compare meshes rather than shading.
                    if self._shapes(interpolation) != smooth:
                        refused[interpolation.value] = (
                            "for meshes only: give `tessellation` to measure all on one mesh"
                        )
                except InputError as error:
                    refused[interpolation.value] = str(error)
        return refused

    def _shapes(self, interpolation: Interpolation) -> list[str]:
        graph = self.pairs.of(interpolation).heuristic
        return [graph.plugin(index) for index in graph.nodes(SHAPE)]

    def _refused_heuristics(self) -> dict[str, str]:
        """Return why the scene does not allow the heuristics of methods that have their own."""
        refused = {}
        with variant(self.pairs.heuristic_variant):
            for name in {method.heuristic for method in all_methods()} - {""}:
                refuse = named(name).refuse
                if refuse:
                    refused[name] = refuse(self.ready.heuristic.scene)
        return refused
