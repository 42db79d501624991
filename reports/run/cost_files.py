"""The files of a study of cost, and what a page shows of it."""

import json
from functools import partial

from comparisons.effects.dominance import dominating
from reports.charts import error_over_time, price_chart, vega
from reports.files import images, ownership
from reports.terminal.cost_tables import noise

DIGITS = "0123456789"
"""Of the map of effects in the page: the place of each effect."""

NO_EFFECT, UNCOUNTED = ".", "-"

FAMILIES = "Squares: the kernel; triangles: the phong BSDF; circles: physical BSDFs"


def documents(study):
    """Return the files of a study by name: chart, pictures of rungs, parts and effects.

    Pictures of rungs are exposed as the record says; parts are signed, red where the later image is
    brighter, over the range that the record's ``pictures`` states; effects are errors removed.
    """
    import vl_convert

    data = study.data
    exposed = partial(images.tonemap, exposure=data["viewing"]["exposure"])
    limit, removed = ranges(study)
    pictures = {picture_name("rung", name): exposed(image) for name, image in study.rungs.items()}
    pictures["cost-reference"] = exposed(study.reference)
    for name, signed in study.parts.items():
        pictures[picture_name("part", name)] = images.signed_map(signed.mean(axis=2), limit)
    for name, values in study.effects.items():
        pictures[picture_name("effect", name)] = images.signed_map(values, removed)
    made = {f"{name}.png": images.png(picture) for name, picture in pictures.items()}
    made["cost.svg"] = vl_convert.vegalite_to_svg(error_over_time.error_over_time(data)).encode()
    made["cost.json"] = text(data | {"pictures": {"part_limit": limit, "effect_limit": removed}})
    return made


def write(place, study):
    """Write the files of a study to a folder, each atomically; what else is there stays.

    The record comes last: where it is, its pictures are its own.
    """
    ownership.folder(place)
    for name, content in documents(study).items():
        ownership.write(place / name, content)


def text(data):
    """Return the record as the bytes of its file."""
    return (json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False) + "\n").encode()


def ranges(study):
    """Return the largest linear value of any part, and the largest ΔE2000 of any effect.

    They are the half ranges of the signed pictures; 1e-3 and 1 at least, so that rounding does not
    fill a picture.
    """
    parts = [abs(signed.mean(axis=2)).max() for signed in study.parts.values()]
    removed = [abs(values).max() for values in study.effects.values()]
    return float(max(1e-3, *parts)), float(max(1.0, *removed, 0.0))


def figures(data):
    """Return the charts of ``cost.json``: error against time, and the prices of effects."""
    made = [
        vega.figure(
            "Error against time",
            error_over_time.plot(data),
            "; ".join([FAMILIES, *error_over_time.reading(data)]) + ".",
        )
    ]
    if data["prices"]["effects"]:
        note = "Circle: what it removes where it is added first; stroke: last."
        made.append(vega.figure("Price of an effect", price_chart.price_chart(data), note))
    return made


def view(study, made):
    """Return what a page shows of a study: its record, pictures and the map of effects.

    ``made`` are its :func:`documents`.
    """
    data = json.loads(made["cost.json"])
    return {
        "record": data,
        "images": {
            name.removesuffix(".png"): content
            for name, content in made.items()
            if name.endswith(".png")
        },
        "rungs": _rungs(data),
        "parts": [
            part | {"picture": picture_name("part", part["name"])}
            for part in data["split"]["parts"]
        ],
        "prices": [
            price | {"picture": picture_name("effect", price["effect"])}
            for price in data["prices"]["effects"]
        ],
        "noise": noise(data) if data["prices"]["effects"] else "",
        "effects": _effect_map(study),
    }


def _rungs(data):
    """Return the rungs, each with its points, its picture, and when it reaches which error."""
    return [
        rung
        | {
            "picture": picture_name("rung", rung["name"]),
            "points": [point for point in data["points"] if point["rung"] == rung["name"]],
            "reached": [row for row in data["equal_error"] if row["method"] == rung["name"]],
        }
        for rung in data["rungs"]
    ]


def _effect_map(study):
    """Return the dominating effect of each pixel as text, a letter a pixel, row after row."""
    places = dominating(study.effects, study.counted)
    letters = {-1: NO_EFFECT, -2: UNCOUNTED} | dict(enumerate(DIGITS))
    return {
        "width": places.shape[1],
        "height": places.shape[0],
        "names": list(study.effects),
        "colours": [price_chart.COLOURS[name] for name in study.effects],
        "map": "".join(letters[int(place)] for place in places.ravel()),
    }


def picture_name(kind, name):
    """Return the name of a picture's file, without its ending, such as cost-part-transport."""
    return f"cost-{kind}-{_plain(name)}"


def _plain(name):
    return "".join(c if c.isalnum() else "-" for c in name.lower()).replace("--", "-")
