"""Preparation for both halves of a pair: sensor, film, integrator, ids and BSDFs."""

from dataclasses import dataclass, field
from typing import Any

import mitsuba as mi

from heuristic.errors import InputError
from reference.pairing import bsdfs, lights
from reference.scene import allowed, damaged, reading
from reference.scene.graph import Graph, Reference, properties

FILM, INTEGRATOR, MEDIUM, SAMPLER, SENSOR, SHAPE = (
    getattr(mi.ObjectType, kind)
    for kind in ("Film", "Integrator", "Medium", "Sampler", "Sensor", "Shape")
)

PATHS = ("path", "volpath", "volpathmis")
"""Integrators with the same light as the reference: all paths up to a length."""

PIXEL_FORMATS = ("luminance", "luminance_alpha", "rgb", "rgba", "xyz", "xyza")
"""Pixel formats of Mitsuba's films."""

FILM_SIZES = ("width", "height", "crop_width", "crop_height", "crop_offset_x", "crop_offset_y")


@dataclass(frozen=True)
class Overridden:
    """Something that the scene requests, and what is done instead."""

    what: str
    given: str
    used: str


@dataclass(frozen=True)
class Settings:
    """The settings of the scene's own integrator.

    ``integrator`` is its plugin, None if the scene has none; ``max_depth`` counts like Mitsuba's,
    -1 for no limit; ``rr_depth`` is None if omitted.
    """

    integrator: str | None = None
    ambient: Any = None
    hide_emitters: bool = False
    max_depth: int = -1
    rr_depth: int | None = None
    occlusion: bool = False
    overridden: list[Overridden] = field(default_factory=list)


def prepare(graph: Graph, resolution: tuple[int, int] | None, sensor: int = 0) -> Settings:
    """Check the graph, add what both halves need, and return its :class:`Settings`.

    One of several sensors is kept, by its number in the Mitsuba scene. The integrator is removed:
    each half gets its own.
    """
    _open_merged(graph)
    bsdfs.give_default(graph)
    bsdfs.check(graph)
    lights.check(graph)
    allowed.check(graph)
    reading.require_files(graph)
    damaged.check(graph)
    for shape in graph.nodes(SHAPE):
        if not graph.props(shape).id():
            graph.props(shape).set_id(f"shape-{shape}")
    overridden: list[Overridden] = []
    kept = keep_sensor(graph, sensor)
    _prepare_film(graph, kept, resolution, overridden)
    _note_sampler(graph, kept, overridden)
    return _take_integrator(graph, overridden)


def media(graph: Graph) -> list[int]:
    """Return the nodes of participating media."""
    return graph.nodes(MEDIUM)


def _open_merged(graph):
    """Replace ``merge`` by the shapes inside it: merging is an optimisation, and hides ids."""
    for index in graph.nodes(SHAPE):
        if graph.plugin(index) == "merge":
            for _, child in graph.children(index, SHAPE):
                graph.attach(0, f"shape_{child}", child)
            graph.remove(index)


def film_size(graph: Graph, sensor: int = 0) -> tuple[int, int]:
    """Return the given width and height of a sensor's film."""
    films = graph.children(keep_sensor(graph.copy(), sensor), FILM)
    for _, film in films:
        allowed.check_node(graph, film)
    return _size(graph.props(films[0][1]) if films else {})


def _size(film):
    """Return a film's width and height, or Mitsuba's defaults if omitted."""
    width, height = allowed.FILM
    return int(film.get("width", width)), int(film.get("height", height))


def keep_sensor(graph: Graph, number: int) -> int:
    """Keep one sensor of the scene, and return its index.

    Raises
    ------
    InputError
        If there is no sensor with this number.
    """
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
        raise InputError(
            f"{graph.name}: there is no sensor {number}: choose one from 0 to {len(places) - 1}."
        )
    for place, (parent, key, _) in enumerate(places):
        if place != number:
            graph.detach(parent, key)
    return places[number][2]


