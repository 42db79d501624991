"""Charts of measurements, from the tables that docs/data keeps as CSV.

A measurement writes its table; ``./run docs`` draws it, so a chart never waits for a measurement.
"""

from collections.abc import Callable, Iterator, Sequence

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from docs.figures.documents import draw, replace
from docs.figures.documents import read_table as read
from docs.figures.model_figures import FAINT, GROUND, STYLE

WIDTH = 7.0
ROW = 0.24
"""Inches: the width of a chart, and the height of a row."""

GATES = {"fotismos": "#1a56a0", "RMSE": "#b97b00", "z-test": "#00795a", "FLIP": "#b0426f"}
"""Colours of the gates; the columns of gates.csv begin with their names."""

THRESHOLDS = {"5": ("#00795a", "o"), "2": ("#1a56a0", "s"), "1": ("#b0426f", "D")}
"""Colour and mark of each threshold, in ΔE2000."""

TIME = "time over the kernel's"
"""A column of methods.csv; empty where nothing passes."""

INTERVALS = {
    "mean": "the means",
    "share": "the shares of visible pixels",
    "effects": "the effects",
    "closure": "the closures",
}
"""Columns of noise.csv, in words."""


def write() -> None:
    """Draw the charts, and write the sentence on intervals in noise."""
    with rc_context(STYLE | {"font.size": 9}):
        for name, chart in CHARTS.items():
            draw(f"{name}.svg", chart())
    replace("witnesses.md", "noise", intervals())


def gates() -> Figure:
    """Draw how often four gates fail: where nothing changed, and where a factor did."""
    rows = read("gates")
    figure, panels = _rows([row["noise"] for row in rows], columns=2)
    for axes, column, title in (
        (panels[0], "alarms, 4 repeats", "fails though nothing changed (%)"),
        (panels[1], "factor found", "finds a factor of 1.01322 (%)"),
    ):
        axes.set_title(title, loc="left", fontsize=9)
        for place, (gate, colour) in enumerate(GATES.items()):
            key = f"{gate}: {column}"
            values = [float(row.get(key, row.get(f"{gate}: alarms", ""))) for row in rows]
            heights = [height + 0.2 * (place - 1.5) for height in range(len(rows))]
            axes.scatter(values, heights, 18, color=colour, label=gate, zorder=2)
        axes.set_xlim(-4, 104)
    _explain(figure, panels[0])
    return figure


def methods() -> Figure:
    """Draw the time of the fastest method that passes at each threshold, for scenes alike."""
    rows = [row for row in read("methods") if row["threshold"] in THRESHOLDS]
    groups = list(dict.fromkeys(row["scenes"] for row in rows))
    figure, (axes,) = _rows([_shortened(group) for group in groups], height=0.46)
    axes.set_xscale("log")
    axes.set_xlim(0.8, 230)
    axes.xaxis.set_major_formatter("{x:g}")
    axes.set_xlabel("time over the textbook kernel's")
    for place, group in enumerate(groups):
        named: set[str] = set()
        for row in (each for each in rows if each["scenes"] == group):
            colour, mark = THRESHOLDS[row["threshold"]]
            shift = 0.27 * (list(THRESHOLDS).index(row["threshold"]) - 1)
            if not row[TIME]:  # no method passes
                continue
            time = float(row[TIME])
            axes.scatter(time, place + shift, 22, color=colour, marker=mark, zorder=2)
            name = ", ".join(word for word in (row["method"], row["samples"]) if word)
            if name not in named:
                named.add(name)
                _beside(axes, name, time, place + shift)
    for threshold, (colour, mark) in THRESHOLDS.items():
        axes.scatter([], [], 22, color=colour, marker=mark, label=f"ΔE2000 {threshold}")
    _explain(figure, axes)
    return figure


def fronts() -> Figure:
    """Draw the methods that no other beats in time without losing in error, at full size."""
    rows = read("fronts")
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    figure = Figure(figsize=(WIDTH, 3.4), facecolor=GROUND, layout="constrained")
    for axes, scene in zip(figure.subplots(1, len(scenes)), scenes, strict=True):
        points = [row for row in rows if row["scene"] == scene]
        times = [1000 * float(row["seconds"]) for row in points]
        errors = [float(row["mean ΔE2000"]) for row in points]
        axes.step(times, errors, where="post", color=FAINT, linewidth=1)
        axes.scatter(times, errors, 22, color=GATES["fotismos"], zorder=2)
        axes.set_xscale("log")
        axes.set_yscale("log")
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_formatter("{x:g}")
            axis.set_minor_formatter("")
        axes.set_yticks([ticks for ticks in (0.5, 1, 2, 5, 10) if min(errors) <= ticks])
        axes.margins(0.2)
        axes.set_title(scene, loc="left")
        axes.set_xlabel("time (ms)")
        axes.set_ylabel("mean ΔE2000")
        for row, time, error in zip(points, times, errors, strict=True):
            is_right = time > (min(times) * max(times)) ** 0.5
            _beside(axes, f"{row['method']}, {row['samples']}", time, error, is_right, above=6)
        _plain(axes)
    return figure


