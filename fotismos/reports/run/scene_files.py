"""The files of one comparison: its record, images, and its part of the page."""

import hashlib
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
from msgspec import structs

from fotismos.comparisons import atomic
from fotismos.comparisons.departure.metrics import LEADING, drawn
from fotismos.comparisons.departure.regions import worst_pixel
from fotismos.comparisons.records.comparison import ComparisonRecord
from fotismos.comparisons.records.images import Comparison, Images
from fotismos.reference.records import Missing, Record, plain, to_json
from fotismos.reports.files import images, results
from fotismos.reports.page import embedding
from fotismos.reports.page.scene_view import PointsView, SceneView

if TYPE_CHECKING:  # few scenes have one
    from fotismos.comparisons.ladder.engine import Study
    from fotismos.comparisons.records.cost import Cost

RECORD = "comparison.json"
PICTURE = "comparison.exr"
VIEW = "view.json"


class Finished(Record):
    """The content of ``view.json``: the scene's part of the page, and a digest of each file."""

    view: SceneView
    digests: dict[str, str]


def load(folder: Path, key: str | None) -> SceneView | None:
    """Return the view of a finished scene; None if its key is another or a file was changed."""
    if key is None:
        return None
    try:
        # JSON has no bytes: pictures are text in it.
        found = msgspec.convert(atomic.Entry(folder / VIEW, key).load(), Finished, builtin_types=())
        current = {name: results.digest_of(folder / name) for name in found.digests}
        if current != found.digests:
            return None
        view = found.view
        if view.cost:
            from fotismos.comparisons.records.cost import Cost  # loaded late: few scenes have costs

            record = msgspec.convert(view.cost.record, Cost, builtin_types=())
            view = structs.replace(view, cost=structs.replace(view.cost, record=record))
        return view
    except (msgspec.ValidationError, OSError):
        return None


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
    # The view names the earlier files, and is about to go.
    earlier = _files(target)
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
    made[RECORD] = atomic.encoded(to_json(record))
    digests = {file: hashlib.sha256(content).hexdigest() for file, content in made.items()}
    # The library writes this file, so its bytes are only on the disk.
    digests[PICTURE] = results.digest_of(target / PICTURE)
    results.clear(target, earlier - digests.keys())
    finished = Finished(view=view, digests=digests)
    # Written without a key, too: `_files` finds the names in it, but `load` never finds a result.
    atomic.Entry(target / VIEW, key or "none").save(plain(finished))
    results.write(target / RECORD, made[RECORD])
    return view


def remove(folder: Path) -> None:
    """Delete the files of a result; a folder that is empty then goes with the command."""
    results.clear(folder, (RECORD, VIEW, *_files(folder)))


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
    """Return the files of the result in a place, as far as its view names them."""
    try:
        digests = json.loads((folder / VIEW).read_bytes())["content"]["digests"]
        return {name for name in digests if "/" not in name}
    except (OSError, ValueError, KeyError, TypeError):
        return set()


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
