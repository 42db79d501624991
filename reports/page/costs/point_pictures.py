"""Small pictures of the points of a cost chart: one rendering of each method and sample count."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from PIL import Image

from reports.files import sheets
from reports.files.images import tonemap
from reports.files.sheets import Sheet
from reports.terminal.printing import difference, parameter, seconds

if TYPE_CHECKING:
    from comparisons.cost.cost import Study
    from comparisons.cost.cost_record import Cost

#: Pixels of a picture's longer side, at most.
LONGEST = 128


def sheet(study: Study) -> Sheet | None:
    """Return the pictures of a study's points in their order, and last that of the reference."""
    exposure = study.record.viewing.exposure
    points = ((point.rung, point.spp) for point in study.record.points)
    images = [*(study.points[key] for key in points), study.reference]
    return sheets.sheet([_small(image, exposure) for image in images])


def data(record: Cost, shown: Sheet) -> dict[str, Any]:
    """Return the data of the page's script: the sheet, and what its pictures are."""
    points = [
        {
            "method": point.rung,
            "samples": f"{parameter(point.spp)} samples per pixel",
            "time": seconds(point.seconds.median),
            "error": difference(point.error),
        }
        for point in record.points
    ]
    return sheets.placed(shown) | {"points": points}


def _small(image: np.ndarray, exposure: float) -> Image.Image:
    picture = tonemap(image, exposure)
    picture.thumbnail((LONGEST, LONGEST), Image.Resampling.BOX)
    return picture
