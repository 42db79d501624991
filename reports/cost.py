"""The tables of ``fotismos cost`` on a terminal, and the files of a study."""

import json
import os
from functools import partial

from reports import charts, images
from reports.tables import printed, ruled


def lines(data):
    """Yield the lines of a study: rungs, equal time, equal error, prices, and parts."""
    reference = data["reference"]
    yield (
        f"{data['scene']}, {data['resolution'][0]}x{data['resolution'][1]}, {data['rounds']} rounds"
        f" on {data['machine']['cores']} cores of {data['machine']['processor']}"
    )
    yield (
        f"reference: {reference['integrator']}, {reference['spp']} samples a pixel; its noise alone"
        f" gives ΔE2000 = {reference['noise_floor']:.3g}"
    )
    yield from _section("Error and time of each method", _rungs(data))
    yield from _section("Best within a time", _equal_time(data))
    yield from _section("Time to reach an error (mean ΔE2000)", _equal_error(data))
    if data["prices"]["effects"]:
        yield from _section("Price of an effect", _prices(data))
        yield "removed: Shapley value, the mean over all orders of adding the effects; the sum is"
        yield (
            f"the departure, ΔE2000 = {data['prices']['departure']:.4g}. Noise is"
            f" {data['prices']['floor']:.2g} of that. alone, last: added first, added last."
        )
    yield from _section("Parts of the departure, linear", _parts(data))


def files(study):
    """Return the files of a study by name: chart, pictures of rungs, parts and effects.

    Pictures of rungs are exposed as the record says; parts are signed, red where the later image is
    brighter, over the range that the record's ``pictures`` states; effects are errors removed.
    """
    import vl_convert

    data = study.data
    exposed = partial(images.tonemap, exposure=data["viewing"]["exposure"])
    limit, removed = ranges(study)
    pictures = {f"rung-{_plain(name)}": exposed(image) for name, image in study.rungs.items()}
    pictures["reference"] = exposed(study.reference)
    for name, signed in study.parts.items():
        pictures[f"part-{_plain(name)}"] = images.signed_map(signed.mean(axis=2), limit)
    for name, values in study.effects.items():
        pictures[f"effect-{_plain(name)}"] = images.signed_map(values, removed)
    made = {f"{name}.png": images.png(picture) for name, picture in pictures.items()}
    made["cost.svg"] = vl_convert.vegalite_to_svg(charts.error_over_time(data)).encode()
    made["cost.json"] = text(data | {"pictures": {"part_limit": limit, "effect_limit": removed}})
    return made


def write(place, study):
    """Write the files of a study to a folder, each whole or not at all; what else is there stays.

    The record comes last: where it is, its pictures are its own.
    """
    place.mkdir(exist_ok=True)
    for name, content in files(study).items():
        partial_file = place / f".{name}.{os.getpid()}.partial"
        partial_file.write_bytes(content)
        partial_file.replace(place / name)


def text(data):
    """Return the record as the bytes of its file."""
    return (json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False) + "\n").encode()


def ranges(study):
    """Return the largest linear value of any part, and the largest ΔE2000 of any effect.

    They are the half ranges of the signed pictures; 1e-3 and 1 at least, so that rounding does not
    fill a picture.
    """
    parts = [abs(signed.mean(axis=2)).max() for signed in study.parts.values()]
    effects = [abs(values).max() for values in study.effects.values()]
    return float(max(1e-3, *parts)), float(max(1.0, *effects, 0.0))


def _rungs(data):
    table = ruled("method", "samples", "median", "interval", "first run", "mean ΔE2000", "RMSE", "")
    for point in data["points"]:
        seconds = point["seconds"]
        error = f"{point['error']:.3f} ± {point['error_stderr']:.3f}"
        table.add_row(
            _all_names(data, point["rung"]),
            f"{point['spp']}",
            _time(seconds["median"]),
            f"{_time(seconds['low'])} to {_time(seconds['high'])}",
            _time(point["first_s"]),
            error,
            f"{max(point['mse'], 0) ** 0.5:.2g}",
            "front" if point["pareto"] else "",
        )
    return table


def _equal_time(data):
    table = ruled("within", "method", "samples", "mean ΔE2000", "takes")
    for row in data["equal_time"]:
        best = row["best"]
        if best is None:
            table.add_row(_time(row["seconds"]), "none is as fast", "", "", "")
        else:
            table.add_row(
                _time(row["seconds"]),
                best["method"],
                f"{best['spp']}",
                f"{best['error']:.3f}",
                _time(best["seconds"]),
            )
    return table


def _equal_error(data):
    errors = list(dict.fromkeys(row["error"] for row in data["equal_error"]))
    table = ruled("method", *(f"{error:g}" for error in errors))
    for method in dict.fromkeys(row["method"] for row in data["equal_error"]):
        cells = [
            "not reached"
            if row["seconds"] is None
            else f"{'at most ' if row['at_most'] else ''}{_time(row['seconds'])}"
            for row in data["equal_error"]
            if row["method"] == method
        ]
        table.add_row(method, *cells)
    return table


def _prices(data):
    table = ruled("effect", "removed", "95 % interval", "alone", "last", "adds", "95 % interval")
    for price in data["prices"]["effects"]:
        removes, adds = price["removes"], price["adds_s"]
        table.add_row(
            price["effect"],
            f"{removes['value']:.3f}",
            f"{removes['low']:.3f} to {removes['high']:.3f}",
            f"{price['alone']:.3f}",
            f"{price['last']:.3f}",
            _time(adds["value"]),
            f"{_time(adds['low'])} to {_time(adds['high'])}",
        )
    return table


def _parts(data):
    table = ruled("part", "mean", "standard error", "RMS", "mean ΔE2000")
    for part in (*data["split"]["parts"], data["split"]["departure"]):
        table.add_row(
            part["name"],
            f"{part['mean']:+.3g}",
            f"{part['mean_stderr']:.1g}",
            f"{part['rms']:.3g}",
            f"{part['dE2000']:.3g}",
        )
    return table


def _all_names(data, name):
    """Return a rung's name, with those of the methods that the scene cannot tell from it."""
    (names,) = [rung["names"] for rung in data["rungs"] if rung["name"] == name]
    others = ", ".join(other for other in names if other != name)
    return f"{name} (= {others})" if others else name


def _time(seconds):
    return f"{seconds:.3g} s" if abs(seconds) >= 1 else f"{seconds * 1e3:.3g} ms"


def _plain(name):
    return "".join(c if c.isalnum() else "-" for c in name.lower()).replace("--", "-")


def _section(title, table):
    yield ""
    yield title
    yield from printed(table)
