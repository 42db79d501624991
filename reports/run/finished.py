"""Finished scenes, found again in their files instead of rendered once more.

``view.json``, in the folder of a scene's results, holds what the page shows of the scene and the
key of all that it depends on. It is written with the other results, atomically.
"""

from pathlib import Path

import msgspec

from comparisons.departure.metrics import METRICS
from comparisons.records import VERSION, Record, plain
from heuristic.errors import InputError
from reports.page.scene_view import SceneView

FILE = "view.json"


class Finished(Record):
    """A view, and the key of all that it depends on."""

    key: str
    view: SceneView


def key_of(passes, options, with_cost, figures):
    """Return what a result depends on: its passes, where they stop, and what else is written.

    ``passes`` is what `reports.run.kept.key_of` returns.
    """
    written = f"version={VERSION} metrics={','.join(METRICS)} cost={with_cost} figures={figures}"
    return f"{passes} noise={options.noise} {written}"


def text(view, key):
    """Return the content of the file for a view."""
    return msgspec.json.encode(plain(Finished(key=key, view=view))).decode()


def load(place, key):
    """Return the view of the results in a folder; None where they are not those of the key."""
    try:
        found = msgspec.json.decode((place / FILE).read_bytes(), type=Finished)
    except (OSError, msgspec.MsgspecError, InputError):
        return None  # nothing there, or nothing of ours
    linked = [place.parent / file for file in found.view.files.values()]
    return found.view if found.key == key and all(map(Path.is_file, linked)) else None
