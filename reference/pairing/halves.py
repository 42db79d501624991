"""The two halves of a pair, derived from one scene.

A scene may be physical (a user's), heuristic (a textbook figure), or a mixture: the heuristic half
replaces physical parts, the physical half replaces heuristic parts, and parts of the right kind
stay. Both keep the scene's geometry, cameras and films.
"""

from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache

import mitsuba as mi
import numpy as np

from heuristic.errors import FotismosError, InputError
from heuristic.heuristics import PHONG, named
from heuristic.interpolation import Interpolation
from heuristic.plugins import register
from reference.pairing import bsdfs, lights
from reference.pairing.factors import Convention, Miss, specular_albedo
from reference.pairing.lights import areas, environments
from reference.rendering.gbuffer import gbuffer
from reference.scene import preparation
from reference.scene.graph import Graph, properties
from reference.scene.preparation import Overridden
from reference.scene.source import Source

BSDF, INTEGRATOR, SENSOR = (
    getattr(mi.ObjectType, kind) for kind in ("BSDF", "Integrator", "Sensor")
)


@dataclass(frozen=True)
class Pair:
    """Two scenes that show the same thing, and how each was derived.

    Attributes
    ----------
    name
        The scene's name.
    heuristic, physical
        Graphs of the two halves; :meth:`Graph.instantiate` makes the Mitsuba scenes.
    hide_emitters
        Whether camera rays do not see lights and environment; the same in both halves.
    max_depth
        The scene's own limit on path length, -1 for none.
    convention, bsdfs, emitters, misses, warnings
        The replacements.
    integrator, rr_depth
        The scene's own integrator and where it begins Russian roulette, None if omitted.
    media
        Labels and plugins of participating media.
    overridden
        What the scene requests and does not get, :class:`reference.scene.preparation.Overridden`.
    shading
        Name of the declaration that shades the heuristic half (:mod:`heuristic.heuristics`).
    """

    name: str
    heuristic: Graph
    physical: Graph
    hide_emitters: bool
    max_depth: int
    convention: Convention
    bsdfs: tuple
    emitters: tuple
    misses: tuple[Miss, ...]
    warnings: tuple[str, ...]
    integrator: str | None = None
    rr_depth: int | None = None
    media: tuple[tuple[str, str], ...] = ()
    overridden: tuple[Overridden, ...] = ()
    shading: str = PHONG.name


def pair(
    source: Source,
    convention: Convention = Convention.MATCHED,
    resolution: tuple[int, int] | None = None,
    interpolation: Interpolation = Interpolation.PHONG,
    tessellation: int | None = None,
    prune: bool = True,
    sensor: int = 0,
    heuristic: str = PHONG.name,
    with_partners: bool = False,
) -> Pair:
    """Derive both halves of a scene, for the current variant.

    Parameters
    ----------
    source
        The scene.
    convention
        How roughplastic and phong are paired.
    resolution
        Width and height in place of the film's.
    interpolation
        Interpolation of the heuristic half. FLAT and GOURAUD make meshes of its shapes.
    tessellation
        How fine those meshes are (:func:`heuristic.meshes.to_mesh`), 16 if omitted. If given, PHONG
        gets meshes too.
    prune
        Whether the kernel leaves out the terms that no material has.
    sensor
        Number of the scene's sensor.
    heuristic
        Name of the declaration that shades the heuristic half (:mod:`heuristic.heuristics`).
    with_partners
        Whether its materials know their physical partners (:mod:`reference.pairing.partners`), as
        they do for every user's heuristic.

    Raises
    ------
    InputError
        If Mitsuba cannot read or make the scene, it has no such sensor, or the heuristic is not
        declared.
    """
    register()
    graph = source.parse()
    settings = preparation.prepare(graph, resolution, sensor)
    with _refused_by_mitsuba(graph):
        chosen = interpolation, tessellation, prune, heuristic, with_partners
        return _paired(graph, settings, convention, *chosen)


@contextmanager
def _refused_by_mitsuba(graph):
    """Prefer Mitsuba's message for a scene that breaks pairing, if it rejects it too."""
    try:
        yield
    except FotismosError:
        raise
    except Exception:
        graph.instantiate()
        raise


def _paired(
    graph, settings, convention, interpolation, tessellation, prune, heuristic, with_partners
):
    geometry = cache(_bare(graph).instantiate)

    model, half = named(heuristic), graph.copy()
    if model.is_own and not with_partners:
        given_physical = bsdfs.to_heuristic(half, convention)
    else:
        from reference.pairing import partners

        asked = partners.read(half, convention)
        given_physical = bsdfs.to_heuristic(half, convention)
        partners.give(half, asked)
    for index in half.nodes(BSDF) if model.form else ():
        if half.plugin(index) == "phong":
            half.props(index)["form"] = model.form
    emitters, radiance = lights.to_heuristic(half, geometry, settings.hide_emitters)
    ambient = settings.ambient if settings.ambient is not None else radiance
    _set_integrator(half, ambient, settings, interpolation, prune, model)
    if interpolation is not Interpolation.PHONG or tessellation is not None:
        from reference.pairing import meshing

        meshing.replace_shapes(half, geometry(), tessellation, interpolation)

    physical = graph.copy()
    emitters += areas.add_glowing_shapes(physical)
    given_heuristic = bsdfs.to_physical(physical, convention)
    emitters += lights.to_physical(physical, lambda: gbuffer(geometry()))
    if settings.ambient is not None:
        emitters.append(environments.add_environment(physical, graph, settings.ambient, convention))

    records = (*given_physical, *given_heuristic)
    return Pair(
        name=graph.name,
        heuristic=half,
        physical=physical,
        hide_emitters=settings.hide_emitters,
        max_depth=settings.max_depth,
        convention=convention,
        bsdfs=records,
        emitters=tuple(emitters),
        misses=tuple(miss for record in records for miss in record.misses),
        warnings=(*_energy_warnings(half), *model.remarks),
        integrator=settings.integrator,
        rr_depth=settings.rr_depth,
        media=tuple((graph.label(i), graph.plugin(i)) for i in preparation.media(graph)),
        overridden=tuple(settings.overridden),
        shading=model.name,
    )


def _bare(graph):
    """Return a copy of a graph without materials, which can be slow to make."""
    copy = graph.copy()
    for shape in copy.nodes(mi.ObjectType.Shape):
        for kind in (mi.ObjectType.BSDF, mi.ObjectType.Medium):
            for key, _ in copy.children(shape, kind):
                copy.detach(shape, key)
    return copy


def _set_integrator(graph, ambient, settings, interpolation, prune, model):
    props = properties(
        "heuristic",
        hide_emitters=settings.hide_emitters,
        occlusion=settings.occlusion or "visible" in model.needs,
        interpolation=interpolation.value,
        prune=prune,
        model=model.name,
    )
    if ambient is not None:
        props["ambient"] = mi.ScalarColor3f(ambient) if isinstance(ambient, tuple) else ambient
    props.set_id("integrator")  # identifies its parameters
    graph.attach(0, "integrator", graph.add(INTEGRATOR, props))


def _energy_warnings(graph):
    """Name the materials that reflect more light than they receive at normal incidence."""
    phongs = [index for index in graph.nodes(BSDF) if graph.plugin(index) == "phong"]
    for index in phongs:
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
