"""What a fit returns: images, and its record made of parameters and verdicts."""

from dataclasses import dataclass
from math import exp, sqrt

import mitsuba as mi
import numpy as np

from comparisons.departure.metrics import drawn
from comparisons.departure.statistics import noise_floor
from comparisons.fit.fit_record import Departure, FitRecord, Fitted, FittedLight, FittedMaterial
from comparisons.fit.identify import AT_BOUND, COVERAGE
from comparisons.fit.model import Model
from comparisons.fit.optimise import Solution
from heuristic.terms import normalisation


@dataclass(frozen=True)
class FitImages:
    """Linear images (H, W, 3), and the residual maps (H, W) after the fit by metric."""

    before: np.ndarray
    reference: np.ndarray
    after: np.ndarray
    maps: dict[str, np.ndarray]


@dataclass(frozen=True)
class Fit:
    """What a fit returns: its record, and the images of the best form."""

    record: FitRecord
    images: FitImages


@dataclass(frozen=True)
class Attempt:
    """The best fit of one form, and what :mod:`comparisons.fit.identify` says of it.

    ``paired_loss`` is the loss of the image as paired.
    """

    model: Model
    solution: Solution
    paired_loss: float
    verdicts: list
    covariance: np.ndarray

    def image(self, rendered):
        """Return the whole image, (H, W, 3)."""
        model = Model(rendered.surface, self.model.form, self.model.parameters)
        return model.image(self.solution.x).reshape(rendered.before.shape)


def departure(before, after, reference, counted, noise, viewing):
    """Return the :class:`Departure` by metric, and the metrics' maps (H, W) after the fit."""
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


def materials(attempt, normalised, physical):
    """Return what was fitted, material by material."""
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


def lights(attempt, names):
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
        reason="only products with k_d and k_s show; other lights' factors are relative to it",
    )
    others = (
        FittedLight(light=names[parameter.owner], **_parameter(attempt, place, False))
        for place, parameter in enumerate(attempt.model.parameters)
        if parameter.name == "intensity"
    )
    return (first, *others)


def physical_materials(graph):
    """Return the plain parameters of each named BSDF of the physical half."""
    found = {}
    for index in graph.nodes(mi.ObjectType.BSDF):
        label = graph.label(index)
        for _, child in graph.children(index, mi.ObjectType.BSDF):
            index = child  # of twosided, what is inside
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


def _parameter(attempt, place, normalised):
    """Return one parameter in the units of the chapters, as the fields of :class:`Fitted`."""
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


def _unnormalised(model, x, covariance, place, at_n):
    """Return ``k_s`` of an albedo and ``n``: paired, fitted, and the ends of its interval."""

    def k_s(albedo, log_n):
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


def _place_of_exponent(parameters, owner):
    (place,) = (i for i, p in enumerate(parameters) if (p.name, p.owner) == ("n", owner))
    return place


def _label(model, place):
    """Return a name of a parameter for a reader."""
    parameter = model.parameters[place]
    owner = (
        f"light {parameter.owner + 1}"
        if parameter.name == "intensity"
        else model.surface.names[parameter.owner]
    )
    return f"{parameter.name}{parameter.channel and ' ' + parameter.channel} of {owner}"
