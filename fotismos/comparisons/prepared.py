"""A scene made ready to be rendered: paired, planned, probed, with a renderer for each half."""

import gc
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from time import perf_counter
from typing import TYPE_CHECKING, Any, ClassVar

import drjit as dr
import mitsuba as mi
import numpy as np
from msgspec import structs
from numpy.typing import NDArray

from fotismos.comparisons.departure import regions
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.halves import Halves, Part
from fotismos.comparisons.options import Options
from fotismos.comparisons.records.images import Images
from fotismos.heuristic import meshes
from fotismos.heuristic.convention import Scene
from fotismos.heuristic.errors import InputError
from fotismos.heuristic.heuristics import PHONG, named
from fotismos.heuristic.program import LIBRARIES
from fotismos.reference.pairing import halves
from fotismos.reference.pairing.factors import Convention
from fotismos.reference.pairing.halves import Pair
from fotismos.reference.pairing.pairing_record import Override
from fotismos.reference.pairing.settings import film_size
from fotismos.reference.planning.guard import examine_plan
from fotismos.reference.planning.plan import physical_integrator, plan
from fotismos.reference.planning.plan_record import Guard, Plan
from fotismos.reference.planning.rules import SAMPLED_AS_HIT
from fotismos.reference.records import SAMPLER, STOCK_SAMPLER
from fotismos.reference.rendering.direct import is_behind_two_lamps
from fotismos.reference.rendering.gbuffer import (
    GBuffer,
    centre_rays,
    gbuffer,
    image_size,
    require_surface,
)
from fotismos.reference.rendering.passes import Size
from fotismos.reference.rendering.renderer import LARGEST_PASS, Renderer, require_memory, variant
from fotismos.reference.rendering.sampler import with_sampler
from fotismos.reference.scene.checks import require_frames
from fotismos.reference.scene.source import Source

if TYPE_CHECKING:  # few comparisons have pictures
    from fotismos.comparisons.pictures import GivenPictures

WAVEFRONT = 2**24
"""Most samples of one pass, unless the image has more pixels: then one sample per pixel."""

MOST_TILT = 0.01
"""Difference of a lamp's mean normals, of its surface and its vertices, beyond which its light is
wrong: at a right angle to a flat lamp, as a share. Those of a smoothed ball cancel."""

TEMPLATE_SPP = 16
"""Samples per pixel of the textbook picture whose edges and colours pictures may have."""

LIMIT_SPP = 4096
"""Samples per pixel at which a run with a noise target stops, unless another limit is given."""


