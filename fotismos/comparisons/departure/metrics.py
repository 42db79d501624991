"""Metrics: distances between two images, each declared with its definition, unit and range.

A metric is a function of two images and the viewing conditions that returns a map. One declaration
is enough: records, tables, the page and checks list all declared metrics. :class:`Metric` takes any
such function, also one of neighbourhoods. :class:`Pixelwise` splits it into a colour space and a
distance; a reference is then converted once, and compared with many images.

Declare a metric from outside with :func:`declare`, or with an entry point of the group
``fotismos.metrics`` whose object is a :class:`Metric` (docs/api.md has one).

Every image is a float array (H, W, 3) of linear light with the sRGB primaries (ITU-R BT.709, D65);
1.0 is display white. Statistics over an image are in `fotismos.comparisons.departure.statistics`.
"""

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import InitVar, dataclass
from math import log10
from types import EllipsisType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fotismos.comparisons.departure.colour import (
    RELATIVE_EPSILON,
    Array,
    Distance,
    Space,
    cam16ucs,
    ciede2000,
    euclidean,
    itp,
    lab,
    linear,
    luminance,
    relative_square,
    root_mean_square,
    srgb,
    symmetric_relative,
)
from fotismos.comparisons.departure.flip import hdr_flip, ldr_flip
from fotismos.comparisons.records.departure import DEFAULT_VIEWING, Viewing
from fotismos.heuristic.convention import Floats
from fotismos.heuristic.declared import Declared
from fotismos.heuristic.errors import InputError
from fotismos.reference.rendering.passes import require_finite

LOG2_EPSILON = 1e-4
"""Added to both luminances of `log2_luminance_ratio`; 1.0 is display white."""

RESERVED = frozenset(
    {
        "heuristic", "reference", "reference_stderr", "standard_error", "flags", "P", "N",
        "log2_luminance", "significant", "effects", "name", "shape", "noise", "marked",
    }
)  # fmt: skip
"""Names of layers and columns other than metrics."""

THRESHOLDS = tuple(1.0 + step / 4 for step in range(37))
"""Colour differences above which shares of pixels are counted: 1 to 10 in steps of 0.25."""

Where = NDArray[Any] | EllipsisType
Distances = Callable[[Array], Floats]


@dataclass(frozen=True, kw_only=True)
class Metric:
    """A distance between two images.

    ``name``, an identifier, is its key in records, layer in EXR files and column in tables;
    ``label``, ``unit``, ``definition``, ``caution`` (when not to trust it) and ``heading`` are
    printed. ``map_range`` is that of the colour bar, fixed so that maps of scenes compare.

    ``function(test, reference, viewing) -> (H, W)`` returns distances, ≥ 0 and finite, of linear
    images (H, W, 3). `Pixelwise` needs none. Summaries give the share of pixels above each
    threshold in ``visible``, in rising order. ``rounding`` is the difference that rounding of
    float32 renderings can make in its mean. Its map is shown and saved if it is ``drawn``. If it
    ``averages_squares``, its mean is a root mean square; ``linear`` is the former name of that. If
    its distances are ``squared``, noise adds its variance to them. A root mean square of values up
    to a ``peak`` has a PSNR, too.
    """

    name: str
    label: str
    unit: str
    definition: str
    caution: str
    map_range: tuple[float, float]
    function: Callable[[Array, Array, Viewing], Floats] | None = None
    visible: tuple[float, ...] = ()
    rounding: float = 1e-3
    heading: str = ""
    drawn: bool = True
    averages_squares: bool = False
    squared: bool = False
    peak: float | None = None
    linear: InitVar[bool] = False

    def __post_init__(self, linear: bool) -> None:
        if not self.name.isidentifier() or self.name in RESERVED:
            raise InputError(
                f"metric {self.name!r}: use a name of letters, digits and _, other than"
                f" {', '.join(sorted(RESERVED))}."
            )
        if linear:
            warnings.warn(
                "Metric: linear is now called averages_squares", DeprecationWarning, stacklevel=3
            )
            object.__setattr__(self, "averages_squares", True)
        if not self.heading:
            is_mean = self.label.lower().startswith("mean ")
            heading = self.label if is_mean else f"{self.label}, mean"
            object.__setattr__(self, "heading", heading)

    def __call__(
        self, test: ArrayLike, reference: ArrayLike, viewing: Viewing = DEFAULT_VIEWING
    ) -> Floats:
        """Return the map (H, W) of distances between two linear images (H, W, 3)."""
        test, reference = checked_pair(test, reference)
        return self.against(reference, ..., viewing)(test)

    def against(self, reference: Array, where: Where, viewing: Viewing) -> Distances:
        """Return a function that maps images (H, W, 3) to distances from the reference, (N,).

        ``where`` is any index of pixels, such as a boolean mask (H, W).
        """
        if self.function is None:
            raise InputError(
                f"metric {self.name!r} has no function: give it one, or declare a Pixelwise metric."
            )
        function = self.function

        def distances(test: Array) -> Floats:
            shown = np.asarray(test, np.float64)
            truth = np.asarray(reference, np.float64)
            return function(shown, truth, viewing)[where]

        return distances

    def of_several(
        self, tests: Sequence[Array], reference: Array, where: Where, viewing: Viewing
    ) -> list[Floats]:
        """Return the distances (N,) of several images, each as :meth:`against` has it."""
        distances = self.against(reference, where, viewing)
        return [distances(test) for test in tests]

    def mean(self, values: Floats) -> float:
        """Return the metric's mean of distances; 0 if there are none."""
        if not values.size:
            return 0.0
        if self.averages_squares:
            # Each distance is a root mean square of channels: squares average over all values.
            return float(np.sqrt(np.square(values, dtype=np.float64).mean()))
        return float(values.mean(dtype=np.float64))

    def psnr(self, mean: float) -> float | None:
        """Return ``20 log10(peak / mean)``, dB; None without a peak, and for equal images."""
        return 20.0 * log10(self.peak / mean) if self.peak and mean > 0.0 else None


