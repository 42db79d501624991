"""The version of fotismos, and a digest of its sources."""

import hashlib
from functools import lru_cache
from pathlib import Path

__version__ = "0.2.0"

ROOT = Path(__file__).parents[1]
ROOMS = ("heuristic", "reference", "comparisons", "reports")


@lru_cache
def source_digest() -> str:
    """Return a digest of the sources where fotismos runs from a checkout; empty if installed."""
    return digest_of(ROOT) if (ROOT / "pyproject.toml").is_file() else ""


def digest_of(root: Path) -> str:
    """Return a digest of all files in the rooms of a checkout."""
    found = hashlib.sha256()
    for path in sorted(path for room in ROOMS for path in (root / room).rglob("*.*")):
        if "__pycache__" not in path.parts and path.is_file():
            found.update(f"{path.relative_to(root)}\0".encode())
            found.update(hashlib.sha256(path.read_bytes()).digest())
    return found.hexdigest()
