"""Both halves as sums of passes, and the numbers and maps that follow from them."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fotismos.comparisons.departure import marks, regions, statistics
from fotismos.comparisons.departure.blocks import bands
from fotismos.comparisons.departure.metrics import (
    LEADING,
    METRICS,
    RATIO,
    Metric,
    leading_distance,
)
from fotismos.comparisons.options import Options
from fotismos.comparisons.records.departure import Significant, Summary
from fotismos.comparisons.records.images import Images
from fotismos.reference.records import Pixels
from fotismos.reference.rendering.sums import (
    DEVIATION,
    MEAN,
    Accumulator,
    DifferenceEstimate,
    DifferenceSums,
    add_difference,
)

if TYPE_CHECKING:  # two pictures have no scene, and few pictures a tone map
    from fotismos.comparisons.records.images import Light
    from fotismos.reference.rendering.gbuffer import GBuffer

PERCENTILE = 95
"""A noise target is for this percentile of the noise over the counted pixels."""


# --- Sums --------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Estimates:
    """The passes of both halves, and of their difference.

    The halves have only means (H, W, 3) and the reference's standard error: the relevant
    uncertainty is the difference's. ``light`` is the reference before its tone map, if it has one.
    """

    heuristic: np.ndarray
    reference: np.ndarray
    standard_error: np.ndarray
    difference: DifferenceEstimate
    passes: int
    light: "Light | None" = None


class PassSums:
    """Running sums of the passes of both halves, and of their difference.

    ``counted`` (H, W) are the pixels whose noise counts.
    """

    def __init__(self, counted: np.ndarray) -> None:
        self.counted = counted
        self.passes = 0
        self._heuristic = Accumulator(MEAN)
        self._reference = Accumulator(DEVIATION)
        self._difference = DifferenceSums(counted)

    def add(self, heuristic: Any, reference: Any) -> None:
        """Add a pass of each half, (H, W, 3)."""
        sums = (self._heuristic, self._reference, self._difference)
        add_difference(sums, (heuristic, reference))
        self.passes += 1

    def noise_percentile(self, distance: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> float:
        """Predict the noise: 95th percentile of ΔE2000 between the reference, and it with noise.

        The noise is that of the difference of the halves, in which shared noise cancels.
        ``distance`` is the leading metric's.
        """
        counted = self.counted
        reference = self._reference.mean(np.float32)
        noise = self._difference.noise(np.float32)
        if not noise[counted].any():
            return 0.0
        distances = []
        for rows in bands(len(counted)):
            truth = reference[rows][counted[rows]].astype(np.float64)
            distances.append(distance(truth + noise[rows][counted[rows]], truth))
        return float(np.percentile(np.concatenate(distances), PERCENTILE))

    def estimates(self) -> Estimates:
        """Return the estimates so far, in single precision, like the files."""
        reference = self._reference
        return Estimates(
            heuristic=self._heuristic.mean(np.float32),
            reference=reference.mean(np.float32),
            standard_error=reference.standard_error(np.float32),
            difference=self._difference.estimate(np.float32),
            passes=self.passes,
        )


# --- Numbers -----------------------------------------------------------------------------------


def metrics_for(options: Options) -> Mapping[str, Metric]:
    """Return the metrics, computed by colour-science if the options say so."""
    if not options.colour_science:
        return METRICS
    from fotismos.comparisons.departure import definitions  # loaded late: it takes a second

    return definitions.metrics()


def summarised(
    estimates: Estimates, counted: np.ndarray, options: Options, names: Iterable[str]
) -> tuple[dict[str, Summary], dict[str, np.ndarray]]:
    """Return the summaries of metrics over the pixels that count, and the maps of the drawn."""
    metrics = metrics_for(options)
    summaries = {}
    maps = {}
    for name in names:
        summaries[name], distances = statistics.summarise(
            metrics[name],
            estimates.heuristic,
            reference=estimates.reference,
            mask=counted,
            viewing=options.viewing,
            noise=estimates.difference.noise,
            grouped=estimates.difference.grouped,
        )
        if metrics[name].drawn:
            maps[name] = distances
    return summaries, maps


def measure(
    estimates: Estimates,
    counted: np.ndarray,
    options: Options,
    surface: "GBuffer | None" = None,
    exact: bool = False,
    noise_shown: marks.NoiseShown = "all",
    names: Iterable[str] = METRICS,
) -> tuple[dict[str, Any], Images]:
    """Return fields of the record, and maps over the pixels that count, (H, W).

    ``surface`` is what they see; two pictures have none. ``exact`` says that the difference has no
    noise, and ``noise_shown`` whose noise the passes show
    (:func:`fotismos.comparisons.departure.marks.find`). ``names`` are those of the metrics, among
    them the leading one.
    """
    test = estimates.heuristic
    reference = estimates.reference
    viewing = options.viewing
    metrics = metrics_for(options)
    summaries, maps = summarised(estimates, counted, options, names)
    ratio, maps[RATIO.name] = statistics.summarise_log2_luminance(test, reference, counted)
    distance = leading_distance(viewing, metrics)
    found = marks.find(
        estimates.difference, test, counted, distance, exact=exact, noise_shown=noise_shown
    )
    error = maps[LEADING.name]
    images = Images(
        heuristic=test,
        reference=reference,
        reference_stderr=estimates.standard_error,
        maps=maps,
        significant=found.image,
        counted=counted,
        light=estimates.light,
    )
    numbers = {
        "viewing": viewing,
        "metrics": summaries,
        "log2_luminance": ratio,
        "significant": Significant(
            fraction=statistics.share(found.image[counted] == marks.MARKED),
            undetermined=statistics.share(found.image[counted] == marks.UNDETERMINED),
            level=marks.LEVEL,
            certain=found.is_certain,
        ),
        "pixels": Pixels(counted=int(counted.sum()), total=counted.size),
        "regions": regions.find(error, counted),
    }
    if surface is None:
        return numbers, images
    shapes, seen = regions.find_objects(
        error, counted, owners=surface.shape, materials=surface.bsdf
    )
    materials, made_of = regions.find_objects(error, counted, surface.bsdf)
    images = replace(
        images, position=surface.position, normal=surface.normal, objects=seen, materials=made_of
    )
    return numbers | {"objects": shapes, "materials": materials}, images
