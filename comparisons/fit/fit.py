"""Fitting the heuristic half of a scene to its reference.

The loss at the best parameters is the *model error*: no other values would remove it. The part that
they removed is the *parameter error* of the pairing table. Both refer to the loss that was
minimised: by another metric, other parameters may be better.

For Phong's model, the forms of its lobe are fitted; for a user's heuristic, the parameters that it
declares.
"""

from dataclasses import dataclass
from math import exp, isfinite, log, sqrt
from time import perf_counter
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from comparisons.departure.colour import Viewing
from comparisons.departure.metrics import drawn
from comparisons.departure.statistics import noise_floor
from comparisons.fit import model, surface
from comparisons.fit.fit_record import (
    FitDeparture,
    FitRecord,
    FittedLight,
    FittedMaterial,
    FittedParameter,
    FitTimes,
    FormFit,
    LossName,
)
from comparisons.fit.model import FitParameter, OwnModel, PhongModel
from comparisons.fit.search import (
    AT_BOUND,
    COVERAGE,
    LOSSES,
    Certainty,
    Objective,
    SearchStart,
    bounded_minimum,
    identify,
    search,
)
from comparisons.options import Options
from comparisons.prepared import Prepared, guarded
from comparisons.record import versions, warnings
from heuristic.errors import InputError, unknown
from heuristic.heuristics import PHONG, Heuristic, named
from heuristic.interpolation import Interpolation
from heuristic.materials import FORMS
from heuristic.terms import normalisation
from reference.records import Pixels
from reference.rendering.passes import Progress, pass_seed, passes
from reference.rendering.renderer import variant
from reference.rendering.sums import Accumulator, Estimate, add_difference
from reference.scene.graph import Graph, properties
from reference.scene.source import Source

RESOLUTION = (96, 96)
SPP = 64
"""A fit is a mean over all pixels: it needs fewer, and may have more noise, than a comparison."""

VARIANT = "llvm_ad_rgb"

STARTS = (2.0, 8.0, 32.0, 128.0, 512.0)
"""Exponents of the form ``phong`` to start from; ``blinn`` has four times as large ones."""

OWN_STARTS = 6
"""Places within the bounds to start from for a heuristic's own parameters."""

REACH = 4.0
"""Starts of a parameter without bounds lie within this many times its default, or its unit."""


@dataclass(frozen=True)
class FitOptions:
    """Choices of a fit besides the rendering.

    ``loss`` is a name in :data:`comparisons.fit.search.LOSSES`; ``forms`` are forms of the lobe;
    with ``intensities``, those of the lights are fitted too, each by one factor.
    """

    loss: str = "perceptual"
    forms: tuple[str, ...] = FORMS
    intensities: bool = False

    def __post_init__(self):
        if self.loss not in LOSSES:
            raise unknown("loss", self.loss, LOSSES)
        if not self.forms or not set(self.forms) <= set(FORMS):
            raise InputError(f"forms {self.forms}: give one or more of {', '.join(FORMS)}.")


@dataclass(frozen=True)
class RenderedHalves:
    """Both halves of a scene: the image of the paired parameters, the reference, the pixels."""

    ready: Prepared
    seeds: tuple[int, ...]
    before: NDArray
    reference: Estimate
    difference: Estimate
    counted: NDArray[np.bool_]


@dataclass(frozen=True)
class FitImages:
    """Linear images (H, W, 3), and residual maps (H, W) after the fit, by metric."""

    before: NDArray
    reference: NDArray
    after: NDArray
    maps: dict[str, NDArray]


@dataclass(frozen=True)
class Fit:
    """A fit: its record, and the images of the best form."""

    record: FitRecord
    images: FitImages


