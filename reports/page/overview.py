"""The page's overview: its columns, and the scenes' names in the address."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from markupsafe import Markup, escape

from comparisons.comparison import ComparisonRecord
from comparisons.departure.metric import Metric
from comparisons.departure.metrics import LEADING, METRICS
from reports.terminal.printing import about_noise


@dataclass(frozen=True)
class Column:
    """A sort key of scenes: its title, its number, and the number's form.

    ``form`` is one of the macro ``value``, ``style`` a class; scenes are judged by the ``leading``
    column.
    """

    key: str
    title: str
    value: Callable[[ComparisonRecord], float]
    form: str = "number"
    style: str = ""
    leading: bool = False

    @property
    def heading(self) -> Markup:
        """The title as a heading of a narrow column."""
        return escape(self.title[0].upper() + self.title[1:]).replace(", ", Markup(",<br>"))


def columns() -> tuple[Column, ...]:
    """The columns of the overview after the scene's name, in order."""
    lead, name = LEADING.label, LEADING.name
    return (
        Column(name, LEADING.heading, _mean(LEADING), "difference", "strong", leading=True),
        Column(
            "shape",
            f"{lead}, best exposure",
            lambda r: r.metrics[name].after_exposure.mean,
            "difference",
        ),
        Column(
            "noise",
            f"{lead}, noise floor",
            lambda r: r.metrics[name].noise_floor,
            "difference",
            "quiet",
        ),
        *(
            Column(
                metric.name,
                metric.heading,
                _mean(metric),
                "difference" if metric.visible else "number",
            )
            for metric in METRICS.values()
            if metric is not LEADING
        ),
        Column("marked", "significant pixels", lambda r: r.significant.fraction, "percent"),
        Column(
            "heuristic_s", "heuristic, all passes", lambda r: r.time.heuristic.total_s, "seconds"
        ),
        Column(
            "reference_s", "reference, all passes", lambda r: r.time.reference.total_s, "seconds"
        ),
    )


def _mean(metric: Metric) -> Callable[[ComparisonRecord], float]:
    return lambda record: record.metrics[metric.name].mean


def keys(record: ComparisonRecord) -> dict[str, float]:
    """A scene's number in each of `columns`."""
    return {column.key: column.value(record) for column in columns()}


def is_significant(record: ComparisonRecord) -> bool:
    """Whether a scene departs by more than noise in some pixels and in its mean."""
    return record.significant.fraction > 0 and not about_noise(record.metrics[LEADING.name])


def identifier(name: str, taken: set[str]) -> str:
    """A name for a scene in the page's address: plain characters; added to `taken`."""
    plain = "".join(c if (c.isascii() and c.isalnum()) or c in "-_." else "-" for c in name)
    chosen, count = plain or "scene", 1
    while chosen in taken:
        count += 1
        chosen = f"{plain or 'scene'}-{count}"
    taken.add(chosen)
    return chosen
