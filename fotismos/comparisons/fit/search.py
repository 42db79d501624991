"""The search for the best parameters, and which of them the image determines.

A loss is the mean over pixels of a distance ``d`` between two images: ``sqrt(d^2 + c^2) - c`` in
CAM16-UCS (``perceptual``), or ``d^2 / 2`` in linear RGB (``linear``). Unlike the metric, CAM16-UCS
is not clipped at display white: a clipped highlight would not show how high and narrow it is. Its
distance is averaged, not the square: otherwise a shadow, which no parameter makes, would pull all
of them towards itself.

*The search* is a bounded Newton method. The loss is a sum of a convex function of the coordinates'
differences, which are nearly linear in the parameters: its second derivative is that function's,
carried over by the Jacobian. Each step minimises the quadratic that has these derivatives, damped
as by Levenberg and Marquardt, within the bounds, so a parameter reaches its bound. (SciPy's own
searches see a curvature where a distance has none, or only its gradient, and take ten times the
steps.) A highlight's width can trap the search, so it has several starts; so can the kink of a
distance at 0, so each search first minimises a loss that is rounded more, :data:`SMOOTH`.

*A parameter that the image does not show*, or that others can make up for, has no fitted value. The
Jacobian's columns answer both: the root mean square change of the loss's coordinates, over the
pixels that the parameter can reach, for one natural change of it; and the change that remains when
all others undo as much of it as they can, ``1 / sqrt((J^T J)^-1)`` on the diagonal. This is to
first order, at the fitted values, and as if a parameter at its bound were free to leave it.

*Intervals* are those of an M-estimator: the reference's noise moves the gradient of the loss, and
the inverse of its second derivative moves the minimum.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import exp, inf, isfinite, sqrt
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from fotismos.comparisons.departure.colour import cam16ucs_unclipped
from fotismos.comparisons.records.departure import Viewing
from fotismos.comparisons.records.fit import Channel, FittedParameter
from fotismos.heuristic.convention import Doubles, Floats
from fotismos.heuristic.terms import normalisation

STEP = 1e-4
SMALLEST_STEP = 1e-8
"""Relative step of the finite differences of colour spaces; their own error is its square."""

FOLLOWED = 2
"""The starts of least loss that are followed to their minimum, besides the paired one."""

SMOOTH = 1.0
"""Rounding, in the loss's unit, of the loss that a search goes through first."""

LARGEST_COUNT = 60
LARGEST_DAMPING = 1e12
"""A search ends after so many evaluations, or at this damping."""

TOLERANCE = 1e-7
SMALLEST_GAIN = 1e-14
"""A search has converged when the next step is expected to lower the loss by less than the share
TOLERANCE of it, or by less than SMALLEST_GAIN: a model that makes the image exactly has no loss."""

AT_BOUND = 1e-5
"""Share of the distance between two bounds; anything nearer to a bound is at it."""

PARTNER = 0.1
"""Share of a change that another parameter must take up to be named."""

REASONS = (
    "does not show in the image",
    "others make up for it",
    "lost in the noise of the physical picture",
)
"""Why a parameter is not identifiable; the first that holds is given."""

COVERAGE = 1.96
"""Standard errors to either side, of an interval that covers 95 % of normal errors."""


# --- What is fitted -----------------------------------------------------------------------------


@dataclass(frozen=True)
class FitParameter:
    """One number to be fitted: ``k_a``, ``k_d``, ``k_s`` or ``n``, or a heuristic's own.

    ``owner`` is the index of its material. The value by the pairing table and the bounds are as in
    the vector, which has the ``logarithm`` of ``n``, and for ``k_s`` may have the lobe's
    ``albedo``. A coefficient of three numbers has one in each ``channel``.
    """

    name: str
    paired: float
    low: float
    high: float
    owner: int = 0
    held: Literal["itself", "logarithm", "albedo"] = "itself"
    channel: Channel = ""
    is_factor: bool = False

    @property
    def tint(self) -> Doubles:
        """What the number is a multiple of, in RGB."""
        return np.array([self.channel in ("", letter) for letter in "RGB"], np.float64)


