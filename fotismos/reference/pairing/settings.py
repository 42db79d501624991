"""What both halves of a pair need: sensor, film, integrator, ids and BSDFs."""

from dataclasses import dataclass, field
from typing import Any

import mitsuba as mi

from fotismos.heuristic.errors import InputError
from fotismos.heuristic.lights import INTENSITIES
from fotismos.reference.pairing import bsdfs, kinds, lights
from fotismos.reference.pairing.pairing_record import Override
from fotismos.reference.records import PATHS
from fotismos.reference.scene import checks, values
from fotismos.reference.scene.graph import Graph, Reference, properties
from fotismos.reference.scene.source import collect_messages

FILM = mi.ObjectType.Film
INTEGRATOR = mi.ObjectType.Integrator
SAMPLER = mi.ObjectType.Sampler
SENSOR = mi.ObjectType.Sensor
SHAPE = mi.ObjectType.Shape

PIXEL_FORMATS = ("luminance", "luminance_alpha", "rgb", "rgba", "xyz", "xyza")
"""Pixel formats of Mitsuba's films."""

FILM_SIZES = ("width", "height", "crop_width", "crop_height", "crop_offset_x", "crop_offset_y")


@dataclass
class Settings:
    """What a scene asks for besides its content, filled while it is completed.

    ``integrator`` is its plugin, None if the scene has none; ``max_depth`` counts like Mitsuba's,
    -1 for no limit; ``rr_depth`` is None if omitted; ``overridden`` is what it does not get.
    """

    integrator: str | None = None
    ambient: Any = None
    hide_emitters: bool = False
    max_depth: int = -1
    rr_depth: int | None = None
    occlusion: bool = False
    overridden: list[Override] = field(default_factory=list)

    def override(self, what: str, given: str, used: str) -> None:
        """Record a setting that is not used, see :class:`Override`."""
        self.overridden.append(Override(what=what, given=given, used=used))


def complete(graph: Graph, resolution: tuple[int, int] | None, sensor: int = 0) -> Settings:
    """Check the graph, add what both halves need, and return its :class:`Settings`.

    One of several sensors is kept, by its number in the Mitsuba scene. The integrator is removed:
    each half gets its own.
    """
    for index in graph.nodes(SHAPE):  # merging shapes is an optimisation, and hides their ids
        if graph.plugin(index) == "merge":
            for _, child in graph.children(index, SHAPE):
                graph.attach(0, f"shape_{child}", child)
            graph.remove(index)
    bsdfs.give_default(graph)
    for index in graph.nodes(mi.ObjectType.BSDF):
        values.check_colours(graph, index, bsdfs.COLOURS.get(graph.plugin(index), ()))
    for index in graph.nodes(mi.ObjectType.Emitter):
        plugin = graph.plugin(index)
        colours = INTENSITIES if lights.is_heuristic(plugin) else (kinds.of(plugin).colour,)
        values.check_colours(graph, index, colours)
    checks.check(graph)
    for shape in graph.nodes(SHAPE):
        if not graph.props(shape).id():
            graph.props(shape).set_id(f"shape-{shape}")
    settings = Settings()
    camera = keep_sensor(graph, sensor)
    _set_film(graph, camera, resolution=resolution, settings=settings)
    for _, index in graph.children(camera, SAMPLER):
        count = graph.props(index).get("sample_count", 4)
        before = f"{graph.plugin(index)}, {count} samples per pixel"
        # Some samplers round the count up, to a power of 4 or a square.
        with collect_messages([]):
            rendered = graph.instantiate(index).sample_count()
        if rendered != count:
            before += f", of which Mitsuba makes {rendered}"
        settings.override("sampler", before, "sampler and samples of the plan")
    _give_weights(graph, settings)
    _take_integrator(graph, settings)
    return settings


def film_size(graph: Graph, sensor: int = 0) -> tuple[int, int]:
    """Return the given width and height of a sensor's film."""
    films = graph.children(keep_sensor(graph.copy(), sensor), FILM)
    for _, film in films:
        checks.check_node(graph, film)
    return _size(graph.props(films[0][1]) if films else {})


def _size(film: Any) -> tuple[int, int]:
    width, height = checks.FILM_SIZE
    return int(film.get("width", width)), int(film.get("height", height))


def keep_sensor(graph: Graph, number: int) -> int:
    """Keep one sensor of the scene, and return its index."""
    places = []
    for key, value in graph.props(0).items():
        if isinstance(value, Reference):
            index = value.index()
            if graph.kind(index) == SENSOR:
                places.append((0, key, index))
            places += [(index, inner, child) for inner, child in graph.children(index, SENSOR)
                       if graph.kind(index) == SHAPE]  # fmt: skip
    if not places:
        raise InputError(f"{graph.name}: the scene has no sensor. Add one, such as perspective.")
    if not 0 <= number < len(places):
        allowed = f"choose one from 0 to {len(places) - 1}"
        if len(places) == 1:
            allowed = "the scene has one, number 0. Omit `sensor`"
        raise InputError(f"{graph.name}: there is no sensor {number}: {allowed}.")
    for choice, (parent, key, _) in enumerate(places):
        if choice != number:
            graph.detach(parent, key)
    return int(places[number][2])


