"""What looking right takes in each scene, from comparisons alone: a table, a chart, and sentences.

``./run docs --prices`` measures for some six minutes on an idle machine.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import log10

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from docs.figures.accuracy import LARGER
from docs.figures.documents import draw, read_table, replace, write_table
from docs.figures.model_figures import GROUND, STYLE, quiet
from fotismos.comparisons.case import open_case
from fotismos.comparisons.compare import compare
from fotismos.comparisons.gallery.builtin import SCENES
from fotismos.comparisons.options import Options
from fotismos.comparisons.records.comparison import ComparisonRecord, Price
from fotismos.comparisons.steps import steps
from fotismos.reports import verdict
from fotismos.reports.terminal.words import number, percent, seconds

SIZE = 256, 192
THRESHOLD = 2.0

SHARE = "share that differs"
PRICE = "time over the textbook's"
HEAD = "scene", "needs", SHARE, "time of a sample over the textbook's", "samples", PRICE, "time"
"""Columns of the table: the last three are those of the physical picture that passes."""

UNKNOWN = "–"
"""Stands in the table where nothing passes, or no time is known."""

NEAR = 7.0
NEAR_DECADES = 0.2
"""Percent of pixels, and decades of time, by which points differ at least, to have labels of their
own."""

NAMED_ABOVE = 1.6
"""Times of the textbook's time above which the chart names a scene."""


@dataclass(frozen=True)
class Point:
    """A scene of the chart: its price, and the percentage of pixels that differ."""

    scene: str
    price: float
    share: float


def write() -> None:
    """Compare the scenes, and write their table, chart and sentences."""
    records = measured()
    write_table("prices", [HEAD, *map(_row, records)])
    draw("prices.svg", chart(read_table("prices")))
    replace("../README.md", "prices", sentences(records))
    replace("models.md", "complexity", complexity(records))


def measured() -> list[ComparisonRecord]:
    """Compare each scene, with its causes."""
    records = []
    for name in (*SCENES, *map(str, LARGER)):
        case = open_case(name, Options(resolution=SIZE))
        then = steps(why=True)
        made = compare(case.source, case.options, command=case.command(), then=then)
        records.append(made.record)
        print(name, flush=True)
    return records


def sentences(records: Sequence[ComparisonRecord]) -> Iterator[str]:
    """Yield what all scenes show together."""
    width, height = SIZE
    yield (
        f"{len(records)} scenes at {width} by {height} pixels. {verdict.headline(records)}"
        f" {verdict.costs(records)} {verdict.savings(records)}"
    )


def complexity(records: Sequence[ComparisonRecord]) -> Iterator[str]:
    """Yield what physics takes over the textbook in the figures of chapter 8."""
    ratios = [
        record.price.ratio.value
        for record in records
        if record.scene.startswith("fig-8") and record.price and record.price.ratio
    ]
    yield (
        "Chapter 8 leaves physical models out because of their considerably greater complexity. In"
        f" {len(ratios)} of its own figures a physical sample takes {number(min(ratios))} to"
        f" {number(max(ratios))} times as long as a textbook one; in the Cornell box it takes"
        " longer ([what accuracy costs](accuracy.md))."
    )


def _row(record: ComparisonRecord) -> tuple[str, ...]:
    price = record.price
    assert price is not None
    samples = price.samples_at(THRESHOLD)
    needed = price.needed_at(THRESHOLD)
    assert needed is not None
    effects = ", ".join(needed.effects) or "nothing"
    count = UNKNOWN
    if samples is not None:
        count = "more than 65,536" if samples.value is None else f"{samples.value:,}"
        if samples.value is not None and samples.high is None:
            count = f"{count} or more"
    over_textbook = verdict.price_at(record, THRESHOLD)
    return (
        record.scene,
        effects,
        percent(verdict.share(record).value),
        "?" if price.ratio is None else number(price.ratio.value),
        count,
        UNKNOWN if over_textbook is None else number(over_textbook),
        _seconds(record, price),
    )


def _seconds(record: ComparisonRecord, price: Price) -> str:
    """Return the time of the physical picture that passes."""
    samples = price.samples_at(THRESHOLD)
    if samples is None or samples.value is None:
        return UNKNOWN
    taken = price.seconds(samples.value)
    return UNKNOWN if taken is None else seconds(taken)


def chart(rows: Sequence[Mapping[str, str]]) -> Figure:
    """Draw the share of pixels that differ over the price, logarithmic, out of the table's rows."""
    points = [
        Point(
            scene=row["scene"].replace("_", " "),
            price=float(row[PRICE].replace(",", "")),
            share=float(row[SHARE].removesuffix(" %")),
        )
        for row in rows
        if row[PRICE] != UNKNOWN
    ]
    with rc_context(STYLE):
        figure = Figure(figsize=(7, 3.6), facecolor=GROUND, layout="constrained")
        axes = figure.subplots()
        axes.scatter(
            [point.price for point in points],
            [point.share for point in points],
            color="#1a56a0",
            zorder=2,
        )
        _name(axes, [point for point in points if point.price > NAMED_ABOVE])
        axes.set_xscale("log")
        axes.xaxis.set_major_formatter("{x:g}")
        axes.set(
            xlabel="time of what looks right, over the textbook picture's",
            ylabel="pixels that differ without it (%)",
        )
        quiet(axes)
        axes.margins(x=0.14)
    return figure


def _name(axes: Axes, points: Sequence[Point]) -> None:
    """Write the names of scenes beside their points, those of near points together."""
    groups: list[list[Point]] = []
    for point in sorted(points, key=lambda point: -point.share):
        for group in groups:
            is_level = abs(group[0].share - point.share) < NEAR
            if is_level and abs(log10(group[0].price / point.price)) < NEAR_DECADES:
                group.append(point)
                break
        else:
            groups.append([point])
    dearest = max(point.price for point in points)
    for group in groups:
        ordered = sorted(group, key=lambda point: point.price)
        is_left = ordered[0].price > dearest / 30
        beside = ordered[0 if is_left else -1]
        axes.annotate(
            ", ".join(point.scene for point in ordered),
            (beside.price, beside.share),
            xytext=(-6 if is_left else 6, -3),
            textcoords="offset points",
            ha="right" if is_left else "left",
            fontsize=8,
        )
