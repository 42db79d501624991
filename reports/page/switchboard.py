"""The effect switchboard: a preview of each corner of a scene's lattice, in one picture."""

from __future__ import annotations

from typing import Any

from comparisons.cost.cost_record import Cost
from reports.files import sheets
from reports.files.sheets import Sheet
from reports.terminal.printing import number, seconds

#: ΔE2000: smaller means are rounding or remaining noise.
LEAST = 0.01


def data(record: Cost, shown: Sheet) -> dict[str, Any]:
    """Return the data of the switchboard's script: the sheet, and the meaning of its pictures."""
    effects = [price.effect for price in record.prices.effects]
    return sheets.placed(shown) | {
        "corners": [
            {
                "on": [effects.index(effect) for effect in corner.effects],
                "error": number(corner.error) if corner.error >= LEAST else f"< {LEAST}",
                "time": seconds(max(corner.seconds, 0.0)),
            }
            for corner in record.prices.corners
        ],
    }
