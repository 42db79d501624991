"""Colours that Mitsuba reads otherwise than a scene's author is likely to mean.

In spectral variants a colour becomes a spectrum: a smooth function of wavelength between 0 and 1,
whose three coefficients are fitted to the colour (Jakob and Hanika 2019). Lights given as ``rgb``
are scaled, and multiplied by the spectrum of daylight; pictures are not. A table is 0 beyond its
ends.
"""

import re
from collections.abc import Iterator
from typing import Any

import mitsuba as mi
import numpy as np

from fotismos.reference.scene.graph import Graph, Reference, find_file
from fotismos.reference.scene.values import plain

VISIBLE = (360.0, 830.0)
"""Ends of the wavelengths that Mitsuba samples, in nanometres."""

FLOAT_PICTURES = (".exr", ".hdr", ".rgbe", ".pfm")
PICTURES = ("bitmap", "checkerboard", "mesh_attribute", "volume")
CONDUCTORS = ("conductor", "roughconductor")
EMISSION = "k_i"
IN_RGB = "Give the variant llvm_ad_rgb"


WHOLE_NUMBERS = re.compile(rb"^property u?(?:char|short|int)\w* (?:r|red)\s", re.MULTILINE)
"""The line of a PLY file's header by which its colours are whole numbers."""

HEADER = 65536
"""Bytes of a PLY file in which its header ends."""

EQUAL_ENERGY = "(1.20, 0.95, 0.91)"
"""The RGB of light with the power 1 at all wavelengths, of which daylight has (1, 1, 1)."""


def doubts(graph: Graph) -> Iterator[str]:
    """Yield what Mitsuba reads otherwise than meant, each by the element's name."""
    yield from _flat_lights(graph)
    yield from _whole_colours(graph)
    if mi.is_spectral:
        yield from _of_wavelengths(graph)


def _flat_lights(graph: Graph) -> Iterator[str]:
    """Yield the lights whose spectrum is one number, which is no white."""
    if mi.is_monochromatic:
        return
    for index in graph.nodes_in_use():
        if graph.kind(index) != mi.ObjectType.Emitter:
            continue
        props = graph.props(index)
        for key in props.keys():  # noqa: SIM118  Mitsuba's properties are no mapping
            value = props[key]
            if hasattr(value, "wavelengths") and not len(value.wavelengths):
                yield (
                    f"{graph.label(index)}: {key} is a spectrum of one value, the same at all"
                    f" wavelengths, which is pink: {EQUAL_ENERGY} times it. For white light give"
                    " rgb or a number."
                )


def _whole_colours(graph: Graph) -> Iterator[str]:
    """Yield the PLY files whose colours are whole numbers, if any surface reads its mesh's."""
    if not graph.nodes(mi.ObjectType.Texture, "mesh_attribute"):
        return
    for index in graph.nodes(mi.ObjectType.Shape, "ply"):
        path = graph.file(index)
        if path is None:
            continue
        with path.open("rb") as file:
            header, _, _ = file.read(HEADER).partition(b"end_header")
        if WHOLE_NUMBERS.search(header):
            yield (
                f"{graph.label(index)}: the colours in {path.name} are whole numbers, which Mitsuba"
                " takes as they are: 128 is a reflectance of 128. Save them as floats from 0 to 1."
            )


def _of_wavelengths(graph: Graph) -> Iterator[str]:
    """Yield what spectral variants read otherwise."""
    of_lights = set()
    for index in graph.nodes_in_use():
        for key, child in graph.children(index, mi.ObjectType.Texture):
            is_light = graph.kind(index) == mi.ObjectType.Emitter or key == EMISSION
            if is_light and graph.plugin(child) in PICTURES:
                of_lights.add(child)
                yield (
                    f"{graph.label(index)}: {key} is a picture, which spectral variants take for a"
                    " reflectance: values above 1 are cut, and white is pink, since it is not"
                    f" daylight's. {IN_RGB}, or a light of one colour (rgb)."
                )
    for index in graph.nodes_in_use():
        if graph.plugin(index) == "bitmap" and index not in of_lights:
            yield from _of_bitmap(graph, index)
        if graph.plugin(index) in CONDUCTORS:
            yield from _clipped(graph, index)
            yield from short_tables(graph, index)