@dataclass(frozen=True, kw_only=True)
class Pixelwise(Metric):
    """A distance between two pixels, independent of their neighbours.

    ``coordinates(rgb, viewing) -> (..., 3)`` takes linear RGB to a colour space, and
    ``difference(reference, test) -> (...)``, ≥ 0, measures there; all built-in ones are symmetric.
    """

    coordinates: Callable[[ArrayLike, Viewing], Array]
    difference: Callable[[Array, Array], Array]

    def against(self, reference: Array, where: Where, viewing: Viewing) -> Distances:
        """Return a function like `Metric.against`; images may be lists of pixels (N, 3).

        If ``where`` is all of them, a test image may also be a stack (..., N, 3).
        """
        fixed = self.coordinates(reference[where], viewing)
        if isinstance(self.coordinates, Space) and isinstance(self.difference, Distance):
            # In one step: the test image's coordinates are not kept.
            from_fixed = self.difference.after(self.coordinates.formula(viewing))
            return lambda test: from_fixed(fixed, test[where])

        def distances(test: Array) -> Array:
            shown = self.coordinates(np.asarray(test[where], np.float64), viewing)
            return self.difference(np.broadcast_to(fixed, shown.shape), shown)

        return distances


@dataclass(frozen=True, kw_only=True)
class Shared(Metric):
    """A distance of images, of which the reference's part is computed once for several.

    ``functions(tests, reference, viewing)`` returns a map (H, W) for each test image (H, W, 3).
    """

    functions: Callable[[Sequence[Array], Array, Viewing], Sequence[Floats]]

    def against(self, reference: Array, where: Where, viewing: Viewing) -> Distances:
        """Return a function like `Metric.against`."""
        return lambda test: self.of_several([test], reference, where, viewing)[0]

    def of_several(
        self, tests: Sequence[Array], reference: Array, where: Where, viewing: Viewing
    ) -> list[Floats]:
        """Return the distances (N,) of several images."""
        return [distances[where] for distances in self.functions(tests, reference, viewing)]


METRICS: Declared[Metric] = Declared("metric", "fotismos.metrics")
"""All metrics, in the order of reports; the first one judges scenes."""

declare = METRICS.declare
"""Declare a metric and return it; everything then lists it."""


