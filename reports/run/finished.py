"""Finished scenes, found again in their files instead of rendered once more.

``view.json``, in the folder of a scene's results, holds what the page shows of the scene and the
key of all that it depends on. It is written with the other results, atomically.
"""

from base64 import b64decode, b64encode
from dataclasses import asdict

from markupsafe import Markup

from comparisons.store import Entry
from reports.charts.vega import Figure
from reports.page.embedding import Embedded, Plane

FILE = "view.json"

PICTURES = ("images", "thumbnails")
"""Of a view: PNG bytes by name."""


def key_of(passes, options, with_cost, figures):
    """Return what a result depends on: its passes, where they stop, and what else is written.

    ``passes`` is what `reports.run.kept.key_of` returns.
    """
    return f"{passes} noise={options.noise} cost={with_cost} figures={figures}"


def save(place, key, view):
    """Write the file of a view, which `reports.run.output.write_scene` returns, to a folder."""
    study = view["cost"]
    _entry(place, key).save(
        view
        | {name: _encoded(view[name]) for name in PICTURES}
        | {
            "embedded": asdict(view["embedded"]),
            "charts": [asdict(figure) for figure in view["charts"]],
            "cost": study and study | {"images": _encoded(study["images"])},
        }
    )


def load(place, key):
    """Return the view of the results in a folder; None where they are not those of the key."""
    view = _entry(place, key).load()
    if view is None:
        return None
    try:
        if not all((place.parent / file).is_file() for file in view["files"].values()):
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
                "cost": study and study | {"images": _decoded(study["images"])},
            }
        )
    except (ValueError, KeyError, TypeError, AttributeError):
        return None  # not a view


def _entry(place, key):
    return Entry(place / FILE, key)


def _embedded(given):
    planes = tuple(Plane(**plane) for plane in given["planes"])
    return Embedded(**given | {"planes": planes})


def _encoded(pictures):
    return {name: b64encode(png).decode("ascii") for name, png in pictures.items()}


def _decoded(pictures):
    return {name: b64decode(text, validate=True) for name, text in pictures.items()}
