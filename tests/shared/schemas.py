"""The published schemas."""

import json
from pathlib import Path

import fotismos.reports

FOLDER = Path(fotismos.reports.__file__).parent / "schemas"


def schema(name):
    """Return a published schema, such as that of ``comparison.json``."""
    return json.loads((FOLDER / f"{name}.schema.json").read_text(encoding="utf-8"))