def fits() -> Figure:
    """Draw the error of each figure with its paired and with its fitted parameters."""
    rows = read("fits")
    figure, (axes,) = _rows([f"{row['scene']} ({row['form']})" for row in rows])
    paired = [float(row["paired mean ΔE2000"]) for row in rows]
    fitted = [float(row["fitted mean ΔE2000"]) for row in rows]
    places = range(len(rows))
    axes.hlines(places, fitted, paired, color=FAINT, linewidth=1.5, zorder=1)
    axes.scatter(paired, places, 24, color=GATES["RMSE"], label="paired", zorder=2)
    axes.scatter(fitted, places, 24, color=GATES["fotismos"], label="fitted", zorder=3)
    axes.set_xlabel("mean ΔE2000")
    _explain(figure, axes)
    return figure


def closed_forms() -> Figure:
    """Draw how far the reference is from each closed form, with 95 % intervals."""
    rows = read("closed-forms")
    figure, (axes,) = _rows([row["case"] for row in rows])
    values = [float(row["reference less form (%)"]) for row in rows]
    spreads = [float(row["95 % interval (±)"]) for row in rows]
    axes.axvline(0, color=FAINT, linewidth=1)
    axes.errorbar(values, range(len(rows)), xerr=spreads, fmt="o", color="#1a56a0",
                  markersize=4, elinewidth=1.5)  # fmt: skip
    axes.set_xlabel("reference less closed form (%)")
    return figure


def intervals() -> Iterator[str]:
    """Yield how many intervals hold the truth in scenes that are hard to sample."""
    rows = read("noise")
    shares = []
    least = []
    for number, words in INTERVALS.items():
        counts = [row[number].split(" of ") for row in rows if " of " in row[number]]
        held = sum(int(some) for some, _ in counts)
        shares.append(f"{100 * held / sum(int(every) for _, every in counts):.0f} % of {words}")
        for row in rows:
            some, _, every = row[number].partition(" of ")
            if every and int(some) < 0.8 * int(every):
                least.append(f"{words} of *{row['scene']}*: {row[number]}")
    yield f"The intervals hold the true value for {', '.join(shares)}."
    if least:
        yield f"Fewer than four fifths of the intervals hold it for {'; '.join(least)}."


CHARTS: dict[str, Callable[[], Figure]] = {
    "gates": gates,
    "methods": methods,
    "fronts": fronts,
    "fits": fits,
    "closed-forms": closed_forms,
}
"""Charts by the table that they show, docs/data/NAME.csv."""


def _rows(
    names: Sequence[str], columns: int = 1, height: float = ROW
) -> tuple[Figure, Sequence[Axes]]:
    """Return a figure with a named row for each thing, from the top, and its panels."""
    size = (WIDTH, height * len(names) + 0.9)
    figure = Figure(figsize=size, facecolor=GROUND, layout="constrained")
    panels = figure.subplots(1, columns, sharey=True, squeeze=False)[0]
    for axes in panels:
        axes.set_yticks(range(len(names)), names)
        axes.set_ylim(len(names) - 0.4, -0.6)
        axes.tick_params(axis="y", length=0)
        _plain(axes)
    return figure, panels


def _plain(axes: Axes) -> None:
    axes.set_facecolor(GROUND)
    axes.spines[["top", "right", "left"]].set_visible(False)
    axes.grid(alpha=0.25)


def _beside(
    axes: Axes, name: str, x: float, y: float, is_right: bool = False, above: float = 0
) -> None:
    """Write a name beside a point: to its right, or to its left where the panel ends."""
    axes.annotate(
        name,
        (x, y),
        xytext=(-5 if is_right else 5, above),
        textcoords="offset points",
        va="center",
        ha="right" if is_right else "left",
        fontsize=8,
    )


def _explain(figure: Figure, axes: Axes) -> None:
    """Draw the legend of a panel below the figure."""
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False)


def _shortened(scenes: str) -> str:
    """Return names of scenes in two lines at most, and how many more there are."""
    names = scenes.split(", ")
    if len(names) <= 3:
        return ",\n".join([", ".join(names[:2]), *names[2:]])
    return f"{names[0]}, {names[1]}\nand {len(names) - 2} more"
