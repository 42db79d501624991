"""Shapes and materials by their share of the departure, as lines for a terminal and as rows."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

from comparisons.comparison import ComparisonRecord
from comparisons.departure.objects import Carrier
from reports.files import ownership
from reports.terminal.nearest_lines import lacking
from reports.terminal.printing import number, percent
from reports.terminal.tables import comma_separated, printed

COLUMNS = "name", "material", "pixels", "share", "mean_dE2000", "effect"
"""Fields of a carrier that the table shows."""


def lines(record: ComparisonRecord) -> Iterator[str]:
    """Yield the table of a scene's shapes; nothing if there is only one."""
    if len(record.objects) < 2:
        return
    rows = [
        ("shape", "lacks" if record.picture else "mostly", "departure", "pixels", "mean ΔE2000")
    ]
    for carrier in record.objects:
        shares = percent(carrier.share), percent(carrier.pixels / record.pixels.counted)
        rows.append((carrier.name, _cause(carrier), *shares, number(carrier.mean_dE2000)))
    yield from ("", *printed(rows, right=2))
    yield f"  causes took {percent(record.time.share_of_causes)} of the time; --no-why omits them"


def _cause(carrier: Carrier) -> str:
    return lacking(carrier.nearest) if carrier.nearest else carrier.effect or ""


def write(folder: Path, records: Iterable[ComparisonRecord]) -> None:
    """Write ``carriers.csv``, a run's shapes and materials with numbers in full."""
    ownership.write(ownership.folder(folder) / "carriers.csv", comma_separated(_rows(records)))


def _rows(records: Iterable[ComparisonRecord]) -> Iterator[Sequence[Any]]:
    yield "scene", "kind", *COLUMNS
    for record in records:
        for kind, carriers in (("shape", record.objects), ("material", record.materials)):
            for carrier in carriers:
                values = (getattr(carrier, column) for column in COLUMNS)
                yield record.scene, kind, *("" if value is None else value for value in values)
