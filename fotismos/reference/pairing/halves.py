"""The two halves of a pair, derived from one scene.

A scene may be physical (a user's), heuristic (a textbook figure), or a mixture: the textbook half
replaces physical parts, the physical half replaces heuristic parts, and parts of the right kind
stay. Both keep the scene's geometry, cameras and films.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

import mitsuba as mi
import numpy as np

from fotismos.heuristic.errors import FotismosError, InputError
from fotismos.heuristic.heuristics import PHONG, Interpolation, named
from fotismos.heuristic.plugins import register
from fotismos.reference.pairing import bsdfs, emitters
from fotismos.reference.pairing.factors import Convention, Replacements, specular_albedo
from fotismos.reference.pairing.pairing_record import Override, Pairing, Unrepresentable
from fotismos.reference.pairing.settings import Settings, complete
from fotismos.reference.rendering.gbuffer import GBuffer, gbuffer
from fotismos.reference.scene import spectra, values
from fotismos.reference.scene.graph import Graph, properties
from fotismos.reference.scene.messages import plain_message
from fotismos.reference.scene.source import Source

BSDF = mi.ObjectType.BSDF
EMITTER = mi.ObjectType.Emitter
INTEGRATOR = mi.ObjectType.Integrator
MEDIUM = mi.ObjectType.Medium
SHAPE = mi.ObjectType.Shape


@dataclass(frozen=True)
class Pair:
    """Two scenes that show the same thing, and how each was derived.

    ``heuristic`` and ``physical`` are graphs, to be copied before an edit. ``max_depth``,
    ``integrator`` and ``rr_depth`` are the scene's own: -1 for no limit, None if omitted. ``media``
    are labels and plugins of participating media, ``shading`` names the declaration that shades the
    textbook half (:mod:`fotismos.heuristic.heuristics`).
    """

    name: str
    heuristic: Graph
    physical: Graph
    hide_emitters: bool
    max_depth: int
    pairing: Pairing
    unrepresentable: tuple[Unrepresentable, ...] = ()
    warnings: tuple[str, ...] = ()
    integrator: str | None = None
    rr_depth: int | None = None
    media: tuple[tuple[str, str], ...] = ()
    overridden: tuple[Override, ...] = ()
    shading: str = PHONG.name


@dataclass(frozen=True)
class PairOptions:
    """How both halves are derived from a scene.

    FLAT and GOURAUD make meshes of the textbook half's shapes, by ``tessellation``
    (:mod:`fotismos.heuristic.tessellation`), with vertex normals by ``vertex_weights`` (6.32 to
    6.34); if one of the two is given, PHONG gets meshes too. ``prune``
    lets the kernel leave out the terms that no material has. ``heuristic`` names the declaration
    that shades the textbook half; ``with_partners`` lets its materials know their physical
    parameters (:mod:`fotismos.reference.pairing.nearest`), as they do for every user's heuristic.
    """

    convention: Convention = Convention.MATCHED
    resolution: tuple[int, int] | None = None
    interpolation: Interpolation = Interpolation.PHONG
    tessellation: int | None = None
    vertex_weights: str | None = None
    prune: bool = True
    sensor: int = 0
    heuristic: str = PHONG.name
    with_partners: bool = False

    @property
    def has_meshes(self) -> bool:
        """Whether the textbook half's shapes become meshes."""
        is_phong = self.interpolation is Interpolation.PHONG
        return not is_phong or bool(self.tessellation or self.vertex_weights)


def pair(source: Source, options: PairOptions | None = None) -> Pair:
    """Derive both halves of a scene, for the current variant."""
    options = options or PairOptions()
    register()
    graph = source.parse()
    settings = complete(graph, options.resolution, options.sensor)
    try:
        return _paired(graph, settings, options)
    except FotismosError:
        raise
    except Exception as error:
        graph.instantiate()  # Mitsuba's message is better, if it rejects the scene too
        if isinstance(error, RuntimeError):  # as Mitsuba's are
            raise InputError(f"{graph.name}: {plain_message(error)}") from error
        raise


