"""The files of one comparison: its record, images, and its part of the page."""

import hashlib
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
from msgspec import structs

from fotismos.comparisons import atomic
from fotismos.comparisons.departure.metrics import LEADING, METRICS, RATIO, drawn
from fotismos.comparisons.departure.regions import worst_pixel
from fotismos.comparisons.records.comparison import ComparisonRecord
from fotismos.comparisons.records.images import Comparison, Images
from fotismos.reference.records import Missing, plain, to_json
from fotismos.reports.files import images, results
from fotismos.reports.page import embedding
from fotismos.reports.page.scene_view import PointsView, SceneView

if TYPE_CHECKING:  # few scenes have one
    from fotismos.comparisons.ladder.engine import Study
    from fotismos.comparisons.records.cost import Cost

RECORD = "comparison.json"
PICTURE = "comparison.exr"
VIEW = "view.json"


IMAGES = ("heuristic", "reference", "significant", RATIO.name, *METRICS)
MADE = ("comparison.*", VIEW, "cost.*", "cost-*.png", *(f"{name}.png" for name in IMAGES))
"""Names of the files that a scene's folder may have beside its mark; others are the user's."""


def load(folder: Path, key: str | None) -> SceneView | None:
    """Return the view of a finished scene; None if its key is another or its record was changed.

    It is the record, with what ``view.json`` keeps beside it: what no record can say.
    """
    if key is None:
        return None
    try:
        text = (folder / RECORD).read_bytes()
        kept = atomic.Entry(folder / VIEW, _key(key, text)).load()
        if kept is None:
            return None
        content = kept | {"record": json.loads(text)}
        # JSON has no bytes: pictures are text in it.
        view = msgspec.convert(content, SceneView, builtin_types=())
        if not all((folder.parent / path).is_file() for path in view.files.values()):
            return None
        if view.cost:
            from fotismos.comparisons.records.cost import Cost  # loaded late: few scenes have costs

            record = msgspec.convert(view.cost.record, Cost, builtin_types=())
            view = structs.replace(view, cost=structs.replace(view.cost, record=record))
        return view
    except (msgspec.ValidationError, OSError, ValueError):
        return None


def _key(key: str | None, record: bytes) -> str:
    """Return the key of what is kept beside a record."""
    return f"{key or 'none'} {hashlib.sha256(record).hexdigest()}"


# --- Files -----------------------------------------------------------------------------------


def write(
    folder: Path,
    name: str,
    comparison: Comparison,
    costs: "Study[Cost] | None" = None,
    key: str | None = None,
    first: SceneView | None = None,
    with_figures: bool = False,
) -> SceneView:
    """Write the files of one comparison to ``folder/name``, and return its part of the page.

    The record is removed first and written last. Files of an earlier result that this one does not
    have are deleted. With a key, :func:`load` finds the result. ``first`` is the view of the same
    images that a page showed before. Figures for print go to a folder of their own.
    """
    target = folder / name
    record = comparison.record
    if with_figures:  # first, since the record marks the scene as finished
        from fotismos.reports.charts import figures  # loaded late: few runs have any

        figures.write_scene(folder / results.FIGURES, name, comparison)
    results.own(target)
    results.clear(target, (RECORD, VIEW))
    view = view_of(comparison, first)
    made = {
        f"{picture}.png": png
        for picture, png in images.pictures(comparison.images, record.viewing.exposure).items()
    }
    linked: tuple[str, ...] = (RECORD, PICTURE)
    if costs:
        from fotismos.reports.run import cost_files  # loaded late: for a handful of scenes

        made |= cost_files.documents(costs)
        linked = (*linked, "cost.json")
        chart = cost_files.figure(costs.record)
        view = structs.replace(view, chart=chart, cost=cost_files.view(costs))
    view = structs.replace(view, files={file: f"{name}/{file}" for file in linked})
    for file, content in made.items():
        results.write(target / file, content)
    images.write_exr(target / PICTURE, _layers(comparison.images), _header(record))
    results.clear(target, _files(target) - {*made, PICTURE})
    text = atomic.encoded(to_json(record))
    kept = plain(view)
    del kept["record"]
    atomic.Entry(target / VIEW, _key(key, text)).save(kept)
    results.write(target / RECORD, text)
    return view


def remove(folder: Path) -> None:
    """Delete the files of a result; a folder that is empty then goes with the command."""
    results.clear(folder, (RECORD, *_files(folder)))


def view_of(comparison: Comparison, first: SceneView | None = None) -> SceneView:
    """Return a comparison's part of the page without links; the ``first`` one has its images."""
    record = comparison.record
    shown = comparison.images
    if first is not None:
        embedded = first.embedded
    else:
        embedded = embedding.embed(images.channels(_layers(shown)), shown.counted)
    view = SceneView(
        record=record,
        thumbnails=images.thumbnails(shown, record.viewing.exposure),
        embedded=embedded,
        worst=worst_pixel(shown.maps[LEADING.name], shown.counted),
    )
    terms = comparison.terms
    live = comparison.live
    if record.pairing is None:  # two pictures, which have neither
        return view
    if isinstance(terms, Missing) and isinstance(live, Missing) and comparison.causes is None:
        return structs.replace(
            view,
            terms=PointsView(missing=terms.reason),
            live=PointsView(missing=live.reason),
        )
    from fotismos.reports.page import why_view  # loaded late: --no-why has none

    return structs.replace(
        view,
        terms=why_view.terms_view(terms),
        live=why_view.live_view(live),
        why=why_view.causes_view(comparison),
    )


def with_fit(view: SceneView, folder: Path) -> SceneView:
    """Return a view with what the record of a fit in a place says of its scene, if there is one."""
    try:
        fit = json.loads((folder / "fit.json").read_bytes())
        mean = fit["fits"][fit["best"]]["departure"][LEADING.name]["after"]
        found = (mean, *fit["resolution"])
        is_same = fit["scene"] == view.record.scene
    except (OSError, ValueError, LookupError, TypeError):
        return view
    if view.live and is_same:
        live = structs.replace(view.live, data=view.live.data | {"fit": found})
        return structs.replace(view, live=live)
    return view


def _files(folder: Path) -> set[str]:
    """Return the files of a result in a place."""
    return {path.name for pattern in MADE for path in folder.glob(pattern)}


def _layers(shown: Images) -> dict[str, Any]:
    return {
        "heuristic": shown.heuristic,
        "reference": shown.reference,
        "reference_stderr": shown.reference_stderr,
        **({"P": shown.position, "N": shown.normal} if shown.position is not None else {}),
        **{name: shown.maps[name] for name in drawn() if name in shown.maps},
        "significant": shown.significant,
        **shown.terms,
    }


def _header(record: ComparisonRecord) -> dict[str, object]:
    header: dict[str, object] = {"scene": record.scene, "seed": record.seed}
    if record.variant is not None:
        header["variant"] = record.variant
    if record.plan is not None:
        header |= {"spp": record.plan.spp, "passes": record.plan.passes}
    if record.pairing is not None:
        header["pairing"] = record.pairing.convention
    return header | {f"version {name}": version for name, version in record.versions.items()}
