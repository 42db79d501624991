"""What a comparison compares: two sources of passes, and what they have.

Two pictures have nothing but their passes. A scene has surfaces, a pair and a plan, too
(:class:`fotismos.comparisons.prepared.Prepared`), and pictures of other renderers may replace
either of its halves. A step of a comparison says which parts it needs, so that nothing asks what
kind of source a half is.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from fotismos.comparisons.departure import criterion
from fotismos.comparisons.departure.blocks import bands
from fotismos.comparisons.departure.colour import Array
from fotismos.comparisons.departure.estimate import NoiseShown
from fotismos.comparisons.departure.metrics import METRICS, Metric, leading_distance
from fotismos.comparisons.options import Options
from fotismos.comparisons.records.comparison import PictureFiles
from fotismos.comparisons.records.images import Comparison, Images
from fotismos.heuristic.program import PICTURE_LIBRARIES
from fotismos.reference.rendering.passes import PassSource, Progress
from fotismos.reference.rendering.sums import (
    DEVIATION,
    MEAN,
    Accumulator,
    DifferenceSums,
    add_difference,
)

PERCENTILE = 95
"""A noise target is for this percentile of the noise over the counted pixels."""

Part = Literal["scene", "textbook", "physical", "shader", "pictures"]
"""What halves may have: a scene, a textbook and a physical half that it renders, a shader of the
user's that shades the textbook half, and pictures that were given."""

Judge = Callable[[Comparison, Sequence[np.ndarray], np.ndarray | None], Comparison]
"""Adds what is odd about pictures to a comparison; given what :meth:`Halves.template` returns."""


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

    def images(self) -> Images:
        """Return the means so far, in single precision, like the files; nothing is marked yet."""
        reference = self._reference
        return Images(
            heuristic=self._heuristic.mean(np.float32),
            reference=reference.mean(np.float32),
            reference_stderr=reference.standard_error(np.float32),
            difference=self._difference.estimate(np.float32),
            maps={},
            significant=np.zeros(self.counted.shape),
            counted=self.counted,
        )


@dataclass(frozen=True, kw_only=True)
class Halves:
    """Two sources of passes that are compared, and the pixels that count.

    ``pictures`` are the records of those that were given, and ``judge`` says what is odd in them.
    ``passes`` of both are taken, in ``sums`` over the pixels that count. ``where`` (H, W) is what
    masks and transparent pictures leave of these, None for all. ``noise_shown`` says whose noise
    the passes show, and ``is_exact`` that there is none. ``seconds`` by stage are those in which
    the halves were made ready.
    """

    name: str
    options: Options
    first: PassSource
    second: PassSource
    passes: int
    has: frozenset[Part]
    pictures: Mapping[str, PictureFiles] = field(default_factory=dict)
    judge: Judge | None = None
    where: NDArray[np.bool_] | None = None
    sums: Callable[[NDArray[np.bool_]], PassSums] = PassSums
    noise_shown: NoiseShown = "all"
    is_exact: bool = False
    seconds: Mapping[str, float] = field(default_factory=dict)

    libraries: ClassVar[Sequence[str]] = PICTURE_LIBRARIES
    """The libraries that the result depends on."""

    @property
    def spp(self) -> int:
        """Samples per pixel over all passes; those of pictures are not known, and count as 1."""
        return self.passes

    @property
    def counted(self) -> NDArray[Any]:
        """The pixels (H, W) that count."""
        assert self.where is not None, "pictures say where they are opaque"
        return self.where

    @property
    def metrics(self) -> Mapping[str, Metric]:
        """The metrics, computed by colour-science if the options say so."""
        if not self.options.colour_science:
            return METRICS
        from fotismos.comparisons.departure import definitions  # loaded late: it takes a second

        return definitions.metrics()

    @property
    def distance(self) -> Callable[[Array, Array], Array]:
        """The leading metric, ``(test, reference) -> (N,)``, for colours (N, 3)."""
        return leading_distance(self.options.viewing, self.metrics)

    def with_objects(self, images: Images) -> tuple[dict[str, Any], Images]:
        """Return the fields of the record on what pixels see, and the images with it, if known."""
        return {}, images

    def template(self) -> tuple[Sequence[np.ndarray], np.ndarray | None]:
        """Return maps (H, W) of the edges that pictures should have, and a textbook picture.

        Either is missing if the scene does not say; both are without a scene.
        """
        return (), None

    def fields(self, passes: int) -> dict[str, Any]:
        """Return the fields of the record that follow from the sources, after some passes."""
        return dict(self.pictures)

    def caution(self, test: np.ndarray, reference: np.ndarray) -> str:
        """Return why the error of linear images (H, W, 3) may mean nothing; often empty."""
        return self.require_light(test, reference)

    def require_light(self, test: np.ndarray, reference: np.ndarray) -> str:
        """Return what the pixels of linear images (H, W, 3) let doubt.

        See :func:`fotismos.comparisons.departure.criterion.caution`.
        """
        return criterion.caution(
            test[self.counted],
            reference[self.counted],
            name=self.name,
            allow_empty=self.options.allow_empty,
            is_picture="textbook" not in self.has,
            exposure=self.options.viewing.exposure,
        )


@dataclass(frozen=True)
class Step:
    """What adds a part to a comparison once it is measured, and the parts of halves it needs."""

    needs: frozenset[Part]
    add: Callable[[Comparison, Any, Progress | None], Comparison]
