"""What the page of one command begins with: its name, version and date, and links to others."""

from datetime import date
from pathlib import Path
from typing import Any

from fotismos.heuristic.program import __version__
from fotismos.reports.files.results import PAGE
from fotismos.reports.page.page import identifier

KINDS = ("cost", "fit")
"""Commands whose pages of one scene link each other."""


def head(command: str, folder: Path | None, scene: str = "") -> dict[str, Any]:
    """Return the head of a page in ``OUTPUT/command/NAME``, with links to what exists.

    They lead to the comparisons in OUTPUT, to that of the same ``scene``, and to its other pages.
    Without a folder there are no links.
    """
    links = {}
    home = ""
    if folder is not None:
        output = folder.absolute().parent.parent
        home = f"../../{PAGE}" if (output / PAGE).exists() else ""
        if scene and home and (output / folder.name / "comparison.json").exists():
            links["Comparison"] = f"{home}#scene={identifier(scene, set())}"
        for kind in KINDS:
            if scene and kind != command and (output / kind / folder.name / PAGE).exists():
                links[kind.capitalize()] = f"../../{kind}/{folder.name}/{PAGE}"
    return {
        "command": command,
        "home": home,
        "links": links,
        "version": __version__,
        "date": date.today().isoformat(),
    }