class Model:
    """A textbook half as a function of a vector ``x`` (P,) with all of its ``parameters``.

    ``names`` are those of its materials, each of which ``reached`` so many of the pixels that are
    ``counted`` (N,). ``form`` is that of the lobe, or the name of a heuristic.
    """

    form: str
    names: tuple[str, ...]
    parameters: tuple[FitParameter, ...]
    counted: NDArray[np.bool_]
    reached: Sequence[int]

    def whole(self, x: Floats) -> Doubles:
        """Return the image (N, 3) of all pixels."""
        raise NotImplementedError

    def derivatives(self, x: Floats) -> Doubles:
        """Return the derivatives (P, N, 3) of the image by the parameters."""
        raise NotImplementedError

    def starts(self, reference: Floats) -> list[Floats]:
        """Return where to search from, the paired values first; ``reference`` as for a loss."""
        raise NotImplementedError

    def image(self, x: Floats) -> Doubles:
        """Return the image of the counted pixels."""
        image: Doubles = self.whole(x)[self.counted]
        return image

    def columns(self, x: Floats) -> Doubles:
        """Return the derivatives at the counted pixels."""
        columns: Doubles = self.derivatives(x)[:, self.counted]
        return columns

    @property
    def bounds(self) -> Doubles:
        """The lower and the upper bounds, (2, P)."""
        return np.array([[p.low for p in self.parameters], [p.high for p in self.parameters]])

    @property
    def paired(self) -> Doubles:
        """The paired values (P,), which may lie outside the bounds."""
        return np.array([parameter.paired for parameter in self.parameters])

    def label(self, number: int) -> str:
        """Return the name of a parameter and its material."""
        parameter = self.parameters[number]
        name = f"{parameter.name} {parameter.channel}".strip()
        return f"{name} of {self.names[parameter.owner]}"

    def place_of_exponent(self, owner: int) -> int:
        """Return the index of a material's ``n``."""
        return [(p.name, p.owner) for p in self.parameters].index(("n", owner))

    def stated(self, number: int, x: Floats, value: float) -> float:
        """Return a value of a parameter in the unit of records, beside the others of ``x``."""
        parameter = self.parameters[number]
        if parameter.held == "logarithm":
            return exp(value)
        if parameter.held == "albedo":
            return float(value * self.per_albedo(x[self.place_of_exponent(parameter.owner)]))
        return float(value)

    def per_albedo(self, logarithm: float) -> float:
        """Return the ``k_s`` of a lobe of albedo 1 and a given ``ln n``."""
        return float(normalisation(self.form, exp(logarithm)))

    def interval(self, number: int, x: Floats, covariance: Floats) -> tuple[float, float]:
        """Return the interval of a parameter in the unit of records, bounds aside."""
        parameter = self.parameters[number]
        if parameter.held != "albedo":
            spread = COVERAGE * sqrt(covariance[number, number])
            low = self.stated(number, x, x[number] - spread)
            return low, self.stated(number, x, x[number] + spread)
        # `k_s` also depends on `n`: to first order, with the covariance of the two.
        at_n = self.place_of_exponent(parameter.owner)
        step = 1e-5
        rise = self.per_albedo(x[at_n] + step) - self.per_albedo(x[at_n] - step)
        slopes = np.zeros(len(x))
        slopes[number] = self.per_albedo(x[at_n])
        slopes[at_n] = x[number] * rise / (2 * step)
        spread = COVERAGE * sqrt(max(float(slopes @ covariance @ slopes), 0))
        k_s = self.stated(number, x, x[number])
        return k_s - spread, k_s + spread


