"""Measure the departure and the regional colours of a scene, each with its uncertainty.

Both halves are rendered in independent passes, as in a comparison. All standard errors come from
the spread of the passes, so they hold for any kind of noise.

A *baseline* is an earlier measurement, as a small text that people can read and diff: JSON in a
fixed order, with a line per number and its error, or per block's colours. Values keep 8 significant
digits, far finer than rounding errors, and errors 3.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np

from fotismos.comparisons.case import Case
from fotismos.comparisons.departure.blocks import shrunk
from fotismos.comparisons.departure.colour import Array
from fotismos.comparisons.departure.metrics import LEADING, METRICS, RATIO, log2_luminance_ratio
from fotismos.comparisons.departure.statistics import noise_floor
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import guarded
from fotismos.comparisons.records.check import HALVES, Baseline, Half, Measurement, MetricAmount
from fotismos.comparisons.records.departure import Viewing
from fotismos.heuristic import program
from fotismos.heuristic.convention import Floats
from fotismos.heuristic.errors import InputError
from fotismos.heuristic.program import versions
from fotismos.reference import records
from fotismos.reference.pairing.settings import film_size
from fotismos.reference.records import VERSION
from fotismos.reference.rendering.passes import Progress, passes
from fotismos.reference.rendering.sums import jackknife_error
from fotismos.reference.scene.source import Source

PASSES = 16
GRID = 4
"""Blocks along each side of the image: few enough to read, small enough to locate a change."""

LONGEST = 64
"""Default number of pixels along the longer side of a measured scene."""

LINEAR_ROUNDING = 1e-6
"""The difference that rounding can make in a colour."""


@dataclass(frozen=True)
class MeasuredScene:
    """A scene just measured: pictures of the halves, samples per pixel and doubts."""

    measurement: Measurement
    pictures: dict[str, Array]
    spp: int
    caution: str = ""


def made_small(case: Case) -> Case:
    """Return a case with its film reduced to `LONGEST`, unless it sets a resolution."""
    if case.options.resolution is not None:
        return case
    sides = film_size(case.source.parse(), case.options.sensor)
    return case.changed(resolution=shrunk(sides, LONGEST))


def measure_scene(
    source: Source, options: Options, count: int = PASSES, progress: Progress | None = None
) -> MeasuredScene:
    """Measure a scene in the current variant, in so many independent passes.

    ``spp`` of the options counts all passes, and is the plan's if omitted.
    """
    options.require_model("a check of a scene")
    ready = guarded(source, options)
    spp = options.spp or ready.spp
    pass_spp = max(1, spp // count)
    halves = ready.heuristic.sampled(pass_spp), ready.reference.sampled(pass_spp)
    loop = passes(halves, options.seed, count, progress=progress)
    images = np.array([[np.array(image) for image in rendered] for rendered in loop], np.float64)
    numbers = measurement(images, ready.counted, options.viewing)
    heuristic, reference = images.mean(axis=0)
    caution = ready.require_light(heuristic, reference)
    pictures = {"heuristic": heuristic, "reference": reference}
    return MeasuredScene(
        measurement=numbers, pictures=pictures, spp=pass_spp * count, caution=caution
    )


def measurement(images: Array, counted: Array, viewing: Viewing) -> Measurement:
    """Measure passes (n, 2, H, W, 3) of the textbook half and the reference.

    Metrics compare the mean images over the pixels of ``counted`` (H, W); their standard errors are
    the jackknife's. Metrics are not linear, and noise raises them: compare only measurements with
    equal numbers of passes and samples.
    """
    metrics = dict.fromkeys(
        (*METRICS, RATIO.name), MetricAmount(value=0.0, error=0.0, noise_floor=0.0)
    )
    if counted.any():
        metrics = _metrics(images, counted, viewing)
    halves = {half: _half(images[:, index]) for index, half in enumerate(HALVES)}
    return Measurement(passes=len(images), metrics=metrics, **halves)


def _metrics(images: Array, counted: Array, viewing: Viewing) -> dict[str, MetricAmount]:
    """Return metrics over the counted pixels, with the jackknife's error over passes."""

    def departure(pair: Array) -> tuple[float, ...]:
        test, reference = pair
        means = [
            metric.mean(metric.against(reference, counted, viewing)(test))
            for metric in METRICS.values()
        ]
        return (*means, log2_luminance_ratio(test[counted], reference[counted]).mean())

    count = len(images)
    total = images.sum(axis=0)
    values = departure(total / count)
    errors = jackknife_error([departure((total - image) / (count - 1)) for image in images])
    # With signs that sum to 0, the light of the passes cancels, and the noise does not.
    signs = np.where(np.arange(count) % 2, -1.0, 1.0)
    signs -= signs.mean()
    signs *= np.sqrt(count / (signs**2).sum())
    noise = np.einsum("i,ijkl->jkl", signs, images[:, 0] - images[:, 1]) / count
    reference = images[:, 1].mean(axis=0)
    floors = {
        name: noise_floor(metric, reference, noise=noise, mask=counted, viewing=viewing)
        for name, metric in METRICS.items()
    }
    return {
        name: MetricAmount(value=float(value), error=float(error), noise_floor=floors.get(name))
        for name, value, error in zip((*METRICS, RATIO.name), values, errors, strict=True)
    }