def _set_film(
    graph: Graph, sensor: int, resolution: tuple[int, int] | None, settings: Settings
) -> None:
    films = graph.children(sensor, FILM)
    if not films:
        added = graph.add(FILM, properties("hdrfilm"))
        graph.attach(sensor, "film", added)
        films = [("film", added)]
    ((_, film),) = films
    # Of another film only size and filter stay.
    if graph.plugin(film) != "hdrfilm":
        settings.override("film", graph.plugin(film), "hdrfilm")
        before = graph.props(film)
        sizes = {name: before[name] for name in FILM_SIZES if name in before}
        filters = graph.children(film, mi.ObjectType.ReconstructionFilter)
        graph.replace(film, properties("hdrfilm", **sizes))
        for key, child in filters:
            graph.attach(film, key, child)
    props = graph.props(film)
    pixel_format = "luminance" if mi.is_monochromatic else "rgb"
    before = props.get("pixel_format", "rgb")
    if before.lower() not in PIXEL_FORMATS:
        raise InputError(
            f"{graph.name}: {graph.label(film)}: pixel_format = {before!r}: choose one of"
            f" {', '.join(PIXEL_FORMATS)}."
        )
    if before != pixel_format:
        settings.override("pixel format", before, pixel_format)
    props["pixel_format"] = pixel_format
    props["component_format"] = "float32"
    if resolution is not None:
        _resize(props, resolution)


def _resize(props: Any, resolution: tuple[int, int]) -> None:
    """Set a film's size; a crop keeps its place in the picture."""
    sides = zip(("width", "height"), "xy", resolution, _size(props), strict=True)
    for side, name, new, before in sides:
        if f"crop_{side}" in props:
            begin = props.get(f"crop_offset_{name}", 0)
            end = begin + props[f"crop_{side}"]
            # Rounding both ends, not the length, keeps neighbouring crops in touch.
            first = min(round(begin * new / before), new - 1)
            props[f"crop_offset_{name}"] = first
            props[f"crop_{side}"] = max(round(end * new / before) - first, 1)
        props[side] = new


def _give_weights(graph: Graph, settings: Settings) -> None:
    """Sample lights that the scene does not sample: each plan would treat them differently."""
    kind = mi.ObjectType.Emitter
    owners = {
        child: shape for shape in graph.nodes(SHAPE) for _, child in graph.children(shape, kind)
    }
    for index in graph.nodes(kind):
        props = graph.props(index)
        name = graph.label(owners.get(index, index))
        if not props.get("sampling_weight", 1.0) > 0:
            settings.override(f"sampling_weight of {name}", f"{props['sampling_weight']:g}", "1")
            props["sampling_weight"] = 1.0


def _take_integrator(graph: Graph, settings: Settings) -> None:
    for key, outer in graph.children(0, INTEGRATOR):
        graph.detach(0, key)
        index = outer
        # Integrators such as `aov` wrap others: the innermost makes the light.
        while nested := graph.children(index, INTEGRATOR):
            settings.override("integrator", graph.plugin(index), "the integrator inside it")
            index = nested[0][1]
        plugin = graph.plugin(index)
        props = graph.props(index)
        hidden = props.get("hide_emitters", None)
        settings.integrator = plugin
        if plugin == "heuristic":
            settings.ambient = props.get("ambient", None)
            settings.occlusion = props.get("occlusion", False)
            # The chapters' background is black, although their ambient light fills the room. But
            # what glows (8.1) is seen, and Mitsuba hides both or none.
            is_black = settings.ambient is not None and not _glows(graph)
            settings.hide_emitters = is_black if hidden is None else hidden
            continue
        is_kept = plugin in (*PATHS, "direct")
        try:
            graph.instantiate(index)
        except InputError as error:  # one that is replaced may need another variant
            if is_kept or "not found" in str(error):
                raise
        if not is_kept:
            settings.override("integrator", plugin, "path: all light, as the comparison requires")
        if plugin == "direct":
            for name in ("emitter_samples", "bsdf_samples", "shading_samples"):
                if props.get(name, 1) != 1:  # it may leave out light that only one way finds
                    settings.override(name, str(props[name]), "1")
        settings.hide_emitters = bool(hidden)
        settings.max_depth = 2 if plugin == "direct" else props.get("max_depth", -1)
        settings.rr_depth = props.get("rr_depth", None)


def _glows(graph: Graph) -> bool:
    """Return whether a material's emission coefficient may be more than 0."""
    materials = graph.nodes(mi.ObjectType.BSDF, "phong")
    return any(values.may_be_nonzero(graph.props(index).get("k_i", 0.0)) for index in materials)
