"""What a command wrote, to compare two runs."""

import json

import numpy as np
import OpenEXR
import pyarrow.parquet

TIMES = {"command", "equal_error", "machine", "pareto", "stages", "time"}
"""Keys under which records have times and what follows from them, and where a command wrote."""


def results(out):
    """Return all that a command wrote, but for times and what shows them."""
    found = {}
    for path in sorted(out.rglob("*")):
        place = path.relative_to(out).as_posix()
        if path.is_dir() or path.name in (".fotismos-lock", "run.json", "index.html", "view.json"):
            continue
        if path.suffix == ".json":
            found[place] = _without_times(json.loads(path.read_text(encoding="utf-8")))
        elif path.suffix == ".parquet":
            found[place] = _without_times(pyarrow.parquet.read_table(path).to_pylist())
        elif path.suffix in (".exr", ".png"):
            found[place] = path.read_bytes()
        else:
            found[place] = "is there"
    return found


def _is_time(name):
    return name in TIMES or name.endswith(("_s", "seconds"))


def _without_times(value):
    if isinstance(value, dict) and "heuristic_s" in value:  # a price: other ratios are results
        value = {k: v for k, v in value.items() if k not in ("ratio", "reason")}
    if isinstance(value, dict):
        return {k: _without_times(v) for k, v in value.items() if not _is_time(k)}
    if isinstance(value, list):
        return [_without_times(one) for one in value]
    return value


def write(path, image, header=None, alpha=None):
    """Write an EXR as any program does: R, G and B without a layer."""
    channels = {c: np.ascontiguousarray(image[..., i], np.float32) for i, c in enumerate("RGB")}
    if alpha is not None:
        channels["A"] = np.ascontiguousarray(alpha, np.float32)
    attributes = {"type": OpenEXR.scanlineimage} | (header or {})
    with OpenEXR.File(attributes, channels) as file:
        file.write(str(path))
    return str(path)
