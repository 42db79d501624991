"""What the page shows with causes: the effects of pixels, small pictures, and terms of 8.10."""

from __future__ import annotations

import numpy as np
from msgspec import structs

from fotismos.comparisons.attribution import dominating
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.records.images import Comparison, LivePoints, TermGrid
from fotismos.reference.records import Missing, plain
from fotismos.reports.page.embedding import COUNTED, encode, packed
from fotismos.reports.page.scene_view import PointsView, WhyView

LETTERS = {-1: ".", -2: "-"} | dict(enumerate("0123456789a"))
"""Codes of the map: no effect, a pixel that does not count, and the effects' places."""

ROUNDED = 16
"""Half floats of hybrids are rounded to multiples of this code, by up to 0.8 %."""

LIVE_CODE = 16383
"""The largest code of points to shade again: 14 bits, which pack better than 16."""

LARGEST_CODE = 65535
"""The largest code of the planes of terms and normals."""


def causes_view(comparison: Comparison) -> WhyView | None:
    """Return the view of causes: where each effect dominates, and small images of the hybrids."""
    causes = comparison.causes
    if causes is None:
        return None
    counted = causes.counted
    viewing = comparison.record.viewing
    # The last has all effects; the sides of all are a multiple of the maps'.
    previews = [causes.previews[hybrid.effects] for hybrid in causes.record.hybrids]
    places = dominating(causes.maps, counted)
    found = WhyView(
        width=places.shape[1],
        height=places.shape[0],
        names=tuple(causes.maps),
        map="".join(LETTERS[int(index)] for index in places.ravel()),
    )
    if len(previews) < 2:
        return found
    # The maps' pixels, repeated to the size of the previews.
    times = len(previews[0]) // len(counted)
    planes = {"flags": np.uint16(COUNTED) * counted.repeat(times, axis=0).repeat(times, axis=1)}
    for index, preview in enumerate(previews):
        layers = {c: preview[..., i] for i, c in enumerate("RGB")}
        layers[LEADING.name] = LEADING(preview, previews[-1], viewing)
        planes |= {f"{index}.{c}": encode(values, ROUNDED) for c, values in layers.items()}
    return structs.replace(found, pictures=packed(planes))


def terms_view(grid: TermGrid | Missing) -> PointsView:
    """Return the page's data of a grid of terms, 16-bit codes of their factors; or why not.

    A cosine ``c`` has the code ``65535 (1 + c) / 2``; a value ``v`` ≥ 0 has
    ``65535 sqrt(v / top)``, with the plane's ``top``, and is off by at most ``top`` / 65000. The
    planes are packed like those of images (:mod:`fotismos.reports.page.embedding`).
    ``templates/viewer/terms.js`` reads them, with the ``columns`` and ``rows`` of the grid's
    pixels; lights have a name, ``L_d`` and ``L_s``.
    """
    if isinstance(grid, Missing):
        return PointsView(missing=grid.reason)
    seen = grid.material >= 0
    # Material -1, where no surface is seen, reads the False at the end.
    shiny = np.array([any(material.k_s) for material in grid.materials] + [False])[grid.material]
    cosines = {"cos_view": grid.cos_view}
    amounts = dict[str, np.ndarray]()
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

    planes: dict[str, np.ndarray] = {"material": (grid.material + 1).astype(np.uint16)}
    for name, values in cosines.items():
        code = np.rint(LARGEST_CODE * (1 + np.clip(values, -1, 1)) / 2)
        planes[name] = np.where(seen, code, 0).astype(np.uint16)
    for name, values in amounts.items():
        code = np.rint(LARGEST_CODE * np.sqrt(np.maximum(values, 0) / tops[name]))
        planes[name] = code.astype(np.uint16)
    data = {
        "columns": grid.columns.tolist(),
        "rows": grid.rows.tolist(),
        "tops": tops,
        "materials": grid.materials,
        "lights": [
            {name: getattr(lamp, name) for name in ("name", "intensity", "specular_intensity")}
            for lamp in grid.lights
        ],
    }
    return PointsView(grid=packed(planes), data=plain(data))


def live_view(points: LivePoints | Missing) -> PointsView:
    """Return the page's data of the points that it can shade again; or why it cannot.

    A value ``v`` has the code ``16383 (1 + v / top) / 2``, with the plane's ``top``.
    ``templates/viewer/shading.js`` reads them. ``rays`` are those of
    :class:`fotismos.comparisons.pixel_terms.LivePoints`; ``fit`` is the mean ΔE2000 that a fit of
    the scene reached, with its width and height.
    """
    if isinstance(points, Missing):
        return PointsView(missing=points.reason)
    tops = {}
    rows = {}
    for name, plane in points.planes.items():
        # The background must not raise the top, and packs well if it is even.
        plane = np.where(points.planes["material"], plane, 0.0)
        tops[name] = float(abs(plane).max()) or 1.0
        codes = np.rint(LIVE_CODE * (1 + plane / tops[name]) / 2).astype(np.uint16)
        # Differences wrap modulo 2^16, and the page's sums wrap back.
        rows[name] = np.diff(codes, axis=0, prepend=np.uint16(0))
    data = {
        "tops": tops,
        "materials": points.materials,
        "lights": points.lights,
        "rays": points.rays,
        "is_flat": points.is_flat,
        "fit": None,
    }
    return PointsView(grid=packed(rows), data=plain(data))
