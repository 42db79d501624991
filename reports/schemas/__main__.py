"""Write the published schemas: ``python -m reports.schemas``."""

import sys
from pathlib import Path
from typing import Any

from comparisons.audit.checks import Audit
from comparisons.check.measurement import Baseline
from comparisons.comparison import ComparisonRecord
from comparisons.cost.cost_record import Cost
from comparisons.fit.fit_record import FitRecord
from reference import records
from reference.records import laid_out
from reports.ci.checks import Checks
from reports.files.results import RunRecord

FOLDER = Path(__file__).parent

PUBLISHED: dict[str, Any] = {
    "audit": Audit,
    "baseline": Baseline,
    "check": Checks,
    "comparison": ComparisonRecord,
    "cost": Cost,
    "fit": FitRecord,
    "run": RunRecord,
}
"""The type of each record that is written to a file, by the name of its schema."""


def text(name: str) -> str:
    """Return the content of a schema's file."""
    return laid_out(records.schema(PUBLISHED[name])) + "\n"


if __name__ == "__main__":
    if sys.argv[1:]:
        sys.exit(__doc__)
    for name in PUBLISHED:
        (FOLDER / f"{name}.schema.json").write_text(text(name), encoding="utf-8")
