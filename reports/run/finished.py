"""Finished scenes, found again in their files instead of rendered once more.

``view.json``, in the folder of a scene's results, holds what the page shows of the scene and the
key of all that it depends on. It is written with the other results, whole or not at all.
"""

import json
from base64 import b64decode, b64encode
from dataclasses import asdict
from pathlib import Path

from markupsafe import Markup
from msgspec import ValidationError, convert

from comparisons.records import plain
from reports.charts.vega import Figure
from reports.page.embedding import Embedded, Plane
from reports.run.cost_files import CostView

FILE = "view.json"

PICTURES = ("images", "thumbnails")
"""Of a view: PNG bytes by name."""


def key_of(passes, options, with_cost, figures):
    """Return what a result depends on: its passes, where they stop, and what else is written.

    ``passes`` is what `reports.run.kept.key_of` returns.
    """
    return f"{passes} noise={options.noise} cost={with_cost} figures={figures}"


def text(view, key):
    """Return the content of the file for a view, as `reports.run.output.write_scene` returns it."""
    study = view["cost"]
    return json.dumps(
        view
        | {name: _encoded(view[name]) for name in PICTURES}
        | {
            "key": key,
            "embedded": asdict(view["embedded"]),
            "charts": [asdict(figure) for figure in view["charts"]],
            "cost": study and plain(study),
        }
    )


def load(place, key):
    """Return the view of the results in a folder; None where they are not those of the key."""
    try:
        view = json.loads((place / FILE).read_text(encoding="utf-8"))
        linked = [place.parent / file for file in view["files"].values()]
        if view.pop("key") != key or not all(map(Path.is_file, linked)):
            return None
        study = view["cost"]
        return (
            view
            | {name: _decoded(view[name]) for name in PICTURES}
            | {
                "embedded": _embedded(view["embedded"]),
                "charts": [
                    Figure(**figure | {"svg": Markup(figure["svg"])}) for figure in view["charts"]
                ],
                "cost": study and convert(study, CostView),
            }
        )
    except (OSError, ValueError, KeyError, TypeError, AttributeError, ValidationError):
        return None  # nothing there, or nothing of ours


def _embedded(given):
    planes = tuple(Plane(**plane) for plane in given["planes"])
    return Embedded(**given | {"planes": planes})


def _encoded(pictures):
    return {name: b64encode(png).decode("ascii") for name, png in pictures.items()}


def _decoded(pictures):
    return {name: b64decode(text, validate=True) for name, text in pictures.items()}