def _of_bitmap(graph: Graph, index: int) -> Iterator[str]:
    props = graph.props(index)
    if props.get("raw", False):
        return
    label = graph.label(index)
    if "data" in props and props["data"].shape[-1] == 3:
        yield (
            f"{label}: spectral variants take the three channels of `data` for coefficients of a"
            " spectrum, so that most colours are white. Give `bitmap`, a mitsuba.Bitmap of the same"
            " array."
        )
        return
    path = graph.file(index)
    picture = props.get("bitmap", None)
    if picture is None and path is not None and path.suffix.lower() in FLOAT_PICTURES:
        picture = mi.Bitmap(str(path))
    if picture is None or picture.channel_count() < 3:
        return
    pixels = np.array(picture)
    largest = float(pixels[..., :3].max())
    if pixels.dtype.kind == "f" and largest > 1:
        yield (
            f"{label}: its values reach {largest:.3g}, and spectral variants cut the colours of"
            f" pictures at 1. {IN_RGB}, or values up to 1."
        )


def _clipped(graph: Graph, index: int) -> Iterator[str]:
    """Yield the colours above 1 of a metal."""
    props = graph.props(index)
    for key in ("eta", "k"):
        value = plain(props.get(key, None))
        if isinstance(value, tuple) and max(value) > 1:
            shown = ", ".join(f"{component:g}" for component in value)
            yield (
                f"{graph.label(index)}: {key} = {shown} is a colour, which spectral variants cut"
                f" at 1. {IN_RGB}, a table by wavelength, or a `material`."
            )


def short_tables(graph: Graph, index: int) -> Iterator[str]:
    """Yield which tables of a metal end within the visible wavelengths, in any variant."""
    if graph.plugin(index) not in CONDUCTORS:
        return
    for name, (low, high) in _tables(graph, index):
        if low > VISIBLE[0] or high < VISIBLE[1]:
            yield (
                f"{graph.label(index)}: {name} is known from {low:.4g} to {high:.4g} nm, of"
                f" {VISIBLE[0]:g} to {VISIBLE[1]:g}. Beyond, Mitsuba takes 0, and the metal is a"
                " perfect mirror, or NaN where light falls straight on it. Give another `material`,"
                " or tables of `eta` and `k` that cover all."
            )


def _tables(graph: Graph, index: int) -> Iterator[tuple[str, tuple[float, float]]]:
    """Yield the name and the ends, in nanometres, of each table of a metal."""
    props = graph.props(index)
    for key in ("eta", "k"):
        value = props.get(key, None)
        if isinstance(value, Reference):
            value = _ends_of_node(graph.props(value.index()))
        elif len(getattr(value, "wavelengths", ())):
            value = min(value.wavelengths), max(value.wavelengths)
        if isinstance(value, tuple) and len(value) == 2:
            yield key, value
    if "eta" not in props and "k" not in props:
        name = props.get("material", "Cu")
        path = find_file(graph.resolver, f"data/ior/{name}.eta.spd")
        if path is not None:
            yield f"the index of {name}", _ends(np.loadtxt(path, usecols=0))


def _ends_of_node(props: Any) -> tuple[float, float] | None:
    """Return the ends of a tabulated spectrum's own element; None if it has no table."""
    if "wavelength_min" in props and "wavelength_max" in props:
        return float(props["wavelength_min"]), float(props["wavelength_max"])
    if "wavelengths" in props:
        return _ends(np.array(str(props["wavelengths"]).replace(",", " ").split(), float))
    return None


def _ends(wavelengths: np.ndarray) -> tuple[float, float]:
    return float(wavelengths.min()), float(wavelengths.max())
