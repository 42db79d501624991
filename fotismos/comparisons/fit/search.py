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
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from fotismos.comparisons.departure.colour import cam16ucs_unclipped
from fotismos.comparisons.fit.model import OwnModel, PhongModel, bounds
from fotismos.comparisons.records.departure import Viewing
from fotismos.comparisons.records.fit import FittedParameter
from fotismos.heuristic.convention import Floats
from fotismos.heuristic.terms import normalisation
from fotismos.reference.scene.graph import Graph

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

COVERAGE = 1.96
"""Standard errors to either side, of an interval that covers 95 % of normal errors."""


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
    """The loss of a model against a reference (N, 3): the mean over pixels of ``r(d)``.

    ``r(d) = sqrt(d^2 + c^2) - c`` of distances ``d`` in the loss's coordinates, or ``d^2 / 2`` if
    ``c`` is infinite. A model has ``parameters``, ``image(x)`` (N, 3) of a vector of them, and
    ``columns(x)`` (P, N, 3), its derivatives.
    """

    def __init__(self, model: Any, reference: Floats, loss: Loss, viewing: Viewing) -> None:
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
        jacobian = self.loss.derivative(image, self.viewing) @ self.model.columns(x).transpose(
            1, 2, 0
        )
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


def search(objective: Objective, starts: Sequence[Floats]) -> tuple[Floats, float, bool]:
    """Return the parameters of least loss, the loss there, and whether that search converged.

    The paired start, which is the first, and the best others are followed to their minimum.
    """
    losses = [objective.value(x) for x in starts]
    followed = {0, *(1 + np.argsort(losses[1:], kind="stable")[:FOLLOWED])}
    minima = [
        descend(objective, descend(objective.smoothed(), starts[number])[0])
        for number in sorted(followed)
    ]
    return min(minima, key=lambda minimum: minimum[1])


def descend(objective: Objective, x: Floats) -> tuple[Floats, float, bool]:
    """Return the minimum that a search from ``x`` finds, its loss, and whether it converged."""
    low, high = bounds(objective.model.parameters)
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


@dataclass(frozen=True)
class Certainty:
    """Whether the image determines a parameter.

    ``reason`` says why it does not, else it is empty; ``partners`` are the indices of parameters
    that undo a change of it.
    """

    reason: str
    partners: tuple[int, ...]
    at_bound: bool


def identify(
    objective: Objective, x: Floats, pixels: NDArray[np.int64], standard_error: Floats
) -> tuple[list[Certainty], NDArray[np.float64]]:
    """Judge each parameter at the best fit ``x``, and return the covariance (P, P) of them.

    ``pixels`` (P,) is the number that each parameter can reach; ``standard_error`` (counted pixels,
    3) is that of the reference, or of its difference from the heuristic. The covariance is 0 for
    parameters not identifiable or at a bound.
    """
    low, high = bounds(objective.model.parameters)
    near = AT_BOUND * (high - low)
    threshold = objective.loss.threshold
    at_bound = (x - low < near) | (high - x < near)
    # A norm over all pixels, divided by this, is a root mean square over those it reaches.
    root = np.sqrt(np.maximum(pixels, 1))
    _, curvature, jacobian = objective.changes(x)
    flat = jacobian.reshape(-1, len(x))
    shows = np.linalg.norm(flat, axis=0) / root
    free = shows >= threshold
    inverse = _inverse_normal(flat[:, free])
    alone = shows.copy()
    # What remains of a change after the best answer of all others that show.
    alone[free] = 1 / np.sqrt(np.diag(inverse)) / root[free]
    determined = free & (alone >= threshold)
    covariance = np.zeros((len(x),) * 2)
    if (inside := determined & ~at_bound).any():
        second = objective.quadratic(x)[1][np.ix_(inside, inside)]
        slopes = objective.loss.derivative(objective.reference, objective.viewing)
        # What one standard error of each reference channel changes in the slopes, (N, K, 3).
        noise = curvature @ (slopes * standard_error[:, None, :])
        spread = np.einsum("nkp,nkc->pnc", jacobian[..., inside], noise) / len(noise)
        moved = np.linalg.pinv(second, hermitian=True) @ spread.reshape(len(spread), -1)
        # Pixels and channels count as independent: their squares add up.
        covariance[np.ix_(inside, inside)] = moved @ moved.T
    # Half an interval above one natural change tells nothing of the value.
    lost = determined & (COVERAGE * np.sqrt(np.diag(covariance)) > 1)
    certainties = []
    for number in range(len(x)):
        reason = ""
        partners: tuple[int, ...] = ()
        if shows[number] < threshold:
            reason = "does not show in the image"
        elif not determined[number]:
            reason = "others make up for it"
            index = int(free[:number].sum())
            # How far each other parameter moves to undo a unit of this one.
            shares = np.abs(inverse[index] / inverse[index, index])
            others = zip(np.flatnonzero(free).tolist(), shares, strict=True)
            partners = tuple(i for i, share in others if i != number and share > PARTNER)
        elif lost[number]:
            reason = "lost in the noise of the physical picture"
        certainties.append(Certainty(reason, partners, bool(at_bound[number])))
    return certainties, covariance


