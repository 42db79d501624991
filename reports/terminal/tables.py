"""Tables on the terminal, the same for every command, and a run's metrics as CSV and Markdown."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator, Mapping, Sequence
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from rich.console import Console
from rich.table import Table

from comparisons.comparison import ComparisonRecord
from comparisons.departure.metrics import METRICS
from comparisons.records import plain
from reports.files import ownership
from reports.terminal.printing import number, percent

if TYPE_CHECKING:
    from comparisons.cost.cost_record import Cost

#: Characters per line of a printed table; longer cells are folded.
WIDTH = 120


def printed(rows: Iterable[Sequence[str]], right: int | None = None) -> Iterator[str]:
    """Return the lines of a table, the same on a terminal and in a file.

    The first row has the headings. Columns from number ``right`` are aligned right.
    """
    headings, *others = rows
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    for place, heading in enumerate(headings):
        is_left = right is None or place < right
        justify: Literal["left", "right"] = "left" if is_left else "right"
        table.add_column(heading, overflow="fold", justify=justify)
    for row in others:
        table.add_row(*row)
    console = Console(width=WIDTH, color_system=None)
    with console.capture() as capture:
        console.print(table)
    return (line.rstrip() for line in capture.get().splitlines())


def markdown(rows: Iterable[Sequence[str]], right: int = 1) -> Iterator[str]:
    """Yield the lines of a table in Markdown.

    The first row has the headings. Columns from number ``right`` are aligned right.
    """
    headings, *others = rows
    yield _row(headings)
    yield _row(["---"] * right + ["---:"] * (len(headings) - right))
    for row in others:
        yield _row([cell.replace("|", "\\|") for cell in row])


def write(folder: Path, records: Iterable[ComparisonRecord]) -> None:
    """Write a run's ``metrics.csv`` and ``metrics.md`` to a folder."""
    ownership.folder(folder)
    records = list(records)
    ownership.write(folder / "metrics.csv", metrics_csv(records))
    ownership.write(folder / "metrics.md", "\n".join(metrics_markdown(records)) + "\n")


def write_cost(folder: Path, name: str, record: Cost) -> None:
    """Write the tables of a study of cost: ``name-cost``, ``name-prices`` and ``name-shapes``."""
    ownership.folder(folder)
    made = {"cost": methods(record), "prices": prices(record), "shapes": shapes(record)}
    for part, rows in ((part, [*found]) for part, found in made.items()):
        ownership.write(folder / f"{name}-{part}.csv", comma_separated(rows))
        shown = ([_shown(cell) for cell in row] for row in rows)
        ownership.write(folder / f"{name}-{part}.md", "\n".join(markdown(shown)) + "\n")


def methods(record: Cost) -> Iterator[Sequence[Any]]:
    """Yield the rows of a study's methods: seconds for one image, and mean ΔE2000."""
    yield "method", "spp", "median_s", "low_s", "high_s", "error", "error_stderr", "front"
    for point in record.points:
        seconds = point.seconds
        times = seconds.median, seconds.low, seconds.high
        front = "yes" if point.pareto else "no"
        yield point.rung, point.spp, *times, point.error, point.error_stderr, front


def prices(record: Cost) -> Iterator[Sequence[Any]]:
    """Yield the rows of the effects: the mean ΔE2000 that each removes, the seconds it adds."""
    yield "effect", "removes", "removes_low", "removes_high", "alone", "last", "adds_s"
    for price in record.prices.effects:
        removes = price.removes.value, price.removes.low, price.removes.high
        yield price.effect, *removes, price.alone, price.last, price.adds_s.value


def shapes(record: Cost) -> Iterator[Sequence[Any]]:
    """Yield the rows of the shapes: the mean ΔE2000 that each effect removes there."""
    yield "shape", "pixels", "share", "dE2000", "effect", "removes", "removes_low", "removes_high"
    for row in record.objects:
        for price, removes in zip(record.prices.effects, row.removes, strict=True):
            found = removes.value, removes.low, removes.high
            yield row.name, row.pixels, row.share, row.departure, price.effect, *found


def metrics_csv(records: Iterable[ComparisonRecord]) -> str:
    """Return a line for each scene and metric, with every number of the record in full.

    Columns are named as in ``comparison.json``; the shape's begin with ``after_exposure.``.
    """
    rows = [
        {"scene": record.scene, "metric": name}
        | dict(_flat(plain(summary)))
        | {"significant": record.significant.fraction}
        for record in records
        for name, summary in record.metrics.items()
    ]
    headings = list(dict.fromkeys(key for row in rows for key in row))
    return comma_separated([headings, *([row.get(key, "") for key in headings] for row in rows)])


def _flat(record: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in record.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield prefix + key, value


def comma_separated(rows: Iterable[Sequence[Any]]) -> str:
    """Return a table as CSV (RFC 4180, lines end with a line feed), with numbers in full."""
    text = StringIO()
    csv.writer(text, lineterminator="\n").writerows(rows)
    return text.getvalue()


def metrics_markdown(records: Iterable[ComparisonRecord]) -> Iterator[str]:
    """Yield the lines of a run's table: each metric's mean, its shape and its noise floor."""
    yield from markdown(_metrics(records))
    yield ""
    yield "Mean over the pixels that see a surface; in brackets the mean after the one exposure"
    yield "that makes it smallest, and the mean that the reference's noise alone would give."


def _metrics(records: Iterable[ComparisonRecord]) -> Iterator[Sequence[str]]:
    labels = [metric.label for metric in METRICS.values()]
    yield "scene", *labels, "significant", "samples per pixel"
    for record in records:
        means = (
            f"{number(m.mean)} ({number(m.after_exposure.mean)}; {number(m.noise_floor)})"
            for m in (record.metrics[name] for name in METRICS)
        )
        significant = percent(record.significant.fraction)
        yield record.scene, *means, significant, f"{record.plan.spp}"


def _row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _shown(cell: Any) -> str:
    return number(cell) if isinstance(cell, float) else str(cell)