def _paired(graph: Graph, settings: Settings, options: PairOptions) -> Pair:
    # The geometry alone, for lights that must be measured.
    bare = graph.copy()
    for shape in bare.nodes(SHAPE):
        for kind in (BSDF, MEDIUM):
            for key, _ in bare.children(shape, kind):
                bare.detach(shape, key)
    geometry = cache(bare.instantiate)

    @cache
    def unlit_surface() -> GBuffer:
        unlit = bare.copy()
        for shape in unlit.nodes(SHAPE):
            if unlit.children(shape, EMITTER):
                unlit.remove(shape)
        return gbuffer(unlit.instantiate())

    # The textbook half.
    model = named(options.heuristic)
    half = graph.copy()
    replaced = Replacements()
    for_users = options.with_partners or not model.is_builtin
    context = bsdfs.Context(half, options.convention, for_users=for_users)
    if any(half.plugin(index) not in bsdfs.RULES for index in half.nodes(BSDF)):
        # Loaded late: only for lobes and transmission.
        from fotismos.reference.pairing import nearest

        context.rule_of = nearest.rule_of
    bsdfs.to_heuristic(context, replaced)
    for index in half.nodes(BSDF, "phong") if model.form else ():
        half.props(index)["form"] = model.form
    ambient = emitters.to_heuristic(
        half,
        geometry=geometry,
        surface=unlit_surface,
        hide_emitters=settings.hide_emitters,
        replaced=replaced,
    )
    if settings.ambient is not None:
        own = 0.0 if ambient is None else ambient
        ambient = values.total_emission(half, settings.ambient, own)
    extra = {} if ambient is None else {"ambient": ambient}
    props = properties(
        "heuristic",
        hide_emitters=settings.hide_emitters,
        occlusion=settings.occlusion or "visible" in model.needs,
        interpolation=options.interpolation.value,
        prune=options.prune,
        model=model.name,
        **extra,
    )
    props.set_id("integrator")  # identifies its parameters
    half.attach(0, "integrator", half.add(INTEGRATOR, props))
    if options.has_meshes:
        # Loaded late: few scenes are made into triangles.
        from fotismos.reference.pairing import polygons

        polygons.replace_shapes(
            half,
            geometry(),
            resolution=options.tessellation,
            interpolation=options.interpolation,
            weights=options.vertex_weights,
        )

    # The physical half.
    physical = graph.copy()
    emitters.add_glowing_shapes(physical, replaced)
    bsdfs.to_physical(physical, options.convention, replaced)
    emitters.to_physical(physical, lambda: gbuffer(geometry()), replaced)
    if settings.ambient is not None:
        emitters.add_environment(
            physical,
            graph,
            ambient=settings.ambient,
            convention=options.convention,
            replaced=replaced,
        )

    media = tuple((graph.label(index), graph.plugin(index)) for index in graph.nodes(MEDIUM))
    for label, plugin in media:
        replaced.lose(label, plugin, "participating medium", "left out")
    return Pair(
        name=graph.name,
        heuristic=half,
        physical=physical,
        hide_emitters=settings.hide_emitters,
        max_depth=settings.max_depth,
        pairing=Pairing(
            convention=options.convention.value,
            bsdfs=tuple(replaced.bsdfs),
            emitters=tuple(replaced.emitters),
            misses=tuple(replaced.misses),
        ),
        unrepresentable=tuple(dict.fromkeys(replaced.lost)),
        warnings=(
            *spectra.doubts(graph),
            *_energy_warnings(half),
            *_mirrored_spheres(graph),
            *model.remarks,
        ),
        integrator=settings.integrator,
        rr_depth=settings.rr_depth,
        media=media,
        overridden=tuple(settings.overridden),
        shading=model.name,
    )


def _mirrored_spheres(graph: Graph) -> Iterator[str]:
    for index in graph.nodes(SHAPE, "sphere"):
        props = graph.props(index)
        matrix = np.array(props.get("to_world", mi.ScalarTransform4f()).matrix, float)
        is_mirrored = np.linalg.det(matrix[:3, :3]) * props.get("radius", 1.0) < 0
        bsdfs_of = [graph.plugin(child) for _, child in graph.children(index, BSDF)]
        if is_mirrored and not props.get("flip_normals", False) and "twosided" not in bsdfs_of:
            yield (
                f"{graph.label(index)}: a transform or a negative radius mirrors the sphere, so in"
                " Mitsuba its normals point inwards, and a surface of one side is black from"
                " outside. Take the mirroring away, or set flip_normals."
            )


def _energy_warnings(graph: Graph) -> Iterator[str]:
    for index in graph.nodes(BSDF, "phong"):
        try:
            material = bsdfs.phong(graph, index)
        except InputError:
            continue  # a texture; its values are not known here
        reflected = max(np.add(material.k_d, specular_albedo(material)))
        if reflected > 1 + 1e-6:
            yield (
                f"{graph.label(index)}: reflects {reflected:.3g} times the light that it receives"
                " at normal incidence (k_d and the lobe's albedo): no physical material does."
            )
