"""The cost of accuracy over all scenes: the time of each method, and the error that it leaves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from comparisons.cost.cost_record import Cost, Measured, Price
from comparisons.cost.rungs import rungs


@dataclass(frozen=True)
class Cell:
    """A method on one scene: its point of most samples.

    Methods between which the scene makes no difference share a rung; all cells of the rung except
    the first are ``merged``.
    """

    point: Measured
    merged: bool


@dataclass(frozen=True)
class Row:
    """A scene: a cell for each method, None if it has none, and the effect worth most."""

    record: Cost
    cells: tuple[Cell | None, ...]
    best: Price | None


def methods(records: Sequence[Cost]) -> tuple[str, ...]:
    """Return the names of all methods of some records, in the order of the ladder."""
    places = {rung.name: place for place, rung in enumerate(rungs())}
    names = dict.fromkeys(name for each in records for rung in each.rungs for name in rung.names)
    # If another heuristic shades a kernel, the kernel's name continues after a colon.
    return tuple(sorted(names, key=lambda name: places.get(name.partition(":")[0], len(places))))


def rows(records: Sequence[Cost]) -> list[Row]:
    """Return a row for each record, whose cells are in the order of :func:`methods`."""
    names = methods(records)
    return [Row(record, _cells(record, names), _best(record)) for record in records]


def _cells(record: Cost, names: Sequence[str]) -> tuple[Cell | None, ...]:
    cells: list[Cell | None] = []
    seen: set[str] = set()
    for name in names:
        rung = next((rung.name for rung in record.rungs if name in rung.names), None)
        if rung is None:
            cells.append(None)
            continue
        last = max(record.points_of(rung), key=lambda point: point.spp)
        cells.append(Cell(last, merged=rung in seen))
        seen.add(rung)
    return tuple(cells)


def _best(record: Cost) -> Price | None:
    """Return the effect that removes most, among those surely above 0, or None."""
    sure = [price for price in record.prices.effects if price.removes.low > 0]
    return max(sure, key=lambda price: price.removes.value, default=None)
