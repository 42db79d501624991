"""Whether what a BSDF's samples carry is right: what integrators multiply and weigh by.

Of a sample towards ``wo``, the weight is ``eval / pdf``, and its density ``pdf``; ``eval_pdf``
returns what ``eval`` and ``pdf`` do (the interface of Mitsuba's BSDFs). A sampler may draw one of
several lobes and weigh it by that lobe alone: then the weight is right in the mean of the samples
that share a direction. The density is right for each sample, as multiple importance sampling needs
it.
"""

from collections.abc import Iterator
from itertools import combinations
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from fotismos.comparisons.audit import furnace
from fotismos.heuristic.convention import Floats

COUNT = 2**17
"""Samples of a BSDF, each for a viewer of its own."""

STEEPEST = 89.0
"""Largest angle of a viewer from the normal, or from the one behind, in degrees."""

VIEWER_CELLS = 24
LIGHT_CELLS = 8
AZIMUTH_CELLS = 8
"""Cells of the viewer's angle, of the light's height, and of its azimuth: as it is, and from the
viewer's."""

FEWEST_SAMPLES = 100
"""In a cell whose mean is judged."""

SURE_ERRORS = 6.0
"""Standard errors by which a mean weight may be off: of some 10⁵ means, none is by chance."""

FAINT = 1e-4
"""Means below this part of that of all samples are judged by their absolute difference."""

LARGEST = 2.0
"""The largest possible relative difference; it also stands for values that are not finite."""


Worst = tuple[float, str]
"""A value in its worst case, and that case in words."""


class Compared(NamedTuple):
    """What a sampler gives, (C, N), beside what is right, with the names of both.

    What is right ``in_the_mean`` alone is judged by means, with room for their noise.
    """

    name: str
    given: Floats
    right_name: str
    right: Floats
    in_the_mean: bool = False


def drawn(bsdf: Any, si: Any, rng: np.random.Generator) -> tuple[Any, Any]:
    """Return a sample of a BSDF at each point, and its weight."""
    lobe, x, y = rng.random((3, dr.width(si)))
    point = mi.Point2f(mi.Float(x), mi.Float(y))
    sample, weight = bsdf.sample(mi.BSDFContext(), si, mi.Float(lobe), point)
    return sample, weight


def index_below(bsdf: Any) -> float:
    """Return the relative index of refraction below a BSDF, as its samples report it, or 1."""
    si = furnace.interaction(np.broadcast_to(furnace.UP, (3, 256)))
    sample, _ = drawn(bsdf, si, np.random.default_rng(0))
    # Only a sample that passes to the other side tells the index.
    return dr.max(dr.select(sample.wo.z < 0, sample.eta, 0))[0] or 1.0


def p_value(scattering: dict[str, Any], degrees: float, transmits: bool) -> float:
    """Return p of Mitsuba's χ² between the samples of a BSDF and ``pdf``, for one viewer."""
    wi = mi.Vector3f(furnace.direction(np.deg2rad(degrees), 0.3))
    sample, density = mi.chi2.BSDFAdapter(scattering["type"], scattering, wi=wi)

    def turned(sample1: Any) -> Any:
        # Cells are fine at the equator: transmitted lobes about the normal are narrow.
        wo, weight = sample(sample1)
        return mi.Vector3f(wo.y, wo.z, wo.x), weight

    def counted(wo: Any) -> Any:
        wo = mi.Vector3f(wo.z, wo.x, wo.y)
        # Samples below the horizon weigh nothing: roughplastic's density there is irrelevant.
        return dr.select((wo.z > 0) | transmits, density(wo), 0)

    test = mi.chi2.ChiSquareTest(
        mi.chi2.SphericalDomain(), turned, counted, sample_dim=3,
        sample_count=200_000, ires=32, res=100,
    )  # fmt: skip
    test.run(quiet=True)
    # The test also fails for a negative density, or for samples where it is 0.
    p = 0.0 if test.fail else float(np.array(test.p_value).ravel()[0])
    return p if np.isfinite(p) else 0.0


def worst(bsdf: Any) -> Worst:
    """Return the largest relative difference of what samples carry from what is right."""
    rng = np.random.default_rng(0)
    view = _random_directions(rng)
    si = furnace.interaction(view)
    sample, weight = drawn(bsdf, si, rng)
    # Samples of weight 0, or without a direction, are none: integrators drop them.
    light = np.array(sample.wo)
    is_drawn = (_rows(weight) != 0).any(axis=0) & np.isfinite(light).all(axis=0)
    light = np.nan_to_num(light)
    # A function of two directions is also asked where no sample goes.
    toward = np.where(rng.random(COUNT) < 0.5, light, _random_directions(rng))
    of_samples = _of_samples(bsdf, si, sample, weight)
    of_pairs = _of_pairs(bsdf, si, mi.Vector3f(toward))
    found = [
        *_differences(of_samples, view[:, is_drawn], light[:, is_drawn], is_drawn),
        *_differences(of_pairs, view, toward, np.full(COUNT, True)),
    ]
    return max(found, key=lambda each: each[0])


def _random_directions(rng: np.random.Generator) -> Floats:
    """Return directions (3, N) at random angles from the normal, or from the one behind."""
    angles = np.deg2rad(rng.uniform(0, STEEPEST, COUNT))
    directions = furnace.direction(angles, rng.uniform(0, 2 * np.pi, COUNT))
    directions[2] *= rng.choice([-1, 1], COUNT)
    return directions


