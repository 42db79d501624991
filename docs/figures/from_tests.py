"""What only tests can measure: they run in a process of their own, and answer in JSON."""

import json
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

ROOT = Path(__file__).resolve().parents[2]


def fact(name: str, *words: object) -> Any:
    """Return one of the facts in ``tests/facts.py``."""
    with TemporaryDirectory() as folder:
        file = Path(folder, "fact.json")
        command = [sys.executable, "-P", "-m", "tests.facts", name, file, *words]
        subprocess.run([*map(str, command)], cwd=ROOT, check=True)
        return json.loads(file.read_bytes())