def _half(images: Array) -> Half:
    """Return the colours of the passes (n, H, W, 3) of one half."""

    def estimate(values: Array) -> tuple[Floats, Floats]:
        return values.mean(axis=0), values.std(axis=0, ddof=1) / np.sqrt(len(values))

    # Means of each pass first: passes are independent, neighbouring pixels are not.
    mean, error = estimate(images.mean(axis=(1, 2)))
    means, errors = estimate(block_means(images))
    blocks = [
        [
            {"mean": means[row, column].tolist(), "error": errors[row, column].tolist()}
            for column in range(means.shape[1])
        ]
        for row in range(means.shape[0])
    ]
    return msgspec.convert({"mean": mean.tolist(), "error": error.tolist(), "blocks": blocks}, Half)


def block_means(images: Array) -> Array:
    """Return means over `GRID` by `GRID` blocks, (..., rows, columns, 3), of images (..., H, W, 3).

    Blocks may differ by a pixel in size; a smaller image has fewer blocks.
    """
    for axis in (-3, -2):
        side = images.shape[axis]
        count = min(GRID, side)
        edges = np.arange(count + 1) * side // count  # the first pixel of each, and the side
        sums = np.add.reduceat(images, edges[:-1], axis=axis)
        images = sums / np.diff(edges).reshape((-1, *(1,) * (-1 - axis)))
    return images


# --- Baselines ----------------------------------------------------------------------------------

LARGEST = float(np.finfo(np.float32).max)
"""Largest number: images are in single precision, and squares of errors must not overflow."""


def baseline_of(scene: str, options: Mapping[str, Any], measured: Measurement) -> Baseline:
    """Return the baseline of a scene just measured, with the current versions."""
    return msgspec.convert(
        {
            "record_version": VERSION,
            "scene": scene,
            "options": dict(sorted(options.items())),
            "versions": versions(),
            **_rounded(records.plain(measured)),
        },
        Baseline,
    )


def read_baseline(text: str, name: str) -> Baseline:
    """Read a baseline; ``InputError`` has the name of the file and the fault in it."""
    try:
        baseline = records.read(Baseline, text, name)
        _require_sane(baseline)
        Options.of(baseline.options)
        baseline.text()  # rejects what cannot be written, such as a NaN among the options
    # Numbers too long for Python and lists nested too deeply raise other errors.
    except (InputError, ValueError, OverflowError, RecursionError) as error:
        where = "" if str(error).startswith(name) else f"{name}: "
        raise InputError(
            f"{where}{error} Delete it, and write it again:"
            f" `{program.command('check', 'BASELINE', '--update', '--scene')} SCENE`."
        ) from error
    return baseline


def _require_sane(baseline: Baseline) -> None:
    if not baseline.scene or not baseline.scene.isprintable():
        raise ValueError(
            f"the scene is {baseline.scene!r}: a built-in name or the path of a file is allowed."
        )
    for name in baseline.metrics:
        if name not in {*METRICS, RATIO.name}:
            raise ValueError(f"{name!r} is not a metric.")
    for name in (LEADING.name, RATIO.name):
        if name not in baseline.metrics:
            raise ValueError(f"the metric {name!r} is missing.")
    for half in (baseline.heuristic, baseline.reference):
        if half.means().ndim != 3:  # raises ValueError for rows that differ in length
            raise ValueError("there are no blocks.")
    # The last test is written so that a NaN fails it, too.
    quantities = baseline.measured().quantities()
    numbers = [(quantity.value, quantity.error) for quantity in quantities]
    floors = [metric.noise_floor or 0.0 for metric in baseline.metrics.values()]
    if not (np.abs(np.hstack([*numbers, floors])) <= LARGEST).all():
        raise ValueError(f"a number is not finite, or larger than {LARGEST:.2g}.")


def _rounded(value: Any, digits: int = 8) -> Any:
    """Round all numbers inside plain data: those of errors, at these keys, to fewer digits."""
    if isinstance(value, dict):
        errors = ("error", "noise_floor")
        return {key: _rounded(item, 3 if key in errors else digits) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_rounded(item, digits) for item in value]
    return float(f"{value:.{digits}g}") if isinstance(value, float) else value
