"""Finished scenes, found again in their files instead of rendered once more.

``view.json``, in the folder of a scene's results, holds what the page shows of the scene and the
key of all that it depends on. It is written with the other results, atomically.
"""

from pathlib import Path

import msgspec

from comparisons.departure.metrics import METRICS
from comparisons.records import VERSION, plain
from comparisons.store import Entry
from heuristic.errors import InputError
from reports.page.scene_view import SceneView

FILE = "view.json"


def key_of(passes, options, with_cost, figures):
    """Return what a result depends on: its passes, where they stop, and what else is written.

    ``passes`` is what `reports.run.kept.key_of` returns.
    """
    written = f"version={VERSION} metrics={','.join(METRICS)} cost={with_cost} figures={figures}"
    return f"{passes} noise={options.noise} {written}"


def save(place: Path, key: str, view: SceneView) -> None:
    """Write the file of a view, which `output.write_scene` returns, to a folder."""
    Entry(place / FILE, key).save({"view": plain(view)})


def load(place: Path, key: str) -> SceneView | None:
    """Return the view of the results in a folder; None where they are not those of the key."""
    kept = Entry(place / FILE, key).load()
    if kept is None:
        return None
    try:
        # JSON has no bytes: pictures are text in it.
        view = msgspec.convert(kept.get("view"), SceneView, builtin_types=())
    except (msgspec.ValidationError, InputError):
        return None  # not a view of this version
    linked = [place.parent / file for file in view.files.values()]
    return view if all(map(Path.is_file, linked)) else None
