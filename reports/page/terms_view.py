"""The terms of a scene for the page: 16-bit codes of the factors of the kernel's terms.

A cosine ``c`` has the code ``65535 (1 + c) / 2``; a value ``v`` ≥ 0 has ``65535 sqrt(v / top)``,
with the plane's ``top``, and is off by at most ``top`` / 65000. The planes are packed like those of
images (:mod:`reports.page.embedding`). ``templates/viewer/terms.js`` reads them.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from msgspec import field
from numpy.typing import NDArray

from comparisons.departure.regions import Region
from reference.records import Record, plain
from reports.page.embedding import Embedded, packed

if TYPE_CHECKING:
    from comparisons.pixel_terms import TermGrid

LARGEST = 65535


class PickedTerms(Record):
    """The terms at one pixel, for paper and browsers without scripts.

    ``rows`` are names with linear RGB: the terms, their sum, and the reference.
    """

    pixel: tuple[int, int]
    material: str
    rows: tuple[tuple[str, tuple[float, ...]], ...]


class TermsView(Record):
    """The page's data of the terms of a scene.

    ``grid`` has planes over the grid of pixels, and ``tops`` those of its values ≥ 0; lights have a
    name and their ``I_p0``. ``missing`` says why there are no terms. ``picked`` are the terms where
    the error is largest, or else in the middle.
    """

    grid: Embedded | None = None
    tops: dict[str, float] = field(default_factory=dict)
    materials: tuple[dict[str, Any], ...] = ()
    lights: tuple[dict[str, Any], ...] = ()
    missing: str = ""
    picked: PickedTerms | None = None

    def manifest(self) -> dict[str, Any]:
        """The data of the page's script, except the grid's planes, as plain data."""
        shown = plain(self)
        del shown["picked"]
        return shown | {
            "grid": self.grid.manifest() if self.grid else None,
        }


def view(
    grid: TermGrid | None, missing: str = "", picked: PickedTerms | None = None
) -> TermsView | None:
    """Return the page's data of a grid of terms, or the reason why there is none."""
    if grid is None:
        return TermsView(missing=missing) if missing else None
    seen = grid.material >= 0
    shiny = np.array([any(material.k_s) for material in grid.materials] + [False])[grid.material]
    cosines, amounts = {"cos_view": grid.cos_view}, dict[str, NDArray]()
    for number, light in enumerate(grid.lights):
        cosines |= {
            f"{number}.cos_incidence": light.cos_incidence,
            f"{number}.cos_view": light.cos_view,
        }
        amounts |= {
            f"{number}.attenuation": light.attenuation * seen,
            f"{number}.lobe": light.lobe * shiny,
        }
    if grid.others is not None:
        amounts |= {f"others.{c}": grid.others[..., i] * seen for i, c in enumerate("RGB")}
    tops = {name: float(values.max(initial=0)) or 1.0 for name, values in amounts.items()}

    planes = {"material": (grid.material + 1).astype(np.uint16)}
    for name, values in cosines.items():
        code = np.rint(LARGEST * (1 + np.clip(values, -1, 1)) / 2)
        planes[name] = np.where(seen, code, 0).astype(np.uint16)
    for name, values in amounts.items():
        code = np.rint(LARGEST * np.sqrt(np.maximum(values, 0) / tops[name]))
        planes[name] = code.astype(np.uint16)
    return TermsView(
        grid=packed(planes),
        tops=tops,
        materials=tuple(vars(material) for material in grid.materials),
        lights=tuple({"name": each.name, "intensity": each.intensity} for each in grid.lights),
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
    seen = [t for pixel in (*middles, (width // 2, height // 2)) if (t := grid.at(*pixel))]
    if not seen:
        return None
    terms = next((terms for terms in seen if not any(terms.emission)), seen[0])
    column, row = terms.pixel
    rows = [("emission", terms.emission), ("ambient", terms.ambient)]
    for light in terms.lights:
        rows += [(f"{light.name}, diffuse", light.diffuse)]
        rows += [(f"{light.name}, specular", light.specular)]
    rows = [(name, rgb) for name, rgb in (*rows, ("other lights", terms.others)) if any(rgb)]
    rows += [("textbook", terms.total), ("physical", tuple(reference[row, column].tolist()))]
    return PickedTerms(terms.pixel, terms.material.name, tuple(rows))