# --- The loss -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Loss:
    """Coordinates of pixels (N, 3) in a viewing, (N, K), and their derivatives by RGB, (N, K, 3).

    ``threshold`` is the root mean square change of coordinates below which nothing shows, and
    ``rounding`` is ``c`` above, infinite for squares.
    """

    unit: str
    coordinates: Callable[[Floats, Viewing], Floats]
    derivative: Callable[[Floats, Viewing], Floats]
    threshold: float
    rounding: float = inf


def _perceptual_derivative(rgb: Floats, viewing: Viewing) -> Floats:
    """Return central differences; all six images are converted at once."""
    step = STEP * np.abs(rgb) + SMALLEST_STEP
    shifts = np.concatenate([sign * np.eye(3) for sign in (1, -1)])
    # Shifts (6, 1, 3) of pixels (N, 3): three up, then three down.
    values = cam16ucs_unclipped(rgb + shifts[:, None, :] * step, viewing)
    return np.moveaxis((values[:3] - values[3:]) / (2 * step.T[..., None]), 0, -1)


LOSSES = {
    "perceptual": Loss(
        unit="ΔE (CAM16-UCS)",
        coordinates=cam16ucs_unclipped,
        derivative=_perceptual_derivative,
        threshold=0.05,
        rounding=0.1,
    ),
    "linear": Loss(
        unit="white",
        coordinates=lambda rgb, _: rgb,
        derivative=lambda rgb, _: np.broadcast_to(np.eye(3), (len(rgb), 3, 3)),
        threshold=5e-4,
    ),
}