def fit(
    source: Source,
    options: Options | None = None,
    chosen: FitOptions | None = None,
    progress: Progress | None = None,
    command: str = "",
) -> Fit:
    """Fit the heuristic half of a scene to its reference, in the current variant.

    The resolution and samples are :data:`RESOLUTION` and :data:`SPP` if omitted. Films get a box
    filter, which keeps pixels independent. ``progress(stage, done, total)`` is called after each
    pass; ``command`` repeats the fit, for the record.
    """
    begin = perf_counter()
    chosen = chosen or FitOptions()
    options = _completed(options or Options())
    heuristic = named(options.heuristic)
    rendered = _render(guarded(source.edited(filter_by_box), options), options, progress)
    rendering = perf_counter() - begin
    if heuristic is PHONG:
        with variant(VARIANT):
            seen = surface.see(rendered.ready.heuristic, rendered.seeds)
            fits = [_form_fit(rendered, seen, form, chosen, options) for form in chosen.forms]
    else:
        fits = [_own_fit(rendered, heuristic, chosen, options)]
    best = min(range(len(fits)), key=lambda place: fits[place][0].loss)
    ready = rendered.ready
    record = FitRecord(
        scene=source.name,
        variant=ready.reference.variant,
        seed=options.seed,
        resolution=options.resolution or RESOLUTION,
        spp=ready.reference.spp * ready.passes,
        passes=ready.passes,
        viewing=options.viewing,
        pairing=options.pairing,
        loss=LossName(name=chosen.loss, unit=LOSSES[chosen.loss].unit),
        intensities=chosen.intensities,
        pixels=Pixels(counted=int(rendered.counted.sum()), total=rendered.counted.size),
        fits=tuple(one for one, _ in fits),
        best=best,
        warnings=tuple(warnings(ready)),
        versions=versions(),
        time=FitTimes(rendering_s=rendering, fitting_s=perf_counter() - begin - rendering),
        command=command,
    )
    return Fit(record, fits[best][1])


def _completed(options: Options) -> Options:
    """Fill in a fit's own defaults."""
    options.require_model("a fit")
    if options.heuristic != PHONG.name and named(options.heuristic).is_own:
        raise InputError(
            f"heuristic {options.heuristic} cannot be fitted: --form has the built-in lobes,"
            f" {' and '.join(FORMS)}. Omit --heuristic."
        )
    if options.polygon_shading is not Interpolation.PHONG:
        raise InputError(
            f"interpolation {options.polygon_shading.value} cannot be fitted: it shades vertices or"
            " faces. Give --interpolation phong."
        )
    resolution, spp = options.resolution or RESOLUTION, options.spp or SPP
    return options.changed(resolution=resolution, spp=spp, allow_empty=False)


def filter_by_box(graph: Graph) -> None:
    """Give the films of a scene a box filter."""
    for film in graph.nodes(mi.ObjectType.Film):
        for key, _ in graph.children(film, mi.ObjectType.ReconstructionFilter):
            graph.detach(film, key)
    for sensor in graph.nodes(mi.ObjectType.Sensor):
        if not graph.children(sensor, mi.ObjectType.Film):
            film = graph.add(mi.ObjectType.Film, properties("hdrfilm"))
            graph.attach(sensor, "film", film)
    for film in graph.nodes(mi.ObjectType.Film):
        box = graph.add(mi.ObjectType.ReconstructionFilter, properties("box"))
        graph.attach(film, "rfilter", box)


def _render(ready: Prepared, options: Options, progress: Progress | None) -> RenderedHalves:
    """Render the passes of both halves in turn."""
    if ready.heuristic.variant != VARIANT:
        raise InputError(
            f"variant {ready.heuristic.variant}: parameters are fitted in RGB. Give"
            f" --heuristic-variant {VARIANT}."
        )
    sums = [Accumulator() for _ in range(3)]
    halves = (ready.heuristic, ready.reference)
    for one in passes(halves, options.seed, ready.passes, progress=progress):
        add_difference(sums, one.images)
    before, reference, difference = (total.estimate() for total in sums)
    seeds = tuple(pass_seed(options.seed, number) for number in range(ready.passes))
    return RenderedHalves(ready, seeds, before.mean, reference, difference, ready.counted)


def _form_fit(
    rendered: RenderedHalves,
    whole: surface.Surface,
    form: str,
    chosen: FitOptions,
    options: Options,
) -> tuple[FormFit, FitImages]:
    """Fit one form of the lobe."""
    loss, counted = LOSSES[chosen.loss], rendered.counted
    seen = whole.within(counted.ravel())
    fitted = model.parameters(seen, form, loss.sees_colour, chosen.intensities)
    phong = PhongModel(seen, form, fitted)
    objective = Objective(phong, rendered.reference.mean[counted], loss, options.viewing)
    x, least, searches = search(objective, form_starts(objective))
    reached = [len(np.unique(samples["pixel"])) for samples in seen.samples]
    pixels = [counted.sum() if p.name == "intensity" else reached[p.owner] for p in fitted]
    error = rendered.difference.standard_error[counted]
    certainties, covariance = identify(objective, x, np.array(pixels), error)
    records = [
        _phong_record(phong, place, x, certainties, covariance) for place in range(len(fitted))
    ]
    physical = physical_materials(rendered.ready.pair.physical)
    materials = tuple(
        FittedMaterial(
            name=name,
            reference=physical.get(name),
            pixels=reached[owner],
            parameters=tuple(
                one
                for one, parameter in zip(records, fitted, strict=True)
                if parameter.owner == owner and parameter.name != "intensity"
            ),
        )
        for owner, name in enumerate(seen.names)
    )
    lights = _lights(rendered.ready, fitted, records) if chosen.intensities else ()
    after = PhongModel(whole, form, fitted).image(x).reshape(rendered.before.shape)
    parts: dict[str, Any] = {"materials": materials, "lights": lights}
    return _judged(rendered, objective, least, searches, after, form=form, **parts)