def _of_samples(bsdf: Any, si: Any, sample: Any, weight: Any) -> Iterator[Compared]:
    """Yield what samples carry."""
    value, density = _asked(bsdf, si, sample.wo)
    quotient = np.divide(value, density, out=np.zeros_like(value), where=density > 0)
    yield Compared("the weight of sample", _rows(weight), "eval / pdf", quotient, in_the_mean=True)
    yield Compared("pdf of sample", _rows(sample.pdf), "pdf", density)
    # What a mirror reflects is not weighed against a lamp's own samples.
    is_lobe = _rows(~mi.has_flag(sample.sampled_type, mi.BSDFFlags.Delta))
    yield Compared("sampled_type of sample", is_lobe, "a lobe's", np.ones_like(is_lobe))
    # Paths end by chance, and the sooner, the smaller the product of indices.
    stays = _rows(sample.wo.z * si.wi.z > 0)
    yield Compared("eta of a reflected sample", _rows(sample.eta) * stays, "1", stays)


def _of_pairs(bsdf: Any, si: Any, toward: Any) -> Iterator[Compared]:
    """Yield what ``eval_pdf`` returns, which integrators call in place of ``eval`` and ``pdf``."""
    value, density = _asked(bsdf, si, toward)
    both = bsdf.eval_pdf(mi.BSDFContext(), si, toward)
    yield Compared("eval of eval_pdf", _rows(both[0]), "eval", value)
    yield Compared("pdf of eval_pdf", _rows(both[1]), "pdf", density)


def _asked(bsdf: Any, si: Any, toward: Any) -> tuple[Floats, Floats]:
    """Return what ``eval`` and ``pdf`` return, (C, N) and (1, N)."""
    context = mi.BSDFContext()
    return _rows(bsdf.eval(context, si, toward)), _rows(bsdf.pdf(context, si, toward))


def _rows(values: Any) -> Floats:
    """Return Dr.Jit's values as an array (C, N)."""
    array = np.atleast_2d(np.array(values, float))
    return np.broadcast_to(array, (len(array), COUNT))


def _differences(
    pairs: Iterator[Compared], view: Floats, light: Floats, is_counted: NDArray[np.bool_]
) -> Iterator[Worst]:
    """Yield the largest relative difference of each, over the samples that count."""
    cells = list(_cells(view, light))
    for each in pairs:
        given = each.given[:, is_counted]
        right = each.right[:, is_counted]
        yield _largest(each._replace(given=given, right=right), view, cells)


def _cells(view: Floats, light: Floats) -> Iterator[NDArray[np.int_]]:
    """Yield the cell of each sample, (N,), by two coordinates at a time, and all in one."""
    azimuth = np.arctan2(light[1], light[0])
    about = np.arctan2(view[1], view[0]) - azimuth
    coordinates = (
        (furnace.polar(view) / 180, VIEWER_CELLS),
        ((1 + light[2]) / 2, LIGHT_CELLS),
        (azimuth / (2 * np.pi) % 1, AZIMUTH_CELLS),
        (about / (2 * np.pi) % 1, AZIMUTH_CELLS),
    )
    for (first, count), (second, fine) in combinations(coordinates, 2):
        rows = np.clip(first * count, 0, count - 1).astype(int)
        columns = np.clip(second * fine, 0, fine - 1).astype(int)
        yield rows * fine + columns
    yield np.zeros(view.shape[1], int)


def _largest(compared: Compared, view: Floats, cells: list[NDArray[np.int_]]) -> Worst:
    """Return the largest relative difference of means over cells."""
    is_finite = np.isfinite(compared.given).all(axis=0) & np.isfinite(compared.right).all(axis=0)
    if not is_finite.all():
        where = furnace.polar(view[:, is_finite.argmin()])
        return LARGEST, f"{compared.name} is not finite, viewer at {where:.3g}°"
    worst = (0.0, "none")
    for cell in cells:
        counts = np.bincount(cell)
        is_judged = counts >= FEWEST_SAMPLES
        if not is_judged.any():
            continue
        for given, right in zip(compared.given, compared.right, strict=True):
            off = _relative(given, right, cell, counts, compared.in_the_mean)
            off = np.where(is_judged, off, 0)
            if off.max() > worst[0]:
                is_here = cell == off.argmax()
                ratio = given[is_here].mean() / (right[is_here].mean() or np.inf)
                says = f"{ratio:.3g} times" if right[is_here].any() else "not 0, as is"
                at = np.flatnonzero(is_here)[np.abs(given - right)[is_here].argmax()]
                words = f"{compared.name} is {says} {compared.right_name}"
                where = furnace.polar(view[:, at])
                worst = (float(off.max()), f"{words}, viewer at {where:.3g}°")
    return worst


def _relative(
    given: Floats,
    right: Floats,
    cell: NDArray[np.int_],
    counts: NDArray[np.int_],
    in_the_mean: bool,
) -> Floats:
    """Return by how much values (N,) differ in each cell, over the mean size of both."""

    def mean(values: Floats) -> Floats:
        return np.bincount(cell, values) / np.maximum(counts, 1)

    apart = given - right
    off = mean(np.abs(apart))
    if in_the_mean:
        off = np.abs(mean(apart))
        spread = np.maximum(mean(apart**2) - off**2, 0)
        off = off - SURE_ERRORS * np.sqrt(spread / np.maximum(counts, 1))
    size = mean(np.abs(given) + np.abs(right)) / 2
    least = FAINT * np.abs(right).mean() or 1.0
    relative: Floats = off / np.maximum(size, least)
    return relative
