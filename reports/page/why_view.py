"""Causes for the page: which effect dominates where, and small pictures of combinations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from comparisons.departure.colour import Viewing
from comparisons.departure.metrics import delta_e_2000
from comparisons.hybrids.attribution import dominating
from reports.charts.theme import EFFECT_COLOURS
from reports.files import images
from reports.page.scene_view import EffectMap, WhyView

LETTERS = {-1: ".", -2: "-"} | dict(enumerate("0123456789"))
"""Codes of the map: no effect, a pixel that does not count, and the effects' places."""

STEP, UNCOUNTED = 0.1, 255
"""ΔE2000 of a level of the maps, and the level of pixels that do not count; as in switches.js."""


def why_view(
    maps: Mapping[str, NDArray],
    counted: NDArray[np.bool_],
    previews: Sequence[NDArray],
    viewing: Viewing,
) -> WhyView:
    """Return the view of causes.

    ``maps`` (H, W) are what each effect removes, and ``counted`` (H, W) the pixels in the
    statistics. ``previews`` are linear images of the hybrids, the last with all effects; their
    sides are a multiple of the maps'.
    """
    places, names = dominating(maps, counted), tuple(maps)
    found = EffectMap(
        width=places.shape[1],
        height=places.shape[0],
        names=names,
        colours=tuple(EFFECT_COLOURS[name] for name in names),
        map="".join(LETTERS[int(place)] for place in places.ravel()),
    )
    if len(previews) < 2:
        return WhyView(found)
    times = len(previews[0]) // len(counted)
    shown = counted.repeat(times, axis=0).repeat(times, axis=1)
    levels = [np.rint(delta_e_2000(each, previews[-1], viewing) / STEP) for each in previews]
    left = [np.where(shown, np.minimum(each, UNCOUNTED - 1), UNCOUNTED) for each in levels]
    return WhyView(
        found,
        images.sheet([images.tonemap(each, viewing.exposure) for each in previews]),
        images.sheet([Image.fromarray(each.astype(np.uint8)) for each in left], lossless=True),
    )
