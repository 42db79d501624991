"""Writing the results of a run atomically, and never replacing anything but earlier results."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msgspec import structs

from comparisons import atomic
from comparisons.comparison import ComparisonRecord
from comparisons.departure.metrics import drawn
from comparisons.record import Comparison, Images
from comparisons.records import to_json
from heuristic.errors import OutputError
from reports.files import exr, holding, images, ownership, sheets
from reports.page import embedding, page, terms_view
from reports.page.lit import lit
from reports.page.scene_view import SceneView
from reports.run import finished
from reports.run.places import FIGURES, PAGE, RUN, TABLES
from reports.run.stages import RunRecord

if TYPE_CHECKING:
    from comparisons.cost.cost import Study


@contextmanager
def held(folder: str | Path, command: str) -> Iterator[Path]:
    """Make the output folder, keep other commands out of it, and clear away what killed ones left.

    ``command`` names this one to other commands.

    Raises
    ------
    OutputError
        If it cannot be written to, or another command is writing there.
    """
    folder = Path(folder)
    with atomic.explained(folder):
        folder.mkdir(parents=True, exist_ok=True)
    with holding.held(folder, command):
        with atomic.explained(folder):
            ownership.recover(folder)
        try:
            yield folder
        finally:
            with suppress(OSError):
                ownership.leave_empty(folder)


def below(folder: Path, command: str) -> Path:
    """Return the folder for the results of one command in a held folder.

    Raises
    ------
    OutputError
        If it cannot be made.
    """
    return ownership.folder(folder / command)


def require_free(folder: Path, places: Iterable[str], with_figures: bool = False) -> None:
    """Ensure, before anything is rendered, that a run will replace only earlier results.

    Raises
    ------
    InputError
        Naming what fotismos did not make.
    """
    for name in (PAGE, RUN):
        ownership.require_free(folder / name)
    require_free_folders(folder, *places, TABLES, *([FIGURES] if with_figures else ()))


def require_free_folders(folder: Path, *names: str) -> None:
    """Ensure that a command will replace only earlier results in the named folders.

    Raises
    ------
    InputError
        Naming what fotismos did not make.
    """
    for name in names:
        ownership.require_free_folder(folder / name)


def as_far_as_possible(*steps: Callable[[], object]) -> None:
    """Take every step, even if others cannot write.

    Raises
    ------
    OutputError
        The first one, at the end.
    """
    errors = []
    for step in steps:
        try:
            step()
        except OutputError as error:
            errors.append(error)
    if errors:
        raise errors[0]


def write_scene(
    folder: Path,
    name: str,
    comparison: Comparison,
    study: Study | None = None,
    key: str | None = None,
) -> SceneView:
    """Write the files of one comparison to ``folder/name``, in place of an earlier result.

    The files of a study of cost are written with them. With a key,
    :func:`reports.run.finished.load` finds the result again.

    Returns
    -------
    SceneView
        The scene's part of the page.
    """
    record, shown = comparison.record, comparison.images
    if study:
        from reports.run import cost_files
    layers = _layers(shown)
    pictured = images.pictures(shown, record.viewing.exposure)
    priced = cost_files.documents(study) if study else {}
    links = ("comparison.json", "comparison.exr", *(("cost.json",) if study else ()))
    view = structs.replace(
        view_of(comparison, layers),
        files={file: f"{name}/{file}" for file in links},
        charts=tuple(cost_files.figures(study.record)) if study else (),
        cost=cost_files.view(study, priced) if study else None,
        terms=terms_view.view(
            comparison.terms,
            comparison.no_terms,
            terms_view.picked(comparison.terms, record.regions, shown.reference),
        ),
        lit=lit(shown, record.viewing.exposure),
    )
    with ownership.replacing_folder(folder / name) as place:
        for png_name, png in pictured.items():
            (place / f"{png_name}.png").write_bytes(png)
        exr.write(place / "comparison.exr", layers, _header(record))
        (place / "comparison.json").write_bytes(atomic.encoded(to_json(record)))
        for file, content in priced.items():
            (place / file).write_bytes(content)
        if key is not None:
            finished.save(place, key, view)
    return view


def view_of(comparison: Comparison, layers: Mapping[str, Any] | None = None) -> SceneView:
    """Return a comparison's part of the page without links; ``layers`` are its images."""
    shown = comparison.images
    return SceneView(
        record=comparison.record,
        thumbnails={
            name: sheets.webp_of(png)
            for name, png in images.thumbnails(shown, comparison.record.viewing.exposure).items()
        },
        embedded=embedding.embed(exr.channels(layers or _layers(shown)), shown.counted),
    )


def write_page(folder: Path, views: Sequence[SceneView], **shown: Any) -> None:
    """Write ``index.html``; ``shown`` are arguments of :func:`reports.page.page.render`."""
    ownership.write(folder / PAGE, page.render(views, **shown))


def write_run(folder: Path, record: RunRecord) -> None:
    """Write ``run.json``: the command, where its time went, machine and versions."""
    ownership.write(folder / RUN, to_json(record))


def _layers(shown: Images) -> dict[str, Any]:
    return {
        "heuristic": shown.heuristic,
        "reference": shown.reference,
        "reference_stderr": shown.reference_stderr,
        "P": shown.position,
        "N": shown.normal,
        **{name: shown.maps[name] for name in drawn()},
        "significant": shown.significant,
    }


def _header(record: ComparisonRecord) -> dict[str, str]:
    header: dict[str, object] = {
        "scene": record.scene,
        "variant": record.variant,
        "seed": record.seed,
        "spp": record.plan.spp,
        "passes": record.plan.passes,
        "pairing": record.pairing.convention,
    }
    header |= {f"version {name}": version for name, version in record.versions.items()}
    return {key: str(value) for key, value in header.items()}
