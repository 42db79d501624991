"""Writing the results of a run atomically, and never at the cost of an earlier result."""

import os
from pathlib import Path

from comparisons.departure.metrics import drawn
from comparisons.records import to_json
from heuristic.errors import InputError
from reports.files import exr, images, ownership
from reports.page import embedding, page
from reports.page.scene_view import SceneView
from reports.run import finished

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
    SceneView
        What the page needs of it.
    """
    record, shown = comparison.record, comparison.images
    if study:
        from reports.run import cost_files
    exposure = record.viewing.exposure
    layers = _layers(shown)
    pictured = images.pictures(shown, exposure)
    reduced = max(record.resolution) > LONGEST_IN_PAGE
    priced = cost_files.documents(study) if study else {}
    links = ("comparison.json", "comparison.exr", *(("cost.json",) if study else ()))
    view = SceneView(
        record=record,
        images=images.pictures(shown, exposure, LONGEST_IN_PAGE) if reduced else pictured,
        thumbnails=images.thumbnails(shown, exposure),
        embedded=embedding.embed(exr.channels(layers), shown.counted),
        files={file: f"{name}/{file}" for file in links},
        charts=tuple(cost_files.figures(study.record)) if study else (),
        cost=cost_files.view(study, priced) if study else None,
    )
    with ownership.replacing_folder(folder / name, keep=None if study else COST_FILES) as place:
        for png_name, png in pictured.items():
            (place / f"{png_name}.png").write_bytes(png)
        exr.write(place / "comparison.exr", layers, _header(record))
        (place / "comparison.json").write_text(to_json(record), encoding="utf-8")
        for file, content in priced.items():
            (place / file).write_bytes(content)
        if key is not None:
            finished.save(place, key, view)
    return view


def write_page(folder, views, **shown):
    """Write ``index.html`` for the scenes of a run, and what else `page.render` shows."""
    ownership.write(folder / "index.html", page.render(views, **shown))


def write_run(folder, record):
    """Write ``run.json``: the command, where its time went, machine and versions."""
    ownership.write(folder / "run.json", to_json(record))


def folder_name(name, taken):
    """Return a name for a scene's folder: plain characters, and not taken yet."""
    plain = "".join(c if c.isalnum() or c in "-_." else "-" for c in name).strip(".") or "scene"
    chosen, number = plain, 1
    while chosen in taken or chosen in (TABLES, FIGURES):
        number += 1
        chosen = f"{plain}-{number}"
    return chosen


def _layers(shown):
    return {
        "heuristic": shown.heuristic,
        "reference": shown.reference,
        "reference_stderr": shown.reference_stderr,
        "P": shown.position,
        "N": shown.normal,
        **{name: shown.maps[name] for name in drawn()},
        "significant": shown.significant,
    }


def _header(record):
    header = {
        "scene": record.scene,
        "variant": record.variant,
        "seed": record.seed,
        "spp": record.plan.spp,
        "passes": record.plan.passes,
        "pairing": record.pairing.convention,
    }
    header |= {f"version {name}": version for name, version in record.versions.items()}
    return {key: str(value) for key, value in header.items()}
