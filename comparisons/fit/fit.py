"""Fitting the heuristic half of a scene to its reference.

What is left of the loss at the best parameters is the *model error*: no values of them would remove
it. What they removed is the *parameter error* of those that the pairing table gave. Both are told
of the loss, which was minimised, and not of other metrics, of which other parameters may leave
less.

Of Phong's model the forms of its lobe are fitted; of a heuristic of a user's own the parameters
that it declares (:mod:`comparisons.fit.own_parameters`).
"""

from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np

from comparisons.compare import guarded
from comparisons.fit import own_parameters, summary
from comparisons.fit.fit_record import FitRecord, FitTimes, FormFit, LossName
from comparisons.fit.identify import identify
from comparisons.fit.loss import LOSSES
from comparisons.fit.model import Model
from comparisons.fit.optimise import Residuals, minimise
from comparisons.fit.own_parameters import OwnAttempt
from comparisons.fit.parameters import parameters
from comparisons.fit.rendering import filter_by_box, render
from comparisons.fit.summary import Attempt, Fit, FitImages
from comparisons.options import Options
from comparisons.record import guard_warnings, versions
from comparisons.records import Pixels
from heuristic.errors import InputError, unknown
from heuristic.heuristics import PHONG, named
from heuristic.interpolation import Interpolation
from heuristic.materials import FORMS

RESOLUTION = (96, 96)
SPP = 64
"""A fit is a mean over all pixels, so that fewer and noisier ones than of a comparison do."""


@dataclass(frozen=True)
class FitOptions:
    """What can be chosen about a fit, beside the rendering.

    Parameters
    ----------
    loss
        A name in :data:`comparisons.fit.loss.LOSSES`.
    forms
        Of the lobe: any of :data:`heuristic.materials.FORMS`.
    intensities
        Whether to fit the lights' intensities too, each by one factor.

    Raises
    ------
    InputError
        For an unknown loss or form, or none.
    """

    loss: str = "perceptual"
    forms: tuple[str, ...] = FORMS
    intensities: bool = False

    def __post_init__(self):
        if self.loss not in LOSSES:
            raise unknown("loss", self.loss, LOSSES)
        if not self.forms or not set(self.forms) <= set(FORMS):
            raise InputError(f"forms {self.forms} are not known: choose of {', '.join(FORMS)}.")


def fit(source, options=None, chosen=None, progress=None, command=""):
    """Fit the heuristic half of a scene to its reference, in the current variant.

    Parameters
    ----------
    source : reference.scene.source.Source
        The scene.
    options : comparisons.options.Options, optional
        What is rendered; :data:`RESOLUTION` and :data:`SPP` where it does not say. Films get a box
        filter, which keeps pixels independent.
    chosen : FitOptions, optional
        How it is fitted.
    progress : callable, optional
        Called as ``progress(stage, done, total)`` after each pass.
    command
        How to repeat the fit, for the record.

    Returns
    -------
    Fit

    Raises
    ------
    InputError
        When the scene cannot be read or paired, its heuristic half is not in RGB or not shaded by
        Phong interpolation, something can be seen through or has a texture for ``n``, or no pixel
        sees a surface.
    NonFiniteError
        When a rendering holds a NaN or an infinity.
    """
    begin = perf_counter()
    chosen = chosen or FitOptions()
    options = replace(_completed(options or Options()), allow_empty=False)
    heuristic = named(options.heuristic)
    ready = guarded(source.edited(filter_by_box), options)
    rendered = render(ready, options, progress or (lambda *_: None), heuristic is PHONG)
    rendering = perf_counter() - begin
    if heuristic is PHONG:
        attempts = [_attempt(rendered, form, chosen, options.viewing) for form in chosen.forms]
    else:
        attempts = [
            own_parameters.attempt(ready, heuristic, rendered, LOSSES[chosen.loss], options)
        ]
    best = min(range(len(attempts)), key=lambda place: attempts[place].solution.loss)
    fits, maps = _judged(ready, rendered, attempts, options.viewing, chosen.intensities)
    record = FitRecord(
        scene=source.name,
        variant=ready.reference.variant,
        seed=options.seed,
        resolution=options.resolution,
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


def _completed(options):
    """Fill in a fit's own defaults."""
    options.require_model("a fit")
    if options.heuristic != PHONG.name and named(options.heuristic).is_own:
        raise InputError(
            f"heuristic {options.heuristic} cannot be fitted: the forms of --form are fitted, phong"
            " and blinn among them. Leave --heuristic out."
        )
    if options.interpolation is not Interpolation.PHONG:
        raise InputError(
            f"interpolation {options.interpolation.value} cannot be fitted: its values are those of"
            " vertices or faces. Give --interpolation phong."
        )
    return replace(options, resolution=options.resolution or RESOLUTION, spp=options.spp or SPP)


def _attempt(rendered, form, chosen, viewing):
    loss, counted = LOSSES[chosen.loss], rendered.counted
    surface = rendered.surface.within(counted.ravel())
    wanted = parameters(surface, form, loss.sees_colour, chosen.intensities)
    model = Model(surface, form, wanted)
    residuals = Residuals(model, rendered.reference.mean[counted], loss, viewing)
    solution = minimise(residuals)
    reached = [len(np.unique(samples.pixel)) for samples in surface.samples]
    pixels = [
        counted.sum() if parameter.name == "intensity" else reached[parameter.owner]
        for parameter in wanted
    ]
    error = rendered.difference.standard_error[counted]
    verdicts, covariance = identify(residuals, solution.x, np.array(pixels), error)
    paired_loss = residuals.loss_of(rendered.before[counted])
    return Attempt(model, solution, paired_loss, verdicts, covariance)


def _judged(ready, rendered, attempts, viewing, intensities):
    """Return the fits of all attempts, and the residual maps of each attempt."""
    physical = summary.physical_materials(ready.pair.physical)
    lights = _light_names(ready.heuristic.scene) if intensities else []
    fits, maps = [], []
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


def _own_fit(attempt, name, departure):
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


def _light_names(scene):
    """Return the names of the lights that the kernel knows, in its order."""
    return [emitter.id() for emitter in scene.emitters() if hasattr(emitter, "light")]


def _form_fits(attempt, departure, physical, lights):
    """Return a form as the chapters have it, and normalised: one fit, two ``k_s``."""
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
