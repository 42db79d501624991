"""The two halves of a pair, derived from one scene.

A scene may be physical (a user's own), heuristic (a textbook figure), or a mixture: the heuristic
half replaces what is physical, the physical half replaces what is heuristic, and what is already of
the right kind stays. Geometry, cameras and films are those of the scene in both.
"""

from dataclasses import dataclass
from functools import cache

import mitsuba as mi
import numpy as np

from heuristic import meshes
from heuristic.errors import InputError
from heuristic.heuristics import PHONG, named
from heuristic.interpolation import Interpolation
from heuristic.plugins import register
from heuristic.plugins.interpolated import viewpoint
from reference.pairing import bsdfs, meshing
from reference.pairing.factors import Convention, Miss, specular_albedo
from reference.pairing.lights import reading, to_heuristic, to_physical
from reference.rendering.gbuffer import gbuffer
from reference.scene import preparation, values
from reference.scene.graph import Graph, properties
from reference.scene.preparation import Overridden

BSDF, EMITTER, INTEGRATOR, SENSOR = (
    getattr(mi.ObjectType, kind) for kind in ("BSDF", "Emitter", "Integrator", "Sensor")
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
        Whether camera rays see lights and environment; alike in both halves.
    max_depth
        The scene's own limit on path length, -1 for none.
    convention, bsdfs, emitters, misses, warnings
        What was replaced by what.
    integrator, rr_depth
        The scene's own integrator and where it begins Russian roulette, None where not given.
    media
        Labels and plugins of participating media.
    overridden
        What the scene asks for and does not get, :class:`reference.scene.preparation.Overridden`.
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


def pair(
    source,
    convention=Convention.MATCHED,
    resolution=None,
    interpolation=Interpolation.PHONG,
    tessellation=None,
    prune=True,
    sensor=0,
    heuristic: str = PHONG.name,
) -> Pair:
    """Derive both halves of a scene, for the current variant.

    Parameters
    ----------
    source : reference.scene.source.Source
        The scene.
    convention : Convention
        How roughplastic and phong are paired.
    resolution : (width, height), optional
        In place of the film's own.
    interpolation : Interpolation
        Of the heuristic half. FLAT and GOURAUD make meshes of its shapes.
    tessellation : int, optional
        How fine those meshes are (:func:`heuristic.meshes.to_mesh`), 16 where it is not given;
        given, it makes meshes for PHONG too.
    prune
        Whether the kernel leaves out the terms that no material has.
    sensor
        Number of the sensor among those of the scene.
    heuristic
        Name of the declaration that shades the heuristic half (:mod:`heuristic.heuristics`).

    Raises
    ------
    InputError
        When Mitsuba cannot read the scene or make it, it has no such sensor, or the heuristic is
        not declared.
    """
    register()
    graph = source.parse()
    settings = preparation.prepare(graph, resolution, sensor)
    geometry = cache(_bare(graph).instantiate)

    model, half = named(heuristic), graph.copy()
    given_physical = bsdfs.to_heuristic(half, convention)
    for index in _phongs(half) if model.form else ():
        half.props(index)["form"] = model.form
    lights, radiance = to_heuristic.replace_lights(half, geometry, settings.hide_emitters)
    ambient = settings.ambient if settings.ambient is not None else radiance
    _set_integrator(half, ambient, settings, interpolation, prune, model)
    if interpolation is not Interpolation.PHONG:
        viewpoint(geometry().sensors()[0])  # refuses what has none before anything renders
    if interpolation is not Interpolation.PHONG or tessellation is not None:
        meshing.replace_shapes(half, geometry(), tessellation or meshes.RESOLUTION, interpolation)

    physical = graph.copy()
    lights += to_physical.add_glowing_shapes(physical)
    given_heuristic = bsdfs.to_physical(physical, convention)
    lights += to_physical.replace_lights(physical, lambda: gbuffer(geometry()))
    if settings.ambient is not None:
        lights.append(_add_environment(physical, graph, settings.ambient, convention))

    records = (*given_physical, *given_heuristic)
    return Pair(
        name=source.name,
        heuristic=half,
        physical=physical,
        hide_emitters=settings.hide_emitters,
        max_depth=settings.max_depth,
        convention=convention,
        bsdfs=records,
        emitters=tuple(lights),
        misses=tuple(miss for record in records for miss in record.misses),
        warnings=tuple(_energy_warnings(half)),
        integrator=settings.integrator,
        rr_depth=settings.rr_depth,
        media=tuple((graph.label(i), graph.plugin(i)) for i in preparation.media(graph)),
        overridden=tuple(settings.overridden),
    )


def _bare(graph):
    """Return a copy of a graph without materials, which can take long to make."""
    copy = graph.copy()
    for shape in copy.nodes(mi.ObjectType.Shape):
        for kind in (mi.ObjectType.BSDF, mi.ObjectType.Medium):
            for key, _ in copy.children(shape, kind):
                copy.detach(shape, key)
    return copy


def with_sampler(graph, plugin):
    """Return a copy of a graph whose sensors have a sampler of their own, of the given kind."""
    copy = graph.copy()
    for sensor in copy.nodes(SENSOR):
        for key, _ in copy.children(sensor, mi.ObjectType.Sampler):
            copy.detach(sensor, key)
        copy.attach(sensor, "sampler", copy.add(mi.ObjectType.Sampler, properties(plugin)))
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
    graph.attach(0, "integrator", graph.add(INTEGRATOR, props))


def _add_environment(physical, graph, ambient, convention):
    """Add the constant environment that stands for ``I_a``.

    A physical surface has one diffuse reflectance, where the model has ``k_a`` beside ``k_d``. The
    ``matched`` radiance is ``I_a k_a / k_d``, by least squares where materials differ; the
    ``literal`` one is ``I_a``.
    """
    ratio, exact = (1.0,) * 3, True
    if convention is Convention.MATCHED:
        ratio, exact = _ambient_ratio(graph)
    plain = isinstance(ambient, (float, int, *values.COLOURS))
    if plain and ratio != (1.0,) * 3:
        components = (float(ambient),) * 3 if isinstance(ambient, (float, int)) else tuple(ambient)
        ambient = values.scaled(components, ratio)
    light = physical.add(EMITTER, properties("constant", radiance=ambient))
    physical.attach(0, "environment", light)
    note = f"radiance I_a k_a / k_d, k_a / k_d = ({', '.join(f'{r:.4g}' for r in ratio)})"
    mean = sum(ratio) / len(ratio)
    return reading.PairedEmitter("ambient", "ambient", "constant", mean, exact, note)


def _ambient_ratio(graph):
    """Return ``k_a / k_d`` for each channel by least squares, and whether it fits all materials."""
    pairs = []
    for index in _phongs(graph):
        k_a, k_d = (values.colour(graph, index, key, 0.0) for key in ("k_a", "k_d"))
        # Without a diffuse part the reflectance is k_a itself.
        pairs.append((k_a, k_d if any(k_d) or any(_specular(graph, index)) else k_a))
    ratio = []
    for channel in range(3):
        weight = sum(k_d[channel] ** 2 for _, k_d in pairs)
        product = sum(k_a[channel] * k_d[channel] for k_a, k_d in pairs)
        ratio.append(product / weight if weight > 0 else 1.0)
    exact = all(
        abs(k_a[channel] - ratio[channel] * k_d[channel]) <= 1e-6 * max(k_a[channel], 1e-6)
        for k_a, k_d in pairs
        for channel in range(3)
    ) and not any(any(_specular(graph, index)) for index in _phongs(graph))
    return tuple(ratio), exact


def _specular(graph, index):
    return values.colour(graph, index, "k_s", 0.0)


def _phongs(graph):
    return [index for index in graph.nodes(BSDF) if graph.plugin(index) == "phong"]


def _energy_warnings(graph):
    """Name the materials that reflect more light than they receive at normal incidence."""
    for index in _phongs(graph):
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