def schedule(
    plan: Plan, pixels: int, spp: int | None = None, noise: float | None = None
) -> tuple[int, int]:
    """Return samples per pixel and pass, and the number of passes, which is even and at least 2.

    The plan's are the defaults. ``spp`` are the samples per pixel over all passes; with a noise
    target, their limit.
    """
    largest = max(1, WAVEFRONT // pixels)
    if noise is not None:
        # At most half the limit, so that two passes fit into it.
        per_pass = min(max(1, plan.spp // plan.passes), largest)
        per_pass = max(1, min(per_pass, (spp or LIMIT_SPP) // 2))
        return per_pass, max(2, (spp or LIMIT_SPP) // per_pass // 2 * 2)
    spp = spp or plan.spp
    # With few samples there are fewer passes, of at least 4 samples if possible.
    passes = max(2, min(plan.passes, spp // 4 // 2 * 2))
    per_pass = max(1, spp // passes)
    if per_pass > largest:
        per_pass = largest
        passes = max(2, -(-spp // largest // 2) * 2)
    return per_pass, passes


@dataclass(frozen=True, kw_only=True)
class Prepared(Halves):
    """A scene that is ready to be rendered: its pair, its plan, and a renderer for each half.

    Pictures may stand in for ``heuristic`` as the ``first`` source, or for ``reference`` as the
    ``second``; the renderers are those of the scene all the same.
    """

    source: Source
    pair: Pair
    plan: Plan
    scene: Scene
    heuristic: Renderer
    reference: Renderer
    guard: Guard | None = None

    libraries: ClassVar[Sequence[str]] = LIBRARIES

    @property
    def size(self) -> Size:
        """Width and height of both halves, in pixels."""
        return self.reference.size

    @property
    def spp(self) -> int:
        return self.reference.pass_spp * self.passes

    def with_pictures(self, given: "GivenPictures") -> "Prepared":
        """Return the scene with pictures in place of its halves, as far as they are given.

        There is a pass for each repeat, if there are any, with as many samples in all.
        """
        given.require_size_of_mask(self.options, self.size)
        passes = given.passes or self.passes
        spp = max(1, self.spp // passes)
        heuristic = self.heuristic.sampled(spp)
        reference = self.reference.sampled(spp)
        halves: dict[Part, Any] = {"textbook": given.image, "physical": given.reference}
        replaced: set[Part] = {part for part, half in halves.items() if half is not None}
        return replace(
            self,
            passes=passes,
            heuristic=heuristic,
            reference=reference,
            first=given.image or heuristic,
            second=given.reference or reference,
            has=self.has - replaced | ({"pictures"} if replaced else set()),
            is_exact=self.is_exact and not replaced,  # pictures have a noise of their own
            **given.parts(),
        )

    @property
    def rendered(self) -> list[Renderer]:
        """The renderers among both sources."""
        return [half for half in (self.first, self.second) if isinstance(half, Renderer)]

    def traced(self, finer: int = 1) -> GBuffer:
        """Return what each pixel sees; traced at each call, since it takes much memory.

        Each side of a pixel has ``finer`` rays.
        """
        width, height = self.size
        surface = gbuffer(self.scene, (finer * width, finer * height), film=self.size)
        dr.flush_malloc_cache()
        return surface

    def shaded_by_textbook(self) -> Renderer:
        """Return what renders the textbook half with Phong's model in place of its own."""
        options = self.options.changed(heuristic=PHONG.name)
        pair = pair_for(self.source, options)
        return _heuristic_renderer(
            self.source, pair, chosen=self.plan, spp=self.reference.pass_spp, options=options
        )

    def template(self) -> tuple[Sequence[np.ndarray], np.ndarray | None]:
        from fotismos.comparisons import alignment  # loaded late: few comparisons have pictures

        textbook = None
        if "textbook" not in self.has:
            textbook = np.array(self.heuristic.sampled(TEMPLATE_SPP).render(0), float)
        return alignment.scene_edges(self.traced(alignment.FINER), textbook), textbook

    @cached_property
    def unpruned(self) -> Renderer | None:
        """Return what renders the physical half with everything simulated.

        None if its plan does so.
        """
        whole = self.plan.unpruned()
        if (whole.integrator, whole.max_depth) == (self.plan.integrator, self.plan.max_depth):
            return None
        integrator = physical_integrator(whole, self.scene, self.pair.hide_emitters)
        spp = self.reference.pass_spp
        return Renderer(
            self.scene, integrator, pass_spp=spp, label="everything simulated", size=self.size
        )

    @cached_property
    def counted(self) -> NDArray[Any]:
        """The pixels (H, W) that count: those that see a surface, and that pictures do not hide."""
        hit = self.traced().hit
        return hit if self.where is None else hit & self.where

    def with_objects(self, images: Images) -> tuple[dict[str, Any], Images]:
        surface = self.traced()
        error = images.maps[LEADING.name]
        shapes, seen = regions.find_objects(
            error, self.counted, owners=surface.shape, materials=surface.bsdf
        )
        materials, made_of = regions.find_objects(error, self.counted, surface.bsdf)
        images = replace(
            images,
            position=surface.position,
            normal=surface.normal,
            objects=seen,
            materials=made_of,
        )
        return {"objects": shapes, "materials": materials}, images

    def fields(self, passes: int) -> dict[str, Any]:
        return super().fields(passes) | {
            "variant": self.reference.variant,
            "heuristic_variant": self.heuristic.variant,
            "interpolation": self.options.polygon_shading.value,
            "plan": self.plan_record(passes) if "physical" in self.has else None,
            "pairing": self.pair.pairing,
            "unrepresentable": self.pair.unrepresentable,
            "integrator_given": self.pair.integrator,
            "overridden": self.overridden,
            "warnings": tuple(self.warnings()),
        }

    def caution(self, test: np.ndarray, reference: np.ndarray) -> str:
        return self.doubt() or self.require_light(test, reference)

    def require_light(self, test: np.ndarray, reference: np.ndarray) -> str:
        try:
            return super().require_light(test, reference)
        except InputError as error:  # a warning may name the reason
            raise InputError(" ".join([str(error), *self.pair.warnings])) from error

    @property
    def overridden(self) -> tuple[Override, ...]:
        """The settings of the scene that are not used, and what is used instead."""
        pair = self.pair
        plan = self.plan
        used = f"{plan.sampler}, {self.spp} samples per pixel"
        overrides = [
            structs.replace(entry, used=used) if entry.what == "sampler" else entry
            for entry in pair.overridden
        ]
        asks_for_volumes = pair.media or pair.integrator in ("volpath", "volpathmis")
        if plan.integrator == "volpath" and not asks_for_volumes:
            used = "volpath: others err behind masks, and on curved shapes behind hidden lamps"
            overrides.append(
                Override(what="integrator", given=pair.integrator or "path", used=used)
            )
        if pair.rr_depth is not None and pair.rr_depth != plan.rr_depth:
            overrides.append(
                Override(what="rr_depth", given=str(pair.rr_depth), used=str(plan.rr_depth))
            )
        return tuple(overrides)

    def doubt(self) -> str:
        """Return where no integrator of Mitsuba is right, in words; empty if there is none."""
        if "physical" not in self.has:
            return ""
        for shape in self.scene.shapes():
            if shape.emitter() is None or not shape.is_mesh():
                continue
            of_faces, of_vertices = meshes.mean_normals(shape)
            tilt = float(np.linalg.norm(of_faces - of_vertices))
            if tilt > MOST_TILT:
                return (
                    f"The reference is wrong: the normals of the lamp {shape.id()} are tilted from"
                    f" its surface, by {tilt:.2g} on average, and Mitsuba samples it by them. Give"
                    " the mesh face_normals."
                )
        if not (self.pair.hide_emitters and self.plan.integrator in ("volpath", "volpathmis")):
            return ""
        rays = centre_rays(self.scene, self.size, film=self.size)
        count = int(np.sum(is_behind_two_lamps(self.scene, rays)))
        if not count:
            return ""
        return (
            f"The reference is wrong at {count} pixels, which see a shape through both sides of a"
            " hidden lamp: no integrator of Mitsuba is right there. Show the lamp, or make it flat."
        )

    def plan_record(self, passes: int) -> Plan:
        """Return the plan with the samples and passes that were rendered."""
        spp = self.reference.pass_spp * passes
        reads = named(self.pair.shading).inputs
        return structs.replace(
            self.plan, spp=spp, passes=passes, heuristic_reads=reads, guard=self.guard
        )

    def warnings(self) -> Iterator[str]:
        """Yield what is odd about a scene: its pair, its plan, or how Mitsuba renders it."""
        yield from self.pair.warnings
        if "physical" not in self.has:
            return
        if self.guard and self.guard.state == "disagreed":
            yield (
                f"The plan changes the light: {self.guard.words}. So everything was simulated. A"
                " rule of pruning is wrong for this scene: please report it."
            )
        for rule in self.plan.rules:
            if rule.premise == SAMPLED_AS_HIT.sentence:
                yield (
                    f"{rule.evidence}, so the reference depends on how Mitsuba weights the two."
                    " Give a mesh with face_normals, or a cylinder that is round and not mirrored."
                )


def pair_options(options: Options) -> halves.PairOptions:
    """Return how options derive the halves."""
    return halves.PairOptions(
        convention=Convention(options.pairing),
        resolution=options.resolution,
        interpolation=options.polygon_shading,
        tessellation=options.tessellation,
        vertex_weights=options.vertex_weights,
        prune=not options.everything,
        sensor=options.sensor,
        heuristic=options.heuristic,
    )


def pair_for(source: Source, options: Options) -> Pair:
    """Derive both halves of a scene as the options say, for the current variant."""
    return halves.pair(source, pair_options(options))


def prepare(source: Source, options: Options | None = None) -> Prepared:
    """Pair and plan a scene in the current variant, and make both halves ready to render."""
    begin = perf_counter()
    options = options or Options()
    if options.tone_map and not options.image:
        raise InputError(
            f"tone_map = {options.tone_map} and no image: it is the curve of a picture. Give an"
            " `image`, or omit it."
        )
    given = None
    if options.image or options.reference or options.mask is not None:
        from fotismos.comparisons import pictures  # loaded late: few comparisons have any

        given = pictures.read_all(options)
        options = given.sized(film_size(source.parse(), options.sensor), options)
    pair = pair_for(source, options)
    sampler = STOCK_SAMPLER if options.everything else SAMPLER
    physical = with_sampler(pair.physical, sampler).instantiate()
    require_frames(source.name, physical)
    width, height = image_size(physical)
    if width * height > LARGEST_PASS:
        raise InputError(
            f"{source.name}: an image of {width}x{height} pixels is too large: at most"
            f" {LARGEST_PASS} pixels are allowed. Give a smaller `resolution`."
        )
    require_memory(source.name, width, height)
    planning = perf_counter()
    chosen = plan(pair, physical, options.polygon_shading, options.everything)
    integrator = physical_integrator(chosen, physical, pair.hide_emitters)
    planning = perf_counter() - planning
    # Dr.Jit traces every live BSDF: those of finished scenes would slow this one.
    gc.collect()
    spp, passes = schedule(chosen, width * height, spp=options.spp, noise=options.noise)
    heuristic = _heuristic_renderer(source, pair, chosen=chosen, spp=spp, options=options)
    reference = Renderer(
        physical, integrator, pass_spp=spp, label="physical picture", warnings=pair.warnings
    )
    has: set[Part] = {"scene", "textbook", "physical"}
    if not named(options.heuristic).is_builtin:
        has.add("shader")
    ready = Prepared(
        name=source.name,
        options=options,
        first=heuristic,
        second=reference,
        passes=passes,
        has=frozenset(has),
        is_exact=chosen.exact,
        seconds={"scene and pairing": perf_counter() - begin - planning, "planning": planning},
        source=source,
        pair=pair,
        plan=chosen,
        scene=physical,
        heuristic=heuristic,
        reference=reference,
    )
    return ready if given is None else ready.with_pictures(given)


def guarded(source: Source, options: Options | None = None) -> Prepared:
    """Prepare a scene with :func:`prepare`, and probe it before anything relies on its plan.

    If the probe disagrees with the plan, everything is simulated. A view in which no pixel sees a
    surface raises `InputError`, unless the options allow it.
    """
    options = options or Options()
    ready = prepare(source, options)
    found = None
    if "physical" in ready.has:  # else no plan is followed
        width, height = ready.size
        found = examine_plan(
            ready.plan,
            ready.scene,
            hide_emitters=ready.pair.hide_emitters,
            samples=ready.spp * width * height,
            seed=options.seed,
        )
        if found.state == "disagreed":
            ready = prepare(source, options.changed(everything=True))
            ready = replace(ready, plan=ready.plan.unpruned("guard", found.words))
    # The options are those given, even if everything had to be simulated.
    seconds = {**ready.seconds, "guard": found.seconds if found else 0.0}
    ready = replace(ready, options=options, guard=found, seconds=seconds)
    if not options.allow_empty:
        require_surface(ready.counted, source.name)
    return ready


def _heuristic_renderer(
    source: Source, pair: Pair, chosen: Plan, spp: int, options: Options
) -> Renderer:
    """Make the textbook half ready to render, in its own variant if it has one."""
    with variant(options.heuristic_variant or mi.variant()):
        if options.heuristic_variant:
            pair = pair_for(source, options)
        scene = with_sampler(pair.heuristic, chosen.sampler).instantiate()
        label = "textbook picture"
        return Renderer(scene, None, pass_spp=spp, label=label, warnings=pair.warnings)