def drawn() -> dict[str, Metric]:
    """Return the metrics whose maps are shown."""
    return {name: metric for name, metric in METRICS.items() if metric.drawn}


def declared() -> dict[str, Metric]:
    """Return the drawn metrics that are not the package's own: a page has their maps, too."""
    return {name: metric for name, metric in drawn().items() if not METRICS.is_builtin(metric)}


def _float(image: ArrayLike) -> Array:
    values = np.asarray(image)
    return values if values.dtype == np.float32 else values.astype(np.float64, copy=False)


def checked_pair(test: ArrayLike, reference: ArrayLike) -> tuple[Array, Array]:
    """Return both images as float64, or unchanged if float32.

    Shapes that differ or are not (..., 3) raise `InputError`, a NaN or an infinity
    `NonFiniteError`.
    """
    test = _float(test)
    reference = _float(reference)
    if test.shape != reference.shape or test.shape[-1:] != (3,):
        raise InputError(
            f"images of shapes {test.shape} and {reference.shape} cannot be compared:"
            " give both as (height, width, 3)."
        )
    require_finite(test, "test image")
    require_finite(reference, "reference picture")
    return test, reference


LEADING = METRICS.own(
    Pixelwise(
        name="dE2000",
        label="ΔE2000",
        unit="1 is about one just noticeable difference, black to white is 100",
        definition="CIE DE2000 between CIE L*a*b* colours (D65, 2° observer) of the images as a "
        "display shows them: exposed, then clipped to [0, 1].",
        caution="It was fitted to small differences, up to about 5, of uniform patches: large "
        "values are ordered, but twice the value is not twice as far. Values above white look "
        "alike to it.",
        map_range=(0.0, 20.0),
        visible=THRESHOLDS,
        coordinates=lab,
        difference=ciede2000,
    )
)
"""The metric that judges scenes: regions, noise targets and attributions use it."""
METRICS.own(
    Pixelwise(
        name="dE_ITP",
        label="ΔE ITP",
        unit="1 is one just noticeable difference in the most critical adaptation",
        definition="ITU-R BT.2124: 720 √(ΔI² + ΔT² + ΔP²) of ICtCp with the PQ curve, at absolute "
        "luminance, clipped to 0–10,000 cd/m².",
        caution="It assumes an eye adapted to each pixel, and so overrates differences in deep "
        "shadow next to bright light. It depends on the luminance of white.",
        map_range=(0.0, 60.0),
        visible=THRESHOLDS,
        coordinates=itp,
        difference=euclidean,
    )
)
METRICS.own(
    Pixelwise(
        name="dE_CAM16UCS",
        label="CAM16-UCS",
        unit="black to white is 100",
        definition="Euclidean distance in J'a'b' of CAM16-UCS (Li et al. 2017), of the images as a "
        "display shows them: exposed, then clipped to [0, 1].",
        caution="It assumes one adaptation over the whole image, from the viewing conditions. "
        "Values above white look alike to it.",
        map_range=(0.0, 20.0),
        visible=THRESHOLDS,
        coordinates=cam16ucs,
        difference=euclidean,
    )
)
RMSE = METRICS.own(
    Pixelwise(
        name="rmse",
        label="RMSE, linear",
        unit="1 is display white",
        definition="Root mean square of the linear RGB difference over pixels and channels, "
        "neither exposed nor clipped.",
        caution="It knows nothing of eyes: a few very bright pixels outweigh all others.",
        map_range=(0.0, 1.0),
        rounding=1e-6,
        heading="RMSE, linear and unclipped",
        drawn=False,
        averages_squares=True,
        coordinates=linear,
        difference=root_mean_square,
    )
)
METRICS.own(
    Pixelwise(
        name="relmse",
        label="relMSE",
        unit="1 is a difference as large as the reference",
        definition="Relative mean square error of linear RGB over pixels and channels, neither "
        f"exposed nor clipped: (x − r)² / (r² + ε), ε = {RELATIVE_EPSILON:g} (Rousselle et al. "
        "2011).",
        caution="It knows nothing of eyes, and grows without limit where the reference is dark.",
        map_range=(0.0, 1.0),
        rounding=1e-6,
        drawn=False,
        squared=True,
        coordinates=linear,
        difference=relative_square,
    )
)
METRICS.own(
    Pixelwise(
        name="smape",
        label="SMAPE",
        unit="from 0 to 1",
        definition="Symmetric mean absolute percentage error of linear RGB over pixels and "
        "channels, as a share, neither exposed nor clipped: |x − r| / (|x| + |r| + ε), "
        f"ε = {RELATIVE_EPSILON:g} (Vogels et al. 2018).",
        caution="It knows nothing of eyes. Near 1, images differ by orders of magnitude.",
        map_range=(0.0, 1.0),
        rounding=1e-6,
        drawn=False,
        coordinates=linear,
        difference=symmetric_relative,
    )
)
METRICS.own(
    Pixelwise(
        name="srgb_rmse",
        label="RMSE, sRGB",
        unit="1 is display white",
        definition="Root mean square of the difference of sRGB values over pixels and channels, of "
        "the images as a display shows them: exposed, then clipped to [0, 1]. In decibels it is "
        "the peak signal-to-noise ratio, PSNR = −20 log10 of it.",
        caution="It knows little of eyes. Values above white look alike to it.",
        map_range=(0.0, 1.0),
        rounding=1e-5,
        heading="RMSE of sRGB values",
        drawn=False,
        averages_squares=True,
        peak=1.0,
        coordinates=srgb,
        difference=root_mean_square,
    )
)

