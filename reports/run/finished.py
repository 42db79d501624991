"""Finished scenes, loaded from their files instead of rendered again.

``view.json``, in the folder of a scene's results, holds the scene's part of the page, the sizes of
the linked files, and the key of all that it depends on. It is written atomically with the other
results.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from comparisons.departure.metrics import METRICS
from comparisons.records import VERSION, Record, plain
from comparisons.store import Entry
from heuristic.errors import InputError
from reports.page.scene_view import SceneView

if TYPE_CHECKING:
    from comparisons.options import Options

FILE = "view.json"


def key_of(passes: str, options: Options, with_cost: bool, figures: bool) -> str:
    """Return what a result depends on: its passes, where they stop, and the other files.

    ``passes`` is the key of :func:`reports.run.kept.key_of`.
    """
    written = f"version={VERSION} metrics={','.join(METRICS)} cost={with_cost} figures={figures}"
    return f"{passes} noise={options.noise} {written}"


class Kept(Record):
    """The content of the file: the view, and the size in bytes of each linked file."""

    view: SceneView
    sizes: dict[str, int]


def save(place: Path, key: str, view: SceneView) -> None:
    """Write the view of :func:`reports.run.output.write_scene` to a folder."""
    kept = Kept(view=view, sizes=_sizes(place, view))
    Entry(place / FILE, key).save(plain(kept))


def load(place: Path, key: str) -> SceneView | None:
    """Return the view of the results in a folder; None if their key is another."""
    try:
        # JSON has no bytes: pictures are text in it.
        kept = msgspec.convert(Entry(place / FILE, key).load(), Kept, builtin_types=())
        return kept.view if kept.sizes == _sizes(place, kept.view) else None
    except (msgspec.ValidationError, InputError, OSError):
        return None  # no file, not a view of this version, or a linked file is gone


def _sizes(place: Path, view: SceneView) -> dict[str, int]:
    """Return the sizes of the linked files, which are in the view's folder."""
    names = [Path(file).name for file in view.files.values()]
    return {name: (place / name).stat().st_size for name in names}
