"""Writing the results of a run atomically, and never at the cost of an earlier result."""

import json
import os
from pathlib import Path

from comparisons.departure.metrics import METRICS
from heuristic.errors import InputError
from reports.files import exr, images, ownership
from reports.page import embedding, page
from reports.run import cost_files, finished

LONGEST_IN_PAGE = 1024
"""Pixels; longer pictures are reduced inside the page, never in the files."""

COST_FILES = "cost*"
"""What `fotismos cost` writes."""
TABLES, FIGURES = "tables", "figures"
"""Folders of a run beside those of its scenes, which take no such name."""


def prepare(folder):
    """Make the output folder, clear away what killed runs left, and ensure it can be written to.

    Raises
    ------
    InputError
        When it cannot.
    """
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        probe = folder / f".fotismos-{os.getpid()}"
        probe.touch()
        probe.unlink()
        ownership.recover(folder)
    except OSError as error:
        raise InputError(
            f"output folder {folder}: {error.strerror or error}. Choose another one with -o."
        ) from error
    return folder


def require_free(folder, places, with_figures=False):
    """Ensure, before anything is rendered, that a run will replace nothing but earlier results.

    Raises
    ------
    InputError
        Naming what is not fotismos's.
    """
    for name in ("index.html", "run.json"):
        ownership.require_free(folder / name)
    for name in (*places, TABLES, *([FIGURES] if with_figures else ())):
        ownership.require_free_folder(folder / name)


def write_scene(folder, name, comparison, study=None, key=None):
    """Write the files of one comparison to ``folder/name``, in place of an earlier result.

    With a study of cost its files are written as well; without one, those of an earlier study stay.
    With a key, `reports.run.finished.load` finds the result again by it.

    Returns
    -------
    dict
        What the page needs of it: record, pictures and links.
    """
    data, shown = comparison.data, comparison.images
    maps = {key: shown.maps[key] for key in (*METRICS, "log2_luminance")}
    exposure = data["viewing"]["exposure"]

    def pictures(longest=None):
        return images.pictures(
            shown.heuristic,
            shown.reference,
            maps,
            shown.significant,
            counted=shown.counted,
            exposure=exposure,
            longest=longest,
        )

    layers = _layers(shown)
    pictured = pictures()
    priced = cost_files.documents(study) if study else {}
    largest = max(data["resolution"])
    links = ("comparison.json", "comparison.exr", *(("cost.json",) if study else ()))
    view = {
        "record": data,
        "images": pictured if largest <= LONGEST_IN_PAGE else pictures(LONGEST_IN_PAGE),
        "thumbnails": images.thumbnails(
            shown.heuristic, shown.reference, shown.maps["dE2000"], exposure
        ),
        "embedded": embedding.embed(exr.channels(layers), shown.counted),
        "files": {file: f"{name}/{file}" for file in links},
        "charts": cost_files.figures(study.record) if study else (),
        "cost": cost_files.view(study, priced) if study else None,
    }
    with ownership.replacing_folder(folder / name, keep=None if study else COST_FILES) as place:
        for png_name, png in pictured.items():
            (place / f"{png_name}.png").write_bytes(png)
        exr.write(place / "comparison.exr", layers, _header(data))
        (place / "comparison.json").write_text(_json(data), encoding="utf-8")
        for file, content in priced.items():
            (place / file).write_bytes(content)
        if key is not None:
            (place / finished.FILE).write_text(finished.text(view, key), encoding="utf-8")
    return view


def write_page(folder, views, **shown):
    """Write ``index.html`` for the scenes of a run, and what else `page.render` shows."""
    ownership.write(folder / "index.html", page.render(views, **shown))


def write_run(folder, data):
    """Write ``run.json``: the command, where its time went, machine and versions."""
    ownership.write(folder / "run.json", _json(data))


def folder_name(name, taken):
    """Return a name for a scene's folder: plain characters, and not taken yet."""
    plain = "".join(c if c.isalnum() or c in "-_." else "-" for c in name).strip(".") or "scene"
    chosen, number = plain, 1
    while chosen in taken or chosen in (TABLES, FIGURES):
        number += 1
        chosen = f"{plain}-{number}"
    return chosen


def _json(data):
    return json.dumps(data, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _layers(shown):
    return {
        "heuristic": shown.heuristic,
        "reference": shown.reference,
        "reference_stderr": shown.reference_stderr,
        "P": shown.position,
        "N": shown.normal,
        **{name: shown.maps[name] for name in METRICS},
        "significant": shown.significant,
    }


def _header(data):
    header = {
        "scene": data["scene"],
        "variant": data["variant"],
        "seed": data["seed"],
        "spp": data["plan"]["spp"],
        "passes": data["plan"]["passes"],
        "pairing": data["pairing"]["convention"],
    }
    header |= {f"version {name}": version for name, version in data["versions"].items()}
    return {key: str(value) for key, value in header.items()}
