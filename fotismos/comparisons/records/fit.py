"""The record of a fit, ``fit.json``, and the parameters in it, in the chapters' units."""

from math import exp, isfinite, sqrt
from typing import Annotated, Any, Literal

import mitsuba as mi
import numpy as np
from msgspec import Meta

from fotismos.comparisons.departure.colour import Viewing
from fotismos.comparisons.departure.noise import VisibleShare
from fotismos.comparisons.fit.model import OwnModel, PhongModel
from fotismos.comparisons.fit.search import AT_BOUND, COVERAGE, Certainty
from fotismos.heuristic.convention import Floats
from fotismos.heuristic.terms import normalisation
from fotismos.reference.records import (
    VERSION,
    Amount,
    Count,
    Interval,
    Pixels,
    Record,
    Resolution,
    Size,
    Versions,
)
from fotismos.reference.scene.graph import Graph


class FitDeparture(Record):
    """Means of a metric over the counted pixels, with the paired and with the fitted parameters.

    The loss was minimised, not this: by this metric other parameters may be better. The noise floor
    is the mean that the reference's noise alone would give.
    """

    before: Amount
    after: Amount
    noise_floor: Amount


class FittedParameter(Record):
    """A parameter as the chapters name it, or of a heuristic's own; of a texture, factors on it."""

    name: str
    channel: Literal["", "R", "G", "B"] = ""
    is_factor: bool = False
    paired: Annotated[float, Meta(description="By the pairing table.")]
    fitted: Annotated[float | None, Meta(description="Null if the image does not determine it.")]
    interval: Annotated[
        tuple[float, float] | None,
        Meta(description="95 %, by noise; null at a bound, or if not identifiable."),
    ]
    bounds: tuple[float | None, float | None]
    at_bound: bool
    reason: Annotated[str, Meta(description="Why it is not identifiable; otherwise empty.")]
    partners: Annotated[tuple[str, ...], Meta(description="Parameters that make up for it.")] = ()


class FittedMaterial(Record):
    """A material, and the counted pixels that see it."""

    name: str
    reference: Annotated[
        dict[str, Any] | None, Meta(description="Its plugin and plain parameters there.")
    ]
    pixels: Count
    parameters: tuple[FittedParameter, ...]


Judgement = Literal["right within noise", "wrong", "undecided"]

EXACT = 0.01
INVISIBLE = 1.0
"""ΔE2000: a model is right within noise if what is left begins below the first, and ends below the
second."""


class FormFit(Record):
    """The best fit of one form of the lobe, or of the parameters of a heuristic."""

    form: Annotated[str, Meta(description="``phong`` or ``blinn``, or the heuristic.")]
    loss: Annotated[
        float, Meta(ge=0, description="At the best parameters, in its unit: the model error.")
    ]
    parameter_error: Annotated[float, Meta(description="What better parameters remove of it.")]
    departure: Annotated[dict[str, FitDeparture], Meta(description="By metric.")]
    differ: Annotated[
        tuple[VisibleShare, ...],
        Meta(description="Pixels above ΔE2000 2, with the paired and the fitted parameters."),
    ]
    left: Annotated[
        Interval, Meta(description="Mean ΔE2000 that is left beyond noise, with its interval.")
    ]
    judgement: Annotated[
        Judgement,
        Meta(
            description="`wrong` if a difference is certain somewhere, `right within noise` if none"
            " is and less than one ΔE2000 may be left, `undecided` if neither can be said."
        ),
    ]
    materials: Annotated[
        tuple[FittedMaterial, ...], Meta(description="Or the heuristic, with its own parameters.")
    ]
    converged: Annotated[bool, Meta(description="Whether the search that found them did.")]


class FitRecord(Record):
    """The heuristic parameters nearest to one scene's reference, and the remaining error."""

    record_version: int = VERSION
    scene: str
    variant: str
    seed: Count
    resolution: Resolution
    spp: Size
    passes: Size
    viewing: Viewing
    pairing: str
    loss: Annotated[dict[str, str], Meta(description="Name and unit of what was minimised.")]
    pixels: Pixels
    fits: tuple[FormFit, ...]
    best: Annotated[Count, Meta(description="Index of the form with the least loss.")]
    warnings: tuple[str, ...]
    versions: Versions
    time: dict[str, Amount]
    command: str

    @property
    def nearest(self) -> FormFit:
        """The fit of the form with the least loss."""
        return self.fits[self.best]


# --- Parameters ---------------------------------------------------------------------------------


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
