"""The prices of effects as a chart."""

from typing import Any

import altair as alt

from comparisons.cost.cost_record import Cost, Price
from reports.charts.theme import EFFECT_COLOURS, Spec
from reports.charts.vega import specification


def price_chart(record: Cost) -> Spec:
    """Return the chart of the prices: ΔE2000 removed by each effect, as bars.

    Rules are 95 % intervals. The circle and the stroke show the ΔE2000 removed if the effect is
    added first and last. A tooltip has the numbers.
    """
    rows = [_row(price) for price in record.prices.effects]
    names = [row["effect"] for row in rows]
    colours = alt.Scale(domain=names, range=[EFFECT_COLOURS[name] for name in names])
    numbers = {"removes": "removes, ΔE2000", "alone": "added first", "last": "added last"}
    numbers["adds"] = "adds (ms)"
    chart = alt.Chart(alt.Data(values=rows)).encode(
        y=alt.Y("effect:N", sort=None, title=None).axis(labelLimit=200, ticks=False, domain=False),
        tooltip=[
            "effect:N",
            *(alt.Tooltip(f"{name}:Q", title=numbers[name], format=".3~g") for name in numbers),
        ],
    )

    def x(name: str) -> alt.X:
        return alt.X(f"{name}:Q", title="mean ΔE2000 that it removes")

    removed = alt.Color("effect:N", legend=None, scale=colours)
    layers = alt.layer(
        chart.mark_bar(size=13).encode(x=x("removes"), color=removed),
        chart.mark_rule(strokeWidth=1.5).encode(x=x("low"), x2="high"),
        chart.mark_point(filled=False, size=45, shape="circle").encode(x=x("alone")),
        chart.mark_point(filled=False, size=160, shape="stroke", angle=90).encode(x=x("last")),
    )
    padding = {"left": 30, "right": 5, "top": 5, "bottom": 5}
    return specification(layers.properties(width=340, height=alt.Step(30), padding=padding))


def _row(price: Price) -> dict[str, Any]:
    removed = price.removes
    return {
        "effect": price.effect,
        "removes": removed.value,
        "low": removed.low,
        "high": removed.high,
        "alone": price.alone,
        "last": price.last,
        "adds": price.adds_s.value * 1e3,
    }
