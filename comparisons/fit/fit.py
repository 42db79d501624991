"""Fitting the heuristic half of a scene to its reference.

The loss at the best parameters is the *model error*: no other values would remove it. The part that
they removed is the *parameter error* of the pairing table. Both refer to the loss that was
minimised: by another metric, other parameters may be better.

For Phong's model, the forms of its lobe are fitted; for a user's heuristic, the parameters that it
declares (:mod:`comparisons.fit.own_parameters`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from comparisons.compare import Prepared, guarded
from comparisons.departure.spaces import Viewing
from comparisons.fit import own_parameters, summary
from comparisons.fit.fit_record import FitRecord, FitTimes, FormFit, LossName
from comparisons.fit.identify import identify
from comparisons.fit.loss import LOSSES
from comparisons.fit.model import Model
from comparisons.fit.optimise import Residuals, minimise
from comparisons.fit.own_parameters import OwnAttempt
from comparisons.fit.parameters import parameters
from comparisons.fit.rendering import Rendered, filter_by_box, render
from comparisons.fit.summary import Departures, Fit, FitImages, FormAttempt
from comparisons.options import Options
from comparisons.record import guard_warnings, versions
from comparisons.records import Pixels
from heuristic.arrays import Scene
from heuristic.errors import InputError, unknown
from heuristic.heuristics import PHONG, named
from heuristic.interpolation import Interpolation
from heuristic.materials import FORMS
from reference.rendering.passes import Progress
from reference.scene.source import Source

RESOLUTION = (96, 96)
SPP = 64
"""A fit is a mean over all pixels: it needs fewer, and may have more noise, than a comparison."""


@dataclass(frozen=True)
class FitOptions:
    """Choices of a fit besides the rendering.

    Parameters
    ----------
    loss
        A name in :data:`comparisons.fit.loss.LOSSES`.
    forms
        Forms of the lobe, some of :data:`heuristic.materials.FORMS`.
    intensities
        Whether to fit the lights' intensities too, each by one factor.

    Raises
    ------
    InputError
        For an unknown loss, an unknown form, or no form.
    """

    loss: str = "perceptual"
    forms: tuple[str, ...] = FORMS
    intensities: bool = False

    def __post_init__(self):
        if self.loss not in LOSSES:
            raise unknown("loss", self.loss, LOSSES)
        if not self.forms or not set(self.forms) <= set(FORMS):
            raise InputError(f"forms {self.forms}: give one or more of {', '.join(FORMS)}.")


def fit(
    source: Source,
    options: Options | None = None,
    chosen: FitOptions | None = None,
    progress: Progress | None = None,
    command: str = "",
) -> Fit:
    """Fit the heuristic half of a scene to its reference, in the current variant.

    Parameters
    ----------
    source
        The scene.
    options
        Of the rendering; its resolution and samples are :data:`RESOLUTION` and :data:`SPP` if
        omitted. Films get a box filter, which keeps pixels independent.
    chosen
        How it is fitted.
    progress
        Called as ``progress(stage, done, total)`` after each pass.
    command
        Repeats the fit, for the record.

    Raises
    ------
    InputError
        If the scene cannot be read or paired, its heuristic half is not in RGB or not shaded by
        Phong interpolation, a material is transparent or has a texture for ``n``, or no pixel sees
        a surface.
    NonFiniteError
        If a rendering holds a NaN or an infinity.
    """
    begin = perf_counter()
    chosen = chosen or FitOptions()
    options = replace(_completed(options or Options()), allow_empty=False)
    heuristic = named(options.heuristic)
    ready = guarded(source.edited(filter_by_box), options)
    rendered = render(ready, options, progress or (lambda *_: None), heuristic is PHONG)
    rendering = perf_counter() - begin
    attempts: Sequence[FormAttempt | OwnAttempt]
    if heuristic is PHONG:
        attempts = [_attempt(rendered, form, chosen, options.viewing) for form in chosen.forms]
    else:
        loss = LOSSES[chosen.loss]
        attempts = [own_parameters.attempt(ready, heuristic, rendered, loss, options)]
    best = min(range(len(attempts)), key=lambda place: attempts[place].solution.loss)
    fits, maps = _judged(ready, rendered, attempts, options.viewing, chosen.intensities)
    record = FitRecord(
        scene=source.name,
        variant=ready.reference.variant,
        seed=options.seed,
        resolution=options.resolution or RESOLUTION,
        spp=ready.reference.spp * ready.passes,
        passes=ready.passes,
        viewing=options.viewing,
        pairing=options.convention.value,
        loss=LossName(chosen.loss, LOSSES[chosen.loss].unit),
        intensities=chosen.intensities,
        pixels=Pixels(counted=int(rendered.counted.sum()), total=rendered.counted.size),
        fits=fits,
        best=len(fits) // len(attempts) * best,
        warnings=(*ready.pair.warnings, *guard_warnings(ready.guard)),
        versions=versions(),
        time=FitTimes(rendering, perf_counter() - begin - rendering),
        command=command,
    )
    after = attempts[best].image(rendered)
    return Fit(record, FitImages(rendered.before, rendered.reference.mean, after, maps[best]))


def _completed(options: Options) -> Options:
    """Fill in a fit's own defaults."""
    options.require_model("a fit")
    if options.heuristic != PHONG.name and named(options.heuristic).is_own:
        raise InputError(
            f"heuristic {options.heuristic} cannot be fitted: --form has the built-in lobes,"
            f" {' and '.join(FORMS)}. Omit --heuristic."
        )
    if options.interpolation is not Interpolation.PHONG:
        raise InputError(
            f"interpolation {options.interpolation.value} cannot be fitted: it shades vertices or"
            " faces. Give --interpolation phong."
        )
    return replace(options, resolution=options.resolution or RESOLUTION, spp=options.spp or SPP)


