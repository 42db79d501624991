"""How effects are shown: a colour each, and their prices as a chart."""

from reference.effects.enumeration import EFFECTS

TITLE = "Effects"
"""Of the map of what dominates where."""

WIDTH, STEP = 340, 30
"""Pixels of the plot, and of one effect's row."""

COLOURS = {effect.label: effect.colour for effect in EFFECTS if effect.colour}
"""Of the effects that have a price: the seven of Okabe and Ito for what often comes together, and
three of Tol's muted scheme. Both are made to be told apart with the common colour deficiencies."""

NO_EFFECT = "#dee2e6"
"""Where no effect removes enough to be seen."""


def price_chart(record):
    """Return the chart of the prices in ``cost.json``: ΔE2000 removed by each effect, as bars.

    Rules are 95 % intervals, the circle and the stroke what the effect removes where it is added
    first and last. A tooltip has the numbers.
    """
    rows = [_row(price) for price in record.prices.effects]
    place = {"field": "effect", "type": "nominal", "sort": None, "title": None}
    tooltip = [
        {"field": "effect", "title": "effect"},
        {"field": "removes", "title": "removes, ΔE2000", "format": ".3~g"},
        {"field": "alone", "title": "added first", "format": ".3~g"},
        {"field": "last", "title": "added last", "format": ".3~g"},
        {"field": "adds", "title": "adds (ms)", "format": ".3~g"},
    ]
    axis = {"labelLimit": 200, "ticks": False, "domain": False}

    def layer(mark, x, **more):
        encoding = {"y": place | {"axis": axis}, "x": {"field": x, "type": "quantitative"}}
        encoding["x"]["title"] = "mean ΔE2000 that it removes"
        return {"mark": mark, "encoding": encoding | {"tooltip": tooltip} | more}

    fill = {
        "field": "effect",
        "legend": None,
        "scale": {
            "domain": [row["effect"] for row in rows],
            "range": [COLOURS[row["effect"]] for row in rows],
        },
    }
    point = {"type": "point", "filled": False, "size": 45, "color": "currentColor"}
    return {
        "width": WIDTH,
        "height": {"step": STEP},
        "padding": {"left": 30, "right": 5, "top": 5, "bottom": 5},
        "data": {"values": rows},
        "layer": [
            layer({"type": "bar", "size": 13}, "removes", color=fill),
            layer({"type": "rule", "strokeWidth": 1.5}, "low", x2={"field": "high"}),
            layer(point | {"shape": "circle"}, "alone"),
            layer(point | {"shape": "stroke", "angle": 90, "size": 160}, "last"),
        ],
    }


def _row(price):
    return {
        "effect": price.effect,
        "removes": price.removes.value,
        "low": price.removes.low,
        "high": price.removes.high,
        "alone": price.alone,
        "last": price.last,
        "adds": price.adds_s.value * 1e3,
    }