METRICS.own(
    Shared(
        name="ldr_flip",
        label="LDR-FLIP",
        unit="from 0 to 1, the distance of green and blue",
        definition="FLIP (Andersson et al. 2020) of the images as a display shows them: what a "
        "viewer sees in flipping between them, also edges and points, at the given pixels per "
        "degree.",
        caution="It holds for one distance from the screen. Values above white look alike to it.",
        map_range=(0.0, 1.0),
        rounding=1e-4,
        functions=ldr_flip,
    )
)
METRICS.own(
    Shared(
        name="hdr_flip",
        label="HDR-FLIP",
        unit="from 0 to 1, the distance of green and blue",
        definition="The largest LDR-FLIP over exposures from one for the reference's brightest "
        "light to one for its median (Andersson et al. 2021, ACES), in steps of at most a stop.",
        caution="Nobody sees all these exposures at once: the worst one counts at each pixel. If "
        "most of the reference is black, the last one shows noise of a millionth of white.",
        map_range=(0.0, 1.0),
        rounding=1e-4,
        drawn=False,
        functions=hdr_flip,
    )
)


@dataclass(frozen=True)
class Ratio:
    """A signed map that is not a distance; ``limit`` is the half range of its colour bar."""

    name: str
    label: str
    unit: str
    definition: str
    limit: float
    rounding: float


RATIO = Ratio(
    name="log2_luminance",
    label="Luminance ratio",
    unit="stops",
    definition=f"log2 of textbook over physical, red where the textbook is brighter; "
    f"ε = {LOG2_EPSILON:g}",
    limit=3.0,
    rounding=1e-4,
)
"""The ratio of `log2_luminance_ratio`."""


def log2_luminance_ratio(test: ArrayLike, reference: ArrayLike) -> Array:
    """Return the signed ratio of luminances in stops; shape (H, W).

    ``log2((max(Y_t, 0) + ε) / (max(Y_r, 0) + ε))`` with ε = 1e-4 of display white: positive
    where the test image is brighter, one stop is a factor of 2, and black against black is 0.

    >>> test, reference = [[[0.5, 0.5, 0.5]]], [[[0.25, 0.25, 0.25]]]
    >>> log2_luminance_ratio(test, reference).round(2).tolist()
    [[1.0]]
    """
    test, reference = checked_pair(test, reference)
    lift = [np.maximum(luminance(image), 0.0) + LOG2_EPSILON for image in (test, reference)]
    return np.log2(lift[0] / lift[1])


def leading_distance(
    viewing: Viewing, metrics: Mapping[str, Metric] = METRICS
) -> Callable[[Array, Array], Array]:
    """Return the leading one of the metrics, ``(test, reference) -> (N,)``, for colours (N, 3)."""
    leading: Any = metrics[LEADING.name]
    return lambda test, reference: leading.against(reference, ..., viewing)(test)