def _attempt(rendered: Rendered, form: str, chosen: FitOptions, viewing: Viewing) -> FormAttempt:
    loss, counted = LOSSES[chosen.loss], rendered.counted
    assert rendered.surface, "Phong's model is fitted on the surface"
    surface = rendered.surface.within(counted.ravel())
    fitted = parameters(surface, form, loss.sees_colour, chosen.intensities)
    model = Model(surface, form, fitted)
    residuals = Residuals(model, rendered.reference.mean[counted], loss, viewing)
    solution = minimise(residuals)
    reached = [len(np.unique(samples.pixel)) for samples in surface.samples]
    pixels = [
        counted.sum() if parameter.name == "intensity" else reached[parameter.owner]
        for parameter in fitted
    ]
    error = rendered.difference.standard_error[counted]
    verdicts, covariance = identify(residuals, solution.x, np.array(pixels), error)
    paired_loss = residuals.loss_of(rendered.before[counted])
    return FormAttempt(model, solution, paired_loss, verdicts, covariance)


def _judged(
    ready: Prepared,
    rendered: Rendered,
    attempts: Sequence[FormAttempt | OwnAttempt],
    viewing: Viewing,
    intensities: bool,
) -> tuple[tuple[FormFit, ...], list[dict[str, np.ndarray]]]:
    """Return the fits of all attempts, and the residual maps of each attempt."""
    physical = summary.physical_materials(ready.pair.physical)
    lights = _light_names(ready.heuristic.scene) if intensities else []
    fits: list[FormFit] = []
    maps = []
    for attempt in attempts:
        departure, residual = summary.departure(
            rendered.before,
            attempt.image(rendered),
            rendered.reference.mean,
            rendered.counted,
            rendered.difference.noise,
            viewing,
        )
        maps.append(residual)
        if isinstance(attempt, OwnAttempt):
            fits.append(_own_fit(attempt, ready.pair.shading, departure))
        else:
            fits += _form_fits(attempt, departure, physical, lights)
    return tuple(fits), maps


def _own_fit(attempt: OwnAttempt, name: str, departure: Departures) -> FormFit:
    """Return the fit of the parameters that a heuristic declares."""
    return FormFit(
        form=name,
        normalised=False,
        loss=attempt.solution.loss,
        parameter_error=attempt.paired_loss - attempt.solution.loss,
        departure=departure,
        materials=(),
        lights=(),
        convergence=attempt.solution.starts,
        own=attempt.fitted(),
    )


def _light_names(scene: Scene) -> list[str]:
    """Return the names of the lights that the kernel knows, in its order."""
    return [emitter.id() for emitter in scene.emitters() if hasattr(emitter, "light")]


def _form_fits(
    attempt: FormAttempt, departure: Departures, physical: dict[str, dict], lights: list[str]
) -> list[FormFit]:
    """Return a form as in the chapters, and normalised: one fit, two ``k_s``."""
    return [
        FormFit(
            form=attempt.model.form,
            normalised=normalised,
            loss=attempt.solution.loss,
            parameter_error=attempt.paired_loss - attempt.solution.loss,
            departure=departure,
            materials=summary.materials(attempt, normalised, physical),
            lights=summary.lights(attempt, lights) if lights else (),
            convergence=attempt.solution.starts,
        )
        for normalised in (False, True)
    ]