def _inverse_normal(jacobian: Floats) -> Floats:
    """Return ``(J^T J)^-1``; singular values below rounding are raised to it."""
    if not jacobian.shape[1]:
        return np.zeros((0, 0))
    _, singular, rows = np.linalg.svd(jacobian, full_matrices=False)
    scaled = rows.T / np.maximum(singular, 1e-12 * singular[0])
    covariance: Floats = scaled @ scaled.T
    return covariance


# --- As records ---------------------------------------------------------------------------------


def physical_materials(graph: Graph) -> dict[str, dict[str, Any]]:
    """Return the plain parameters of each named BSDF of the physical half."""
    materials: dict[str, dict[str, Any]] = {}
    for index in graph.nodes(mi.ObjectType.BSDF):
        label = graph.label(index)
        for _, child in graph.children(index, mi.ObjectType.BSDF):
            index = child  # inside twosided
        materials[label] = {"plugin": graph.plugin(index)}
        for key, value in graph.props(index).items():
            if isinstance(value, bool | int | float | str):
                materials[label][key] = value
            elif isinstance(value, mi.ScalarColor3f | mi.ScalarColor3d):
                colour = [float(component) for component in value]
                materials[label][key] = colour[0] if len(set(colour)) == 1 else colour
    return materials


def parameter_record(
    model: PhongModel | OwnModel,
    index: int,
    x: Floats,
    certainties: list[Certainty],
    covariance: Floats,
) -> FittedParameter:
    """Return one parameter at the best vector ``x``, ``k_s`` and ``n`` in the chapters' units."""
    parameter = model.parameters[index]
    certainty = certainties[index]
    value = float(x[index])
    spread = COVERAGE * sqrt(covariance[index, index])
    # Paired, fitted, and both ends of the interval.
    raw: tuple[float, ...] = (parameter.paired, value, value - spread, value + spread)
    limits: tuple[float, ...] = (parameter.low, parameter.high)
    phong = model if isinstance(model, PhongModel) else None
    if phong and parameter.name == "n":
        # The vector holds `ln n`.
        raw = tuple(map(exp, raw))
        limits = tuple(map(exp, limits))
    elif (
        phong
        and parameter.name == "k_s"
        and not phong.surface.materials[parameter.owner].normalised
    ):
        # The vector holds the lobe's albedo; `k_s` also depends on `n`, and on its error.
        at_n = phong.place_of_exponent(parameter.owner)
        step = 1e-5
        per_albedo = normalisation(phong.form, exp(x[at_n] + 0))
        below = normalisation(phong.form, exp(x[at_n] + (-step)))
        above = normalisation(phong.form, exp(x[at_n] + step))
        slopes = np.zeros(len(x))
        slopes[[index, at_n]] = per_albedo, value * (above - below) / (2 * step)
        # To first order, with the covariance of the two.
        variance = float(slopes @ covariance @ slopes)
        spread = COVERAGE * sqrt(max(variance, 0))
        at_pairing = normalisation(phong.form, exp(phong.parameters[at_n].paired))
        k_s = value * per_albedo
        limits = (0.0, per_albedo * parameter.high)
        raw = parameter.paired * at_pairing, k_s, k_s - spread, k_s + spread
        # Without a lobe `k_s` is 0 for any `n`.
        if not certainty.reason and certainties[at_n].reason and value > AT_BOUND:
            reason = "follows from its albedo and n, which is not identifiable"
            certainty = Certainty(reason, (), certainty.at_bound)
    paired, fitted, least, most = map(float, raw)
    low, high = map(float, limits)
    has_interval = not (certainty.reason or certainty.at_bound)
    others = (model.parameters[other] for other in certainty.partners)
    return FittedParameter(
        name=parameter.name,
        channel=parameter.channel,
        is_factor=parameter.is_factor,
        paired=paired,
        fitted=None if certainty.reason else fitted,
        interval=(max(least, low), min(most, high)) if has_interval else None,
        bounds=(low if isfinite(low) else None, high if isfinite(high) else None),
        at_bound=certainty.at_bound,
        reason=certainty.reason,
        partners=tuple(
            f"{f'{other.name} {other.channel}'.strip()} of {model.names[other.owner]}"
            for other in others
        ),
    )