def form_starts(objective: Objective) -> list[tuple[float | None, NDArray]]:
    """Return the paired parameters, and lobes of several widths with coefficients that suit each.

    The latter are the best in linear RGB.
    """
    phong: Any = objective.model
    paired, (low, high) = model.start(phong.parameters), model.bounds(phong.parameters)
    at_n = np.array([parameter.name == "n" for parameter in phong.parameters])
    linear = phong.linear
    starts: list[tuple[float | None, NDArray]] = [(None, paired)]
    for n in STARTS:
        x = np.where(at_n, log(n * 4 if phong.form == "blinn" else n), paired)
        columns = phong.columns(x)[linear].reshape(linear.sum(), -1)
        target = (objective.reference - phong.surface.fixed).ravel()
        x[linear] = bounded_minimum(
            columns @ columns.T, -columns @ target, low[linear], high[linear]
        )
        starts.append((n, x))
    return starts


def _own_fit(
    rendered: RenderedHalves, heuristic: Heuristic, chosen: FitOptions, options: Options
) -> tuple[FormFit, FitImages]:
    """Fit the parameters that a heuristic declares, from places within their bounds."""
    advice = "`def shade(point, gloss: Range(0, 1) = 0.5)`"
    if not heuristic.traced:
        raise InputError(
            f"heuristic {heuristic.name} has no derivatives, which a fit needs. Write it in Python:"
            f" {advice} has a parameter to fit."
        )
    if not heuristic.parameters:
        raise InputError(
            f"heuristic {heuristic.name} has no parameters to fit. Declare one with its bounds:"
            f" {advice}."
        )
    counted = rendered.counted
    own = OwnModel(rendered.ready.heuristic, heuristic, rendered.seeds, counted)
    reference = rendered.reference.mean[counted]
    objective = Objective(own, reference, LOSSES[chosen.loss], options.viewing)
    default = np.array([each.paired for each in own.parameters])
    reach, (low, high) = REACH * np.maximum(np.abs(default), 1.0), model.bounds(own.parameters)
    low, high = np.maximum(low, default - reach), np.minimum(high, default + reach)
    random = np.random.default_rng(0).uniform(low, high, (OWN_STARTS, len(default)))
    best, least, searches = search(objective, [(None, x) for x in (default, *random)])
    pixels = np.full(len(default), counted.sum())
    error = rendered.difference.standard_error[counted]
    certainties, covariance = identify(objective, best, pixels, error)
    spread = COVERAGE * np.sqrt(np.diag(covariance))
    records = tuple(
        _record(
            parameter,
            certainties[i],
            (parameter.paired, x, x - spread[i], x + spread[i]),
            (parameter.low, parameter.high),
            [own.parameters[other].name for other in certainties[i].partners],
        )
        for i, (parameter, x) in enumerate(zip(own.parameters, best.tolist(), strict=True))
    )
    after, name = own.whole(best), rendered.ready.pair.shading
    return _judged(rendered, objective, least, searches, after, form=name, own=records)


def _judged(
    rendered: RenderedHalves,
    objective: Objective,
    loss: float,
    starts: tuple[SearchStart, ...],
    after: NDArray,
    **parts: Any,
) -> tuple[FormFit, FitImages]:
    """Return the record of a fit, with its departures by metric, and its images."""
    before, reference, counted = rendered.before, rendered.reference.mean, rendered.counted
    by_metric, maps = departures(
        before, after, reference, counted, rendered.difference.noise, objective.viewing
    )
    record = FormFit(
        loss=loss,
        parameter_error=objective.value_of(before[counted]) - loss,
        departure=by_metric,
        convergence=starts,
        **parts,
    )
    return record, FitImages(before, reference, after, maps)


