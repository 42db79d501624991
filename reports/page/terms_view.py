"""The terms of a scene for the page: 16-bit codes of the factors of the kernel's terms.

A cosine ``c`` has the code ``65535 (1 + c) / 2``; a value ``v`` ≥ 0 has ``65535 sqrt(v / top)``,
with the plane's ``top``, and is off by at most ``top`` / 65000. The planes are packed like those of
images (:mod:`reports.page.embedding`). ``templates/viewer/terms.js`` reads them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np
from msgspec import field, structs
from numpy.typing import NDArray

from comparisons.departure.regions import Region
from comparisons.records import Record, plain
from comparisons.terms import polar
from comparisons.terms.term_grid import TermGrid
from reports.page.embedding import Embedded, Plane, packed

LARGEST = 65535

View = TypeVar("View", bound=Record)


class MaterialView(Record):
    """A material of the grid; see :class:`comparisons.terms.term_grid.TermMaterial`."""

    name: str
    k_i: tuple[float, ...]
    k_a: tuple[float, ...]
    k_d: tuple[float, ...]
    k_s: tuple[float, ...]
    n: float
    form: str
    ambient: tuple[float, ...]


class LightView(Record):
    """A light of the grid, and its ``I_p0``."""

    name: str
    intensity: tuple[float, ...]


class PickedTerms(Record):
    """The terms at one pixel, for paper and browsers without scripts.

    ``rows`` are names with linear RGB: the terms, their sum, and the reference.
    """

    pixel: tuple[int, int]
    material: str
    rows: tuple[tuple[str, tuple[float, ...]], ...]


class TermsView(Record):
    """The page's data of the terms of a scene.

    Attributes
    ----------
    grid
        Planes over the grid of pixels; None without terms.
    tops
        Of the named planes of values ≥ 0.
    lobes
        Planes over incidences and directions of view, by the material's number.
    missing
        Why there are no terms.
    picked
        The terms where the departure is largest, or else in the middle.
    """

    grid: Embedded | None = None
    lobes: Embedded | None = None
    tops: dict[str, float] = field(default_factory=dict)
    materials: tuple[MaterialView, ...] = ()
    lights: tuple[LightView, ...] = ()
    missing: str = ""
    picked: PickedTerms | None = None

    def manifest(self) -> dict[str, Any]:
        """The data of the page's script, except the grid's planes, as plain data."""
        shown = plain(structs.replace(self, picked=None))
        del shown["picked"]
        return shown | {
            "grid": self.grid.manifest() if self.grid else None,
            "incidences": polar.INCIDENCES.tolist(),
            "views": polar.VIEWS.tolist(),
            "grazing": polar.GRAZING,
        }


def view(
    grid: TermGrid | None, missing: str = "", picked: PickedTerms | None = None
) -> TermsView | None:
    """Return the page's data of a grid of terms, or the reason why there is none."""
    if grid is None:
        return TermsView(missing=missing) if missing else None
    tops: dict[str, float] = {}
    seen = grid.material >= 0
    shiny = np.array([any(material.k_s) for material in grid.materials] + [False])[grid.material]
    planes = {"material": (grid.material + 1).astype(np.uint16)}
    planes["cos_view"] = _cosines(grid.cos_view, seen)
    for number, light in enumerate(grid.lights):
        for name in ("cos_incidence", "cos_view"):
            planes[f"{number}.{name}"] = _cosines(getattr(light, name), seen)
        amounts = {"attenuation": light.attenuation * seen, "lobe": light.lobe * shiny}
        for name, amount in amounts.items():
            planes[f"{number}.{name}"] = _amounts(f"{number}.{name}", amount, tops)
    if grid.others is not None:
        for channel, colour in enumerate("RGB"):
            planes[f"others.{colour}"] = _amounts(
                f"others.{colour}", grid.others[..., channel] * seen, tops
            )
    lobes = {
        f"physical.{number}": _amounts(f"physical.{number}", material.physical, tops)
        for number, material in enumerate(grid.materials)
        if material.physical is not None
    }
    return TermsView(
        grid=_embedded(planes),
        lobes=_embedded(lobes) if lobes else None,
        tops=tops,
        materials=tuple(_of(MaterialView, material) for material in grid.materials),
        lights=tuple(_of(LightView, light) for light in grid.lights),
        picked=picked,
    )


def picked(
    grid: TermGrid | None, regions: Sequence[Region], reference: NDArray
) -> PickedTerms | None:
    """Return the terms in the middle of the largest region, of the image (H, W, 3) on lamps."""
    if grid is None:
        return None
    middles = [(each.x + each.width // 2, each.y + each.height // 2) for each in regions[:1]]
    height, width, _ = reference.shape
    found = [grid.at(*pixel) for pixel in (*middles, (width // 2, height // 2))]
    seen = [terms for terms in found if terms]
    if not seen:
        return None
    terms = next((terms for terms in seen if not any(terms.emission)), seen[0])
    lit = (
        (f"{light.name}, {name}", getattr(light, name))
        for light in terms.lights
        for name in ("diffuse", "specular")
    )
    column, row = terms.pixel
    rows = [("emission", terms.emission), ("ambient", terms.ambient), *lit]
    rows = [*((name, rgb) for name, rgb in (*rows, ("other lights", terms.others)) if any(rgb))]
    rows += [("textbook", terms.total), ("physical", tuple(reference[row, column].tolist()))]
    return PickedTerms(terms.pixel, terms.material.name, tuple(rows))


def _of(kind: type[View], source: object) -> View:
    return kind(**{name: getattr(source, name) for name in kind.__struct_fields__})


def _cosines(values: NDArray, seen: NDArray) -> NDArray[np.uint16]:
    codes = np.rint(LARGEST * (1 + np.clip(values, -1, 1)) / 2)
    return np.where(seen, codes, 0).astype(np.uint16)


def _amounts(name: str, values: NDArray, tops: dict[str, float]) -> NDArray[np.uint16]:
    values = np.maximum(values, 0)
    tops[name] = float(values.max(initial=0)) or 1.0
    return np.rint(LARGEST * np.sqrt(values / tops[name])).astype(np.uint16)


def _embedded(codes: dict[str, NDArray[np.uint16]]) -> Embedded:
    planes = tuple(Plane(name, 0) for name in codes)
    height, width = next(iter(codes.values())).shape
    return Embedded(width, height, 1, planes, packed(planes, codes))
