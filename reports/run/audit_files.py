"""The files of an audit: its record, its page, and a chart of albedos."""

from collections.abc import Iterable
from pathlib import Path

from comparisons import records
from comparisons.audit.audit_record import Audit
from reports.charts import audit_charts, vega
from reports.charts.theme import Spec
from reports.files import ownership
from reports.page import templates
from reports.run.places import PAGE
from reports.terminal import audit_words
from reports.terminal.printing import number

ALBEDOS = {"white furnace": "seen", "energy": "returned"}
"""Fields of a curve that the charts of a check show."""


def write(place: Path, record: Audit) -> None:
    """Write ``audit.svg``, ``index.html`` and ``audit.json`` to a folder; the record comes last."""
    ownership.folder(place)
    ownership.write(place / "audit.svg", vega.paper(audit_charts.albedo_chart(record)))
    ownership.write(place / PAGE, render(record))
    ownership.write(place / "audit.json", records.to_json(record))


def render(record: Audit) -> str:
    """Return the page of an audit: one file, without scripts."""
    environment = templates()
    environment.filters.update(number=number, found=audit_words.found)
    return environment.get_template("audit.html.j2").render(
        record=record,
        title=audit_words.titled(record),
        headline=audit_words.headline(record),
        meanings=audit_words.MEANINGS,
        charts=_charts(record),
    )


def _charts(record: Audit) -> dict[str, list[vega.Figure]]:
    """Return the charts of each check, and the lobes."""
    found = {
        check: _figures(audit_charts.albedo_charts(record, field))
        for check, field in ALBEDOS.items()
    }
    viewers = {each.material: f"Seen by the {each.viewer}." for each in record.sunsets}
    found["horizon"] = [
        vega.figure(material, spec, viewers[material])
        for material, spec in audit_charts.sunset_charts(record)
    ]
    chart = audit_charts.asymmetry_chart(record)
    found["reciprocity"] = [vega.figure(record.asymmetry.material, chart)]
    found["lobes"] = _figures(audit_charts.lobe_charts(record))
    return found


def _figures(charts: Iterable[tuple[str, Spec]]) -> list[vega.Figure]:
    return [vega.figure(name, spec) for name, spec in charts]
