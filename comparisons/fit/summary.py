"""The results of a fit: images, and its record made of parameters and verdicts."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import exp, sqrt
from typing import Any, Generic

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from comparisons.departure.metrics import drawn
from comparisons.departure.spaces import Viewing
from comparisons.departure.statistics import noise_floor
from comparisons.fit.fit_record import Departure, FitRecord, Fitted, FittedLight, FittedMaterial
from comparisons.fit.identify import AT_BOUND, COVERAGE, Verdict
from comparisons.fit.model import Model
from comparisons.fit.optimise import AnyModel, Solution
from comparisons.fit.parameters import Parameter
from comparisons.fit.rendering import Rendered
from heuristic.terms import normalisation
from reference.scene.graph import Graph

Departures = dict[str, Departure]
"""By metric."""


@dataclass(frozen=True)
class FitImages:
    """Linear images (H, W, 3), and residual maps (H, W) after the fit, by metric."""

    before: np.ndarray
    reference: np.ndarray
    after: np.ndarray
    maps: dict[str, np.ndarray]


@dataclass(frozen=True)
class Fit:
    """A fit: its record, and the images of the best form."""

    record: FitRecord
    images: FitImages


@dataclass(frozen=True)
class Attempt(Generic[AnyModel]):
    """The best fit of a model, and how well the image determines it.

    Attributes
    ----------
    paired_loss
        The loss of the image as paired.
    verdicts, covariance
        See :func:`comparisons.fit.identify.identify`.
    """

    model: AnyModel
    solution: Solution
    paired_loss: float
    verdicts: list[Verdict]
    covariance: np.ndarray


@dataclass(frozen=True)
class FormAttempt(Attempt[Model]):
    """The best fit of one form of the lobe."""

    def image(self, rendered: Rendered) -> NDArray[np.float64]:
        """Return the whole image, (H, W, 3)."""
        assert rendered.surface, "Phong's model is fitted on the surface"
        model = Model(rendered.surface, self.model.form, self.model.parameters)
        return model.image(self.solution.x).reshape(rendered.before.shape)


def departure(
    before: NDArray,
    after: NDArray,
    reference: NDArray,
    counted: NDArray[np.bool_],
    noise: NDArray,
    viewing: Viewing,
) -> tuple[Departures, dict[str, NDArray]]:
    """Return the departure by metric, and the metrics' maps (H, W) after the fit."""
    found, maps = {}, {}
    for name, metric in drawn().items():
        first, maps[name] = (metric(image, reference, viewing) for image in (before, after))
        means = [metric.mean(values[counted]) for values in (first, maps[name])]
        found[name] = Departure(
            before=means[0],
            after=means[1],
            p95_after=float(np.percentile(maps[name][counted], 95)),
            noise_floor=noise_floor(metric, reference, noise, counted, viewing),
        )
    return found, maps


def materials(
    attempt: FormAttempt, normalised: bool, physical: dict[str, dict[str, Any]]
) -> tuple[FittedMaterial, ...]:
    """Return the fitted parameters, material by material."""
    surface = attempt.model.surface
    return tuple(
        FittedMaterial(
            name=name,
            reference=physical.get(name),
            pixels=len(np.unique(surface.samples[owner].pixel)),
            parameters=tuple(
                Fitted(**_parameter(attempt, place, normalised))
                for place, parameter in enumerate(attempt.model.parameters)
                if parameter.owner == owner and parameter.name != "intensity"
            ),
        )
        for owner, name in enumerate(surface.names)
    )


def lights(attempt: FormAttempt, names: Sequence[str]) -> tuple[FittedLight, ...]:
    """Return the named factors on the intensities of lights, relative to the first."""
    first = FittedLight(
        light=names[0],
        name="intensity",
        is_factor=True,
        paired=1.0,
        fitted=None,
        stopped_at=1.0,
        interval=None,
        bounds=(1.0, 1.0),
        at_bound=False,
        identifiable=False,
        reason="only its products with k_d and k_s show; other lights are relative to it",
    )
    others = (
        FittedLight(light=names[parameter.owner], **_parameter(attempt, place, False))
        for place, parameter in enumerate(attempt.model.parameters)
        if parameter.name == "intensity"
    )
    return (first, *others)


