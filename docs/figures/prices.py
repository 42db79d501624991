"""What looking right takes in each scene, from comparisons alone: a table, a chart, and sentences.

``./run docs --prices`` measures for some six minutes on an idle machine.
"""

from collections.abc import Iterator, Sequence
from math import log10

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from docs.figures.accuracy import LARGER
from docs.figures.documents import draw, replace, write_table
from docs.figures.model_figures import GROUND, STYLE, quiet
from fotismos.comparisons.case import open_case
from fotismos.comparisons.compare import compare
from fotismos.comparisons.comparison import ComparisonRecord
from fotismos.comparisons.gallery.builtin import SCENES
from fotismos.comparisons.options import Options
from fotismos.comparisons.price_record import Price
from fotismos.comparisons.steps import steps
from fotismos.reports import verdict
from fotismos.reports.terminal.words import number, percent, seconds

SIZE = 256, 192
THRESHOLD = 2.0

HEAD = (
    "scene",
    "needs",
    "share that differs",
    "time of a sample over the textbook's",
    "samples",
    "time over the textbook's",
    "time",
)
"""Columns of the table: the last three are those of the physical picture that passes."""

NEAR = 7.0
NEAR_DECADES = 0.13
"""Percent of pixels, and decades of time, by which points differ at least, to have labels of their
own."""

NAMED_ABOVE = 1.6
"""Times of the textbook's time above which the chart names a scene."""


def write() -> None:
    """Compare the scenes, and write their table, chart and sentences."""
    records = measured()
    draw("prices.svg", chart(records))
    replace("../README.md", "prices", sentences(records))
    write_table("prices", [HEAD, *map(_row, records)])
    replace("models.md", "complexity", complexity(records))


def measured() -> list[ComparisonRecord]:
    """Compare each scene, with its causes."""
    records = []
    for name in (*SCENES, *map(str, LARGER)):
        case = open_case(name, Options(resolution=SIZE))
        then = steps(case.options, why=True)
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
    count = "–"
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
        "–" if over_textbook is None else number(over_textbook),
        _seconds(record, price),
    )


def _seconds(record: ComparisonRecord, price: Price) -> str:
    """Return the time of the physical picture that passes."""
    samples = price.samples_at(THRESHOLD)
    if samples is None or samples.value is None:
        return "–"
    taken = price.seconds(samples.value)
    return "–" if taken is None else seconds(taken)


def chart(records: Sequence[ComparisonRecord]) -> Figure:
    """Draw the share of pixels that differ over the price, logarithmic."""
    with rc_context(STYLE):
        figure = Figure(figsize=(7, 3.6), facecolor=GROUND, layout="constrained")
        axes = figure.subplots()
        known = [(record, verdict.price_at(record, THRESHOLD)) for record in records]
        points = [(record, price) for record, price in known if price is not None]
        axes.scatter(
            [price for _, price in points],
            [100 * verdict.share(record).value for record, _ in points],
            color="#1a56a0",
            zorder=2,
        )
        _name(axes, [point for point in points if point[1] > NAMED_ABOVE])
        axes.set_xscale("log")
        axes.xaxis.set_major_formatter("{x:g}")
        axes.set(
            xlabel="time of what looks right, over the textbook picture's",
            ylabel="pixels that differ without it (%)",
        )
        quiet(axes)
        axes.margins(x=0.14)
    return figure


def _name(axes: Axes, points: Sequence[tuple[ComparisonRecord, float]]) -> None:
    """Write the names of scenes beside their points, those of near points together."""
    groups: list[tuple[float, float, list[str]]] = []
    for record, price in sorted(points, key=lambda point: -verdict.share(point[0]).value):
        height = 100 * verdict.share(record).value
        name = record.scene.replace("_", " ")
        for x, y, names in groups:
            if abs(y - height) < NEAR and abs(log10(x / price)) < NEAR_DECADES:
                names.append(name)
                break
        else:
            groups.append((price, height, [name]))
    right = max(x for x, _, _ in groups)
    for x, y, names in groups:
        is_right = x > right / 30
        axes.annotate(
            ", ".join(names),
            (x, y),
            xytext=(-6 if is_right else 6, -3),
            textcoords="offset points",
            ha="right" if is_right else "left",
            fontsize=8,
        )
