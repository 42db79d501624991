"""Lines on the versions of libraries, and what those that are not pinned would change."""

import re
import tomllib
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path

LIBRARIES = ("mitsuba", "drjit", "numpy", "scipy", "colour-science", "flip-evaluator", "OpenEXR")

PROJECT = Path(__file__).parents[2] / "pyproject.toml"

CHANGES = {
    "mitsuba": "The documentation's figures, baselines and kept images were made with the pinned"
    " one: images may differ, and `check` may report that they moved.",
    "drjit": "Mitsuba works only with the Dr.Jit that it was built with, and may not even load.",
}
"""What another version than the pinned one changes; whether meshes work, ``doctor`` tries."""


def pinned() -> dict[str, str]:
    """Return the versions that the installed package, or else the checkout, requires exactly."""
    try:
        required = metadata.requires("fotismos") or []
    except metadata.PackageNotFoundError:
        project = tomllib.loads(PROJECT.read_text(encoding="utf-8"))["project"]
        required = project["dependencies"]
    found = (re.fullmatch(r"([\w-]+) *== *([\w.]+)", text) for text in required)
    return {match[1]: match[2] for match in found if match}


def version_lines() -> Iterator[str]:
    """Yield a line per library, and one on what changes if it has another version than pinned."""
    pins = pinned()
    for library in LIBRARIES:
        version = metadata.version(library)
        pin = pins.get(library, version)
        yield f"{library:<15} {version}" + (f"; {pin} is pinned" if version != pin else "")
        if version != pin:
            yield f"{'':<15} {CHANGES[library]}"