def physical_materials(graph: Graph) -> dict[str, dict[str, Any]]:
    """Return the plain parameters of each named BSDF of the physical half."""
    found = {}
    for index in graph.nodes(mi.ObjectType.BSDF):
        label = graph.label(index)
        for _, child in graph.children(index, mi.ObjectType.BSDF):
            index = child  # inside twosided
        found[label] = {"plugin": graph.plugin(index)} | _plain_properties(graph.props(index))
    return found


def _plain_properties(props):
    values = {}
    for key, value in props.items():
        if isinstance(value, bool | int | float | str):
            values[key] = value
        elif isinstance(value, mi.ScalarColor3f | mi.ScalarColor3d):
            colour = [float(component) for component in value]
            values[key] = colour[0] if len(set(colour)) == 1 else colour
    return values


def _parameter(attempt: FormAttempt, place: int, normalised: bool) -> dict[str, Any]:
    """Return one parameter in the chapters' units, as the fields of :class:`Fitted`."""
    model, verdicts, covariance = attempt.model, attempt.verdicts, attempt.covariance
    parameter, verdict = model.parameters[place], verdicts[place]
    reason, x = verdict.reason, attempt.solution.x
    if parameter.name != "k_s" or normalised:
        spread = COVERAGE * sqrt(covariance[place, place])
        raw = (parameter.paired, x[place], x[place] - spread, x[place] + spread)
        limits = (parameter.low, parameter.high)
        turn = (lambda number: number) if parameter.is_linear else exp
    else:
        at_n = _place_of_exponent(model.parameters, parameter.owner)
        if not reason and verdicts[at_n].reason and x[place] > AT_BOUND:
            reason = "follows from its albedo and n, which is not identifiable"
        raw = _unnormalised(model, x, covariance, place, at_n)
        limits = (0.0, normalisation(model.form, exp(x[at_n])))
        turn = float
    paired, fitted, below, above = (float(turn(number)) for number in raw)
    low, high = (float(turn(number)) for number in limits)
    has_interval = not (reason or verdict.at_bound)
    return {
        "name": parameter.name,
        "channel": parameter.channel,
        "is_factor": parameter.is_factor or parameter.name == "intensity",
        "paired": paired,
        "fitted": None if reason else fitted,
        "stopped_at": fitted,
        "interval": (max(below, low), min(above, high)) if has_interval else None,
        "bounds": (low, high),
        "at_bound": verdict.at_bound,
        "identifiable": not reason,
        "reason": reason,
        "partners": tuple(_label(model, other) for other in verdict.partners),
    }


def _unnormalised(
    model: Model, x: NDArray, covariance: NDArray, place: int, at_n: int
) -> tuple[float, float, float, float]:
    """Return ``k_s`` of an albedo and ``n``: paired, fitted, and the ends of its interval."""

    def k_s(albedo: float, log_n: float) -> float:
        return albedo * normalisation(model.form, exp(log_n))

    step = 1e-5
    slopes = np.zeros(len(x))
    slopes[place] = k_s(1, x[at_n])
    slopes[at_n] = (k_s(x[place], x[at_n] + step) - k_s(x[place], x[at_n] - step)) / (2 * step)
    spread = COVERAGE * sqrt(max(slopes @ covariance @ slopes, 0))
    fitted = k_s(x[place], x[at_n])
    parameters = model.parameters
    paired = k_s(parameters[place].paired, parameters[at_n].paired)
    return paired, fitted, fitted - spread, fitted + spread


def _place_of_exponent(parameters: Sequence[Parameter], owner: int) -> int:
    (place,) = (i for i, p in enumerate(parameters) if (p.name, p.owner) == ("n", owner))
    return place


def _label(model: Model, place: int) -> str:
    """Return a readable name of a parameter."""
    parameter = model.parameters[place]
    owner = (
        f"light {parameter.owner + 1}"
        if parameter.name == "intensity"
        else model.surface.names[parameter.owner]
    )
    return f"{parameter.name}{parameter.channel and ' ' + parameter.channel} of {owner}"