def departures(
    before: NDArray,
    after: NDArray,
    reference: NDArray,
    counted: NDArray[np.bool_],
    noise: NDArray,
    viewing: Viewing,
) -> tuple[dict[str, FitDeparture], dict[str, NDArray]]:
    """Return the departures by metric, and the metrics' maps (H, W) after the fit."""
    by_metric, maps = {}, {}
    for name, metric in drawn().items():
        first, maps[name] = (metric(image, reference, viewing) for image in (before, after))
        means = [metric.mean(values[counted]) for values in (first, maps[name])]
        by_metric[name] = FitDeparture(
            before=means[0],
            after=means[1],
            p95_after=float(np.percentile(maps[name][counted], 95)),
            noise_floor=noise_floor(metric, reference, noise, counted, viewing),
        )
    return by_metric, maps


def _lights(
    ready: Prepared, fitted: tuple[FitParameter, ...], records: list[FittedParameter]
) -> tuple[FittedLight, ...]:
    """Return the factors on the intensities of lights, relative to the first."""
    # Those that the kernel knows, in its order.
    emitters = ready.heuristic.scene.emitters()
    names = [emitter.id() for emitter in emitters if hasattr(emitter, "light")]
    if not names:
        return ()
    reason = "only its products with k_d and k_s show; other lights are relative to it"
    parameter = FitParameter("intensity", 0, 1.0, 1.0, 1.0)
    first = _record(parameter, Certainty(reason, (), False), (1.0,) * 4, (1.0, 1.0), [])
    own = [(0, first), *((p.owner, r) for p, r in zip(fitted, records, strict=True)
                         if p.name == "intensity")]  # fmt: skip
    return tuple(
        FittedLight(light=names[owner], **{k: getattr(one, k) for k in one.__struct_fields__})
        for owner, one in own
    )


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


def _phong_record(
    phong: PhongModel,
    place: int,
    x: NDArray,
    certainties: list[Certainty],
    covariance: NDArray,
) -> FittedParameter:
    """Return one parameter in the chapters' units; ``k_s`` as its material has it."""
    parameter, certainty = phong.parameters[place], certainties[place]
    albedo, spread = float(x[place]), COVERAGE * sqrt(covariance[place, place])
    raw: tuple[float, ...] = (parameter.paired, albedo, albedo - spread, albedo + spread)
    limits: tuple[float, ...] = (parameter.low, parameter.high)
    if parameter.name == "k_s" and not phong.surface.materials[parameter.owner].normalised:
        at_n, step = phong.place_of_exponent(parameter.owner), 1e-5
        per_albedo, below, above = (
            normalisation(phong.form, exp(x[at_n] + shift)) for shift in (0, -step, step)
        )
        slopes = np.zeros(len(x))
        slopes[[place, at_n]] = per_albedo, albedo * (above - below) / (2 * step)
        spread = COVERAGE * sqrt(max(slopes @ covariance @ slopes, 0))
        paired = parameter.paired * normalisation(phong.form, exp(phong.parameters[at_n].paired))
        fitted = albedo * per_albedo
        raw, limits = (paired, fitted, fitted - spread, fitted + spread), (0.0, per_albedo)
        if not certainty.reason and certainties[at_n].reason and albedo > AT_BOUND:
            reason = "follows from its albedo and n, which is not identifiable"
            certainty = Certainty(reason, (), certainty.at_bound)
    elif not parameter.is_linear:
        raw, limits = tuple(map(exp, raw)), tuple(map(exp, limits))
    partners = []
    for other in certainty.partners:
        one = phong.parameters[other]
        names = phong.surface.names
        owner = f"light {one.owner + 1}" if one.name == "intensity" else names[one.owner]
        partners.append(f"{one.name}{one.channel and ' ' + one.channel} of {owner}")
    return _record(parameter, certainty, raw, limits, partners)


def _record(
    parameter: FitParameter,
    certainty: Certainty,
    values: tuple[float, ...],
    limits: tuple[float, ...],
    partners: list[str],
) -> FittedParameter:
    """Return a parameter of which these are the paired and fitted value, and the interval."""
    paired, fitted, below, above = map(float, values)
    low, high = map(float, limits)
    has_interval = not (certainty.reason or certainty.at_bound)
    return FittedParameter(
        name=parameter.name,
        channel=parameter.channel,
        is_factor=parameter.is_factor or parameter.name == "intensity",
        paired=paired,
        fitted=None if certainty.reason else fitted,
        stopped_at=fitted,
        interval=(max(below, low), min(above, high)) if has_interval else None,
        bounds=(low if isfinite(low) else None, high if isfinite(high) else None),
        at_bound=certainty.at_bound,
        identifiable=not certainty.reason,
        reason=certainty.reason,
        partners=tuple(partners),
    )
