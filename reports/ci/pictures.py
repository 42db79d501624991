"""Baselines of pictures as files, and repeats that match a pattern."""

from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import numpy as np

from fotismos.comparisons.check.measurement import LINEAR_ROUNDING, laid_out
from fotismos.comparisons.check.pictures import (
    SIDE,
    PictureBaseline,
    Repeats,
    SmallestChanges,
    colour,
    means,
)
from fotismos.comparisons.comparison import PictureFiles
from fotismos.comparisons.names import matching
from fotismos.comparisons.picture_files import read_file
from fotismos.heuristic import program
from fotismos.heuristic.errors import InputError
from fotismos.reference import records
from fotismos.reports.ci import baselines

LAYERS = ("mean", "variance")

LONGEST = 2**15
"""Pixels of the longer side of a baseline that is read, at most."""


def read_repeats(
    pattern: str, transfer: str | None, over: str | None = None
) -> tuple[Repeats, PictureFiles]:
    """Read the repeats that match a pattern, ``render_*.exr`` or ``render_*.exr:LAYER``.

    Also return the record of their files.
    """
    names = matching([pattern])
    digests = []
    notes: dict[str, None] = {}

    def images() -> Iterator[np.ndarray]:
        # One at a time: only their sums are kept.
        for name in names:
            file = read_file(name, transfer, over)
            digests.append(file.digest)
            notes.update(dict.fromkeys(file.notes))
            yield file.image

    repeats = Repeats.of(images())
    files = PictureFiles(
        files=names,
        digests=tuple(digests),
        transfer=transfer,
        notes=tuple(notes),
        repeats=len(names),
    )
    return repeats, files


def write(
    path: Path,
    repeats: Repeats,
    transfer: Literal["linear", "srgb"] | None,
    over: str | None = None,
) -> None:
    """Write a baseline, and its EXR with the mean and variance of each pixel."""
    if repeats.count < 2:
        raise InputError(f"{path}: one picture does not show its noise. Give two repeats or more.")
    # Compared with itself: the difference of two such means has an error √2 times that of one.
    whole, _ = means(repeats, repeats)
    height, width = repeats.mean.shape[:2]
    baseline = PictureBaseline(
        repeats=repeats.count,
        resolution=(width, height),
        transfer=transfer,
        over=over,
        mean=colour(whole.before[0, 0]),
        error=colour(whole.error[0, 0] / np.sqrt(2.0)),
        correlation=float(repeats.correlation),
        images=path.with_suffix(".exr").name,
    )
    layers = {f"baseline.{name}": getattr(repeats, name) for name in LAYERS}
    baselines.put(path, laid_out(records.plain(baseline)) + "\n", layers, path.stem)


def record_of(path: Path) -> PictureBaseline:
    """Read the record of a baseline."""
    return records.read(PictureBaseline, baselines.read_text(path, of_pictures=True), str(path))


def read(path: Path) -> tuple[PictureBaseline, Repeats]:
    """Read a baseline, and the statistics of its repeats from the EXR beside it."""
    baseline = record_of(path)
    # Only the name counts: a baseline must not lead to files elsewhere.
    images = path.parent / Path(baseline.images).name
    how = program.command("check", path, "--update", "--picture", f"{path.stem}=PATTERN")
    found = baselines.read_layers(images, LAYERS, longest=LONGEST, how=how)
    repeats = Repeats(baseline.repeats, **found, correlation=np.array(baseline.correlation))
    # The two files may come from different runs, or one was edited.
    is_same = np.allclose(repeats.mean.mean(axis=(0, 1)), baseline.mean, rtol=1e-5, atol=1e-9)
    if not (is_same and (repeats.variance >= 0).all() and baseline.correlation < np.inf):
        raise InputError(f"{images}: this is not of {path.name}. Write both again: `{how}`.")
    return baseline, repeats


def sentence(changes: SmallestChanges, before: Repeats) -> str:
    """Return the sentence on what could not be seen, relative to the mean of the picture."""
    whole = max(before.mean.mean(), LINEAR_ROUNDING)
    picture = f"{100 * max(changes.mean) / whole:.2g} %"
    block = f"{100 * max(changes.block) / whole:.2g} %"
    noisiest = f"{100 * max(changes.noisiest) / whole:.2g} %"
    equal = " The repeats are equal: if their renderer is random, give each its own seed."
    return (
        f"caught in {100 * changes.power:g} % of cases: a change of the mean by {picture}, of a"
        f" block of {SIDE} x {SIDE} pixels by {block} of it, of the noisiest block by {noisiest};"
        f" smaller ones may be missed.{'' if before.variance.any() else equal}"
    )
