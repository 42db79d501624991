"""The files of an audit: its record, and a chart of albedos."""

from pathlib import Path

from comparisons import records
from comparisons.audit.audit_record import Audit
from reports.charts import vega
from reports.charts.albedo_chart import albedo_chart
from reports.files import ownership


def write(place: Path, record: Audit) -> None:
    """Write ``audit.svg`` and ``audit.json`` to a folder; the record comes last."""
    ownership.folder(place)
    ownership.write(place / "audit.svg", vega.paper(albedo_chart(record)))
    ownership.write(place / "audit.json", records.to_json(record))