def _prepare_film(graph, sensor, resolution, overridden):
    """Set the film to linear RGB floats, and to the requested resolution."""
    films = graph.children(sensor, FILM)
    if not films:
        films = [("film", graph.add(FILM, properties("hdrfilm")))]
        graph.attach(sensor, *films[0])
    ((_, film),) = films
    if graph.plugin(film) != "hdrfilm":
        overridden.append(Overridden("film", graph.plugin(film), "hdrfilm"))
        given = graph.props(film)
        sizes = {name: given[name] for name in FILM_SIZES if name in given}
        filters = graph.children(film, mi.ObjectType.ReconstructionFilter)
        graph.replace(film, properties("hdrfilm", **sizes))
        for key, child in filters:
            graph.attach(film, key, child)
    props = graph.props(film)
    pixel_format = "luminance" if mi.is_monochromatic else "rgb"
    given = props.get("pixel_format", "rgb")
    if given.lower() not in PIXEL_FORMATS:
        raise InputError(
            f"{graph.name}: {graph.label(film)}: pixel_format = {given!r}: choose one of"
            f" {', '.join(PIXEL_FORMATS)}."
        )
    if given != pixel_format:
        overridden.append(Overridden("pixel format", given, pixel_format))
    props["pixel_format"] = pixel_format
    props["component_format"] = "float32"
    if resolution is not None:
        _resize(props, resolution)


def _resize(props, resolution):
    """Set a film's size; a crop keeps its place in the picture."""
    old = _size(props)
    for side, name, new, before in zip(
        ("width", "height"), ("x", "y"), resolution, old, strict=True
    ):
        if f"crop_{side}" in props:
            begin = props.get(f"crop_offset_{name}", 0)
            end = begin + props[f"crop_{side}"]
            first = min(round(begin * new / before), new - 1)
            props[f"crop_offset_{name}"] = first
            props[f"crop_{side}"] = max(round(end * new / before) - first, 1)
        props[side] = new


def _note_sampler(graph, sensor, overridden):
    """Record the scene's own samples, which the plan's replace."""
    for _, index in graph.children(sensor, SAMPLER):
        count = graph.props(index).get("sample_count", 4)
        given = f"{graph.plugin(index)}, {count} samples per pixel"
        overridden.append(Overridden("sampler", given, "sampler and samples of the plan"))


def _take_integrator(graph, overridden):
    """Read the scene's integrator, inside those that only add channels, and remove it."""
    settings = Settings(overridden=overridden)
    for key, index in graph.children(0, INTEGRATOR):
        graph.detach(0, key)
        inner = index
        while nested := graph.children(inner, INTEGRATOR):
            overridden.append(
                Overridden("integrator", graph.plugin(inner), "the integrator inside it")
            )
            inner = nested[0][1]
        settings = _settings(graph, inner, overridden)
    return settings


def _require_made(graph, index):
    """Reject an integrator that Mitsuba does not know or cannot make.

    A replaced integrator may need another variant than this.
    """
    try:
        graph.instantiate(index)
    except InputError as error:
        if graph.plugin(index) in (*PATHS, "direct") or "not found" in str(error):
            raise


def _settings(graph, index, overridden):
    plugin, props = graph.plugin(index), graph.props(index)
    hidden = props.get("hide_emitters", None)
    if plugin == "heuristic":
        ambient = props.get("ambient", None)
        # The chapters' background is black, although their ambient light fills the room.
        return Settings(
            integrator=plugin,
            ambient=ambient,
            hide_emitters=ambient is not None if hidden is None else hidden,
            occlusion=props.get("occlusion", False),
            overridden=overridden,
        )
    _require_made(graph, index)
    if plugin not in (*PATHS, "direct"):
        used = "path: all light, as the comparison requires"
        overridden.append(Overridden("integrator", plugin, used))
    return Settings(
        integrator=plugin,
        hide_emitters=bool(hidden),
        max_depth=2 if plugin == "direct" else props.get("max_depth", -1),
        rr_depth=props.get("rr_depth", None),
        overridden=overridden,
    )
