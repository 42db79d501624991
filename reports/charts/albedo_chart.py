"""The albedos of an audit over angles from the normal, as a chart."""

from typing import Any

from comparisons.audit.audit_record import Audit
from reports.charts.theme import FAINT, Spec

WIDTH, HEIGHT = 420, 300

HIGHEST = 2.5
"""End of the axis; curves above are clipped."""

KINDS = (
    "seen in a white furnace, by the viewer's angle",
    "returned of light, by the light's angle",
)


def albedo_chart(record: Audit) -> Spec:
    """Return the Vega-Lite specification of an audit's curves."""
    rows: list[dict[str, Any]] = [
        {"angle": angle, "albedo": value, "material": curve.material, "kind": kind}
        for curve in record.curves
        for kind, values in zip(KINDS, (curve.seen, curve.returned), strict=True)
        for angle, value in zip(record.angles, values, strict=True)
    ]
    top = min(HIGHEST, 1.1 * max(1.0, *(row["albedo"] for row in rows)))
    x: Spec = {"field": "angle", "type": "quantitative", "title": "angle from the normal [degrees]"}
    x["scale"] = {"domain": [0, 90], "nice": False}
    y: Spec = {"field": "albedo", "type": "quantitative", "title": "albedo of a white material"}
    y["scale"] = {"domain": [0, top], "nice": False}
    colour: Spec = {"field": "material", "type": "nominal", "title": "material"}
    colour["sort"] = [curve.material for curve in record.curves]
    dash: Spec = {"field": "kind", "type": "nominal", "title": None, "sort": list(KINDS)}
    dash["legend"] = {"labelLimit": 400, "orient": "bottom", "direction": "vertical"}
    dash["legend"] |= {"symbolType": "stroke", "symbolSize": 400}
    line = {"type": "line", "clip": True, "strokeWidth": 2}
    curves = {"mark": line, "encoding": {"x": x, "y": y, "color": colour, "strokeDash": dash}}
    one = {"mark": {"type": "rule", "color": FAINT}, "encoding": {"y": {"datum": 1}}}
    return {
        "width": WIDTH,
        "height": HEIGHT,
        "title": record.subject,
        "data": {"values": rows},
        "layer": [one, curves],
    }