class Objective:
    """The loss of a model against a reference (N, 3) at the counted pixels: the mean of ``r(d)``.

    ``r(d) = sqrt(d^2 + c^2) - c`` of distances ``d`` in the loss's coordinates, or ``d^2 / 2`` if
    ``c`` is infinite.
    """

    def __init__(self, model: Model, reference: Floats, loss: Loss, viewing: Viewing) -> None:
        self.model = model
        self.reference = reference
        self.loss = loss
        self.viewing = viewing
        self._target = loss.coordinates(reference, viewing)

    def smoothed(self) -> "Objective":
        """Return the same with a loss that is rounded by :data:`SMOOTH` or more."""
        loss = replace(self.loss, rounding=max(self.loss.rounding, SMOOTH))
        return Objective(self.model, self.reference, loss=loss, viewing=self.viewing)

    def value(self, x: Floats) -> float:
        """Return the loss of a vector of parameters."""
        return self.value_of(self.model.image(x))

    def value_of(self, image: Floats) -> float:
        """Return the loss of an image (N, 3)."""
        differences = self.loss.coordinates(image, self.viewing) - self._target
        square = np.sum(differences**2, axis=1)
        c = self.loss.rounding
        # The same as sqrt(d^2 + c^2) - c, without the difference of like numbers.
        values = square / (np.sqrt(square + c * c) + c) if isfinite(c) else square / 2
        return float(values.mean())

    def changes(self, x: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the slopes of the loss by a pixel's coordinates, its curvatures, and a Jacobian.

        ``d / s`` (N, K) and ``I / s - d d^T / s^3`` (N, K, K), with ``s = sqrt(d^2 + c^2)``, and
        the derivatives of the coordinates by the parameters (N, K, P).
        """
        image = self.model.image(x)
        c = self.loss.rounding
        d = self.loss.coordinates(image, self.viewing) - self._target
        columns = self.model.columns(x).transpose(1, 2, 0)
        jacobian = self.loss.derivative(image, self.viewing) @ columns
        identity = np.eye(d.shape[1])
        if not isfinite(c):
            return d, np.broadcast_to(identity, (len(d), *identity.shape)), jacobian
        s = np.sqrt(np.sum(d**2, axis=1, keepdims=True) + c * c)
        curvature = identity / s[..., None] - d[:, :, None] * d[:, None, :] / s[..., None] ** 3
        return d / s, curvature, jacobian

    def quadratic(self, x: Floats) -> tuple[Floats, Floats]:
        """Return gradient (P,) and second derivative (P, P) of the loss by the parameters."""
        slopes, curvature, jacobian = self.changes(x)
        gradient = np.einsum("nkp,nk->p", jacobian, slopes)
        # `J^T C J` over all coordinates of all pixels, with `J` as (N K, P).
        flat = jacobian.reshape(-1, len(x))
        second = flat.T @ (curvature @ jacobian).reshape(-1, len(x))
        return gradient / len(slopes), second / len(slopes)


# --- The search ---------------------------------------------------------------------------------


def search(objective: Objective) -> tuple[Floats, float, bool]:
    """Return the parameters of least loss, the loss there, and whether that search converged.

    The paired start, which is the first, and the best others are followed to their minimum.
    """
    starts = objective.model.starts(objective.reference)
    losses = [objective.value(x) for x in starts]
    followed = {0, *(1 + np.argsort(losses[1:], kind="stable")[:FOLLOWED])}
    minima = [
        descend(objective, descend(objective.smoothed(), starts[number])[0])
        for number in sorted(followed)
    ]
    return min(minima, key=lambda minimum: minimum[1])


def descend(objective: Objective, x: Floats) -> tuple[Floats, float, bool]:
    """Return the minimum that a search from ``x`` finds, its loss, and whether it converged."""
    low, high = objective.model.bounds
    loss = objective.value(x)
    damping = 1e-3
    gradient, second = objective.quadratic(x)
    for _ in range(1, LARGEST_COUNT):
        # In proportion to the diagonal, so that a parameter's unit does not matter.
        damped = second + damping * np.diag(np.diag(second))
        step = bounded_minimum(damped, gradient, low=low - x, high=high - x)
        # The loss that the damped quadratic promises to remove.
        expected = -(gradient @ step + step @ damped @ step / 2)
        if expected <= max(TOLERANCE * loss, SMALLEST_GAIN) or damping > LARGEST_DAMPING:
            return x, loss, True
        trial = np.clip(x + step, low, high)
        gained = loss - objective.value(trial)
        # Less damping after a step near its promise, more after a poor one.
        if gained > 0:
            x = trial
            loss = loss - gained
            gradient, second = objective.quadratic(x)
            damping *= 0.1 if gained > 0.5 * expected else 1
        if gained <= 0.1 * expected:
            damping *= 8
    return x, loss, False


def bounded_minimum(second: Floats, gradient: Floats, low: Floats, high: Floats) -> Floats:
    """Return the minimum of ``g x + x H x / 2`` within bounds, by bounded least squares.

    Directions without curvature get as much of it as rounding would leave, and stay in place.
    """
    # With `H = V D V^T` and `R = D^(1/2) V^T`, minimise `|R x + D^(-1/2) V^T g|`.
    values, vectors = np.linalg.eigh(second)
    roots = np.sqrt(np.maximum(values, max(1e-13 * values[-1], 1e-300)))
    solved = lsq_linear(
        roots[:, None] * vectors.T, -(vectors.T @ gradient) / roots, (low, high), method="bvls"
    )
    solution: Floats = np.clip(solved.x, low, high)
    return solution


# --- What the image determines ------------------------------------------------------------------


def identify(
    objective: Objective, x: Floats, standard_error: Floats
) -> tuple[list[FittedParameter], Doubles]:
    """Return the parameters at the best fit ``x`` as records, and the covariance (P, P) of them.

    ``standard_error`` (N, 3) is that of the reference, or of its difference from the heuristic. The
    covariance is 0 for parameters not identifiable or at a bound.
    """
    model = objective.model
    low, high = model.bounds
    near = AT_BOUND * (high - low)
    at_bound = (x - low < near) | (high - x < near)
    threshold = objective.loss.threshold
    # A norm over all pixels, divided by this, is a root mean square over those it reaches.
    pixels = [model.reached[parameter.owner] for parameter in model.parameters]
    root = np.sqrt(np.maximum(pixels, 1))
    _, _, jacobian = objective.changes(x)
    flat = jacobian.reshape(-1, len(x))
    shows = np.linalg.norm(flat, axis=0) / root >= threshold
    inverse = np.zeros((len(x), len(x)))
    inverse[np.ix_(shows, shows)] = _inverse_normal(flat[:, shows])
    # What remains of a change after the best answer of all others that show.
    determined = shows.copy()
    determined[shows] = 1 / np.sqrt(np.diag(inverse)[shows]) / root[shows] >= threshold
    covariance = np.zeros((len(x), len(x)))
    if (inside := determined & ~at_bound).any():
        moved = _moved(objective, x, inside, standard_error)
        # Pixels and channels count as independent: their squares add up.
        covariance[np.ix_(inside, inside)] = moved @ moved.T
    # Half an interval above one natural change tells nothing of the value.
    lost = COVERAGE * np.sqrt(np.diag(covariance)) > 1
    reasons = np.select([~shows, ~determined, lost], REASONS, "").tolist()
    records = []
    for number, parameter in enumerate(model.parameters):
        reason = reasons[number]
        partners: list[str] = []
        if reason == REASONS[1]:
            # How far each other parameter moves to undo a unit of this one.
            shares = np.abs(inverse[number] / inverse[number, number])
            shares[number] = 0
            partners = [model.label(other) for other in range(len(x)) if shares[other] > PARTNER]
        # Without a lobe `k_s` is 0 for any `n`.
        if parameter.held == "albedo" and not reason and x[number] > AT_BOUND:
            lost_n = reasons[model.place_of_exponent(parameter.owner)]
            reason = lost_n and "follows from its albedo and n, which is not identifiable"
        lowest = model.stated(number, x, parameter.low)
        highest = model.stated(number, x, parameter.high)
        least, most = model.interval(number, x, covariance)
        has_interval = not (reason or at_bound[number])
        records.append(
            FittedParameter(
                name=parameter.name,
                channel=parameter.channel,
                is_factor=parameter.is_factor,
                paired=model.stated(number, model.paired, parameter.paired),
                fitted=None if reason else model.stated(number, x, x[number]),
                interval=(max(least, lowest), min(most, highest)) if has_interval else None,
                bounds=(_finite(lowest), _finite(highest)),
                at_bound=bool(at_bound[number]),
                reason=reason,
                partners=tuple(partners),
            )
        )
    return records, covariance


def _moved(
    objective: Objective, x: Floats, inside: NDArray[np.bool_], standard_error: Floats
) -> Floats:
    """Return how far one standard error of each channel (N C) moves the parameters inside."""
    _, curvature, jacobian = objective.changes(x)
    second = objective.quadratic(x)[1][np.ix_(inside, inside)]
    slopes = objective.loss.derivative(objective.reference, objective.viewing)
    # What one standard error of each reference channel changes in the slopes, (N, K, 3).
    noise = curvature @ (slopes * standard_error[:, None, :])
    spread = np.einsum("nkp,nkc->pnc", jacobian[..., inside], noise) / len(noise)
    moved: Floats = np.linalg.pinv(second, hermitian=True) @ spread.reshape(len(spread), -1)
    return moved


def _finite(bound: float) -> float | None:
    return bound if isfinite(bound) else None


def _inverse_normal(jacobian: Floats) -> Floats:
    """Return ``(J^T J)^-1``; singular values below rounding are raised to it."""
    if not jacobian.shape[1]:
        return np.zeros((0, 0))
    _, singular, rows = np.linalg.svd(jacobian, full_matrices=False)
    scaled = rows.T / np.maximum(singular, 1e-12 * singular[0])
    covariance: Floats = scaled @ scaled.T
    return covariance
