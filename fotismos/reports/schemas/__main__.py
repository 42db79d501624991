"""Write the published schemas: ``python -m fotismos.reports.schemas``."""

import inspect
import re
import sys
from pathlib import Path
from typing import Any

import msgspec

from fotismos.comparisons.audit.checks import Audit
from fotismos.comparisons.records.check import Baseline, Checks
from fotismos.comparisons.records.comparison import ComparisonRecord
from fotismos.comparisons.records.cost import Cost
from fotismos.comparisons.records.engine import EngineCost
from fotismos.comparisons.records.fit import FitRecord
from fotismos.reference.records import laid_out
from fotismos.reports.files.results import RunRecord

FOLDER = Path(__file__).parent

PUBLISHED: dict[str, Any] = {
    "audit": Audit,
    "baseline": Baseline,
    "check": Checks,
    "comparison": ComparisonRecord,
    "cost": Cost,
    "engine": EngineCost,
    "fit": FitRecord,
    "run": RunRecord,
}
"""The type of each record that is written to a file, by the name of its schema."""


def text(name: str) -> str:
    """Return the content of a schema's file."""
    return laid_out(schema(PUBLISHED[name])) + "\n"


def schema(kind: type) -> dict[str, Any]:
    """Return the JSON Schema of a type of record."""
    content = msgspec.json.schema(kind)
    for definition in content["$defs"].values():
        _describe(definition)
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **content}


def _describe(definition: dict[str, Any]) -> None:
    # A role of Sphinx, such as :class:`Name`, becomes the name alone.
    docstring = inspect.cleandoc(
        re.sub(r":\w+:`([^`]*)`", r"\1", definition.get("description", ""))
    )
    text, _, attributes = docstring.partition("\n\nAttributes\n----------\n")
    if text:
        definition["description"] = " ".join(text.split())
    for names, meaning in re.findall(r"^(\S.*)\n((?:    .*\n?)+)", attributes, re.MULTILINE):
        for name in names.split(", "):
            definition["properties"][name].setdefault("description", " ".join(meaning.split()))


if __name__ == "__main__":
    if sys.argv[1:]:
        sys.exit(__doc__)
    for name in PUBLISHED:
        (FOLDER / f"{name}.schema.json").write_text(text(name), encoding="utf-8")
