"""The contact sheet of a study: both halves of its scenes, side by side, over two parameters."""

import numpy as np
from matplotlib import rc_context
from matplotlib.figure import Figure

from fotismos.comparisons.study.design import StudyPart
from fotismos.comparisons.study.sheet import Pictures, Sheet
from fotismos.reports.charts.figures import FONT_SIZE, drawn
from fotismos.reports.charts.study_charts import label

CELL = 1.1
"""Inches of a cell's width: both halves."""

DOTS_PER_INCH = 150


def contact_sheet(part: StudyPart, sheet: Sheet, pictures: dict[int, Pictures]) -> bytes:
    """Return the WebP file of a sheet, of pictures by the numbers of points; some may be absent."""
    height, width = next(iter(pictures.values())).shape[1:3]
    gap = max(1, width // 16)
    rows, columns = sheet.points.shape
    step_down = height + gap
    step_across = 2 * width + 2 * gap
    whole = np.full((rows * step_down, columns * step_across, 3), 255, np.uint8)
    for (row, column), number in np.ndenumerate(sheet.points):
        if number in pictures:
            # Large values are on top, as in the maps.
            top = (rows - 1 - row) * step_down
            left = column * step_across
            whole[top : top + height, left : left + 2 * width] = np.hstack([*pictures[int(number)]])
    values = part.points()
    size = (columns * CELL + 0.8, rows * CELL * step_down / step_across + 0.9)
    with rc_context({"font.size": FONT_SIZE, "axes.titlesize": FONT_SIZE}):
        figure = Figure(figsize=size, layout="constrained")
        axes = figure.subplots()
        axes.imshow(whole, interpolation="nearest")
        ticks = [column * step_across + width for column in range(columns)]
        axes.set_xticks(ticks, [f"{values[n][sheet.across]:.3g}" for n in sheet.points[0]])
        axes.set_xlabel(label(sheet.across))
        axes.set_yticks([])
        if sheet.down:
            ticks = [(rows - 1 - row) * step_down + height / 2 for row in range(rows)]
            axes.set_yticks(ticks, [f"{values[n][sheet.down]:.3g}" for n in sheet.points[:, 0]])
            axes.set_ylabel(label(sheet.down))
        axes.tick_params(length=0)
        axes.spines[:].set_visible(False)
        axes.set_title(f"{part.name}: textbook (left) and physical (right)", loc="left")
        return drawn(figure, "webp", DOTS_PER_INCH)
