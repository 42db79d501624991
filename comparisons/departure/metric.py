"""Define and declare metrics.

A metric is a function of two images and the viewing conditions that returns a map. One declaration
is enough: records, tables, the page and checks list all declared metrics. :class:`Metric` takes any
such function, also one of neighbourhoods. :class:`Pixelwise` splits it into a colour space and a
distance; a reference is then converted once, and compared with many images.

Declare a metric from outside with :func:`declare`, or with an entry point of the group
``fotismos.metrics`` whose object is a :class:`Metric`::

    declare(
        Metric(
            name="absolute",
            label="Mean absolute difference",
            unit="1 is display white",
            definition="Mean over the channels of the absolute linear difference.",
            caution="It knows nothing of eyes.",
            map_range=(0.0, 1.0),
            function=lambda test, reference, viewing: np.abs(test - reference).mean(axis=-1),
        )
    )

Every image is a float array (H, W, 3) of linear light with the sRGB primaries (ITU-R BT.709, D65);
1.0 is display white.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from comparisons.departure.spaces import (
    DEFAULT_VIEWING,
    Array,
    Distance,
    Space,
    Viewing,
    between,
)
from heuristic.declared import Declared
from heuristic.errors import InputError
from reference.rendering.renderer import require_finite

RESERVED = frozenset(
    {
        "heuristic", "reference", "reference_stderr", "standard_error", "flags", "P", "N",
        "log2_luminance", "significant", "effects", "name", "shape", "noise", "marked",
    }
)  # fmt: skip
"""Names of layers and columns other than metrics."""

Distances = Callable[[Array], NDArray]


@dataclass(frozen=True, kw_only=True)
class Metric:
    """A distance between two images.

    Attributes
    ----------
    name
        An identifier: its key in records, its layer in EXR files, its column in tables.
    label, unit, definition, caution
        As printed in reports; `caution` says when not to trust it.
    map_range
        Fixed (low, high) of the colour bar, so maps of different scenes compare.
    function
        ``(test, reference, viewing) -> (H, W)``: distances, ≥ 0 and finite, of linear images
        (H, W, 3). `Pixelwise` needs none.
    visible
        Thresholds in the metric's unit; summaries give the share of pixels above each.
    rounding
        The difference that rounding of float32 renderings can make in its mean.
    heading
        Column heading of its mean; `label` and "mean" if omitted.
    drawn
        Whether its map is shown and saved.
    linear
        Whether it is a difference of linear values: its mean is then a root mean square, and its
        best exposure minimises squares.
    stacks
        Whether `function` also takes several test images (n, H, W, 3), and returns (n, H, W).
    """

    name: str
    label: str
    unit: str
    definition: str
    caution: str
    map_range: tuple[float, float]
    function: Callable[[Array, Array, Viewing], NDArray] | None = None
    visible: tuple[float, ...] = ()
    rounding: float = 1e-3
    heading: str = ""
    drawn: bool = True
    linear: bool = False
    stacks: bool = False

    def __post_init__(self) -> None:
        if not self.name.isidentifier() or self.name in RESERVED:
            raise InputError(
                f"metric {self.name!r}: use a name of letters, digits and _, other than"
                f" {', '.join(sorted(RESERVED))}."
            )
        if not self.heading:
            object.__setattr__(self, "heading", f"{self.label}, mean")

    @property
    def thresholds(self) -> tuple[str, ...]:
        """The thresholds of `visible`, as named in records."""
        return tuple(f"{limit:g}" for limit in self.visible)

    def __call__(
        self, test: ArrayLike, reference: ArrayLike, viewing: Viewing = DEFAULT_VIEWING
    ) -> NDArray:
        """Return the map (H, W) of distances between two linear images (H, W, 3)."""
        test, reference = checked_pair(test, reference)
        return self.against(reference, ..., viewing)(test)

    def against(self, reference: Array, where: Any, viewing: Viewing) -> Distances:
        """Return a function that maps images (H, W, 3) to distances from the reference, (N,).

        Parameters
        ----------
        reference, viewing
            The reference (H, W, 3), and the viewing conditions.
        where
            Any index of pixels, such as a boolean mask (H, W).
        """
        if self.function is None:
            raise InputError(
                f"metric {self.name!r} has no function: give it one, or declare a Pixelwise metric."
            )
        function = self.function

        def distances(test: Array) -> NDArray:
            shown, truth = (np.asarray(image, np.float64) for image in (test, reference))
            return function(shown, truth, viewing)[where]

        return distances

    def each(
        self, tests: Sequence[Array], reference: Array, where: Any, viewing: Viewing
    ) -> list[NDArray]:
        """Return the distances of several images, as from `against`."""
        if self.stacks and self.function is not None:
            return [found[where] for found in self.function(np.stack(tests), reference, viewing)]
        return list(map(self.against(reference, where, viewing), tests))

    def mean(self, values: NDArray) -> float:
        """Return the metric's mean of distances; 0 if there are none."""
        if not values.size:
            return 0.0
        if self.linear:
            return float(np.sqrt(np.square(values, dtype=np.float64).mean()))
        return float(values.mean(dtype=np.float64))


@dataclass(frozen=True, kw_only=True)
class Pixelwise(Metric):
    """A distance between two pixels, independent of their neighbours.

    Attributes
    ----------
    coordinates
        ``(rgb, viewing) -> (..., 3)``: linear RGB to a colour space.
    difference
        ``(coordinates, coordinates) -> (...)``: distance, ≥ 0. The first is the reference's; all
        built-in metrics are symmetric.
    """

    coordinates: Callable[[ArrayLike, Viewing], Array]
    difference: Callable[[Array, Array], Array]

    def against(self, reference: Array, where: Any, viewing: Viewing) -> Distances:
        """Return a function like `Metric.against`; images may be lists of pixels (N, 3)."""
        if isinstance(self.coordinates, Space) and isinstance(self.difference, Distance):
            return between(self.coordinates, self.difference, reference[where], where, viewing)
        fixed = self.coordinates(reference[where], viewing)

        def distances(test: Array) -> Array:
            pixels = np.asarray(test[where], np.float64)
            return self.difference(fixed, self.coordinates(pixels, viewing))

        return distances


METRICS: Declared[Metric] = Declared("metric", "fotismos.metrics")
"""All metrics by name, in the order of reports; the first one judges scenes."""

declare = METRICS.declare
"""Declare a metric and return it; everything then lists it."""


def drawn() -> dict[str, Metric]:
    """Return the metrics whose maps are shown, by name."""
    return {name: metric for name, metric in METRICS.items() if metric.drawn}


def checked_pair(test: ArrayLike, reference: ArrayLike) -> tuple[Array, Array]:
    """Return both images as float64, or unchanged if float32, after checking them.

    Raises
    ------
    InputError
        When they differ in shape, or their shape is not (..., 3).
    NonFiniteError
        When either has a NaN or an infinity.
    """
    test, reference = (
        image if image.dtype == np.float32 else image.astype(np.float64, copy=False)
        for image in (np.asarray(test), np.asarray(reference))
    )
    if test.shape != reference.shape or test.shape[-1:] != (3,):
        raise InputError(
            f"images of shapes {test.shape} and {reference.shape} cannot be compared:"
            " give both as (height, width, 3)."
        )
    require_finite(test, "test image")
    require_finite(reference, "reference image")
    return test, reference
