"""Fitting the parameters that a user's heuristic declares, by its derivatives.

The heuristic need not be linear in anything, so an image is a rendering: the passes of the
heuristic half, with the reference's seeds. Dr.Jit differentiates it by a parameter in forward mode,
through the user's code. A step function (``ceil``, ``select``) has no derivative; that is one more
reason to begin the search from several places.
"""

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np

from comparisons.compare import Prepared
from comparisons.fit.fit_record import Fitted
from comparisons.fit.identify import COVERAGE, identify
from comparisons.fit.loss import Loss
from comparisons.fit.optimise import Residuals, Solution, Start, descend
from comparisons.fit.parameters import Parameter
from comparisons.fit.rendering import Rendered
from comparisons.fit.summary import Attempt
from comparisons.options import Options
from heuristic.errors import InputError
from heuristic.heuristics import Heuristic
from reference.rendering.passes import pass_seed
from reference.rendering.renderer import Renderer, variant

STARTS = 6
"""Places within the bounds to start from, besides the defaults."""

FOLLOWED = 2
"""The starts of least loss that are followed to their minimum, besides the defaults."""

REACH = 4.0
"""Starts of a parameter without bounds lie within this many times its default, or its unit."""


class OwnModel:
    """The heuristic half of a scene as a function of the heuristic's own parameters.

    Parameters
    ----------
    renderer
        Of the heuristic half.
    heuristic
        Shades it.
    seeds
        Of the passes.
    counted
        (H, W), the pixels of :meth:`image`.
    """

    def __init__(
        self, renderer: Renderer, heuristic: Heuristic, seeds: list[int], counted: np.ndarray
    ) -> None:
        self.parameters = tuple(
            Parameter(each.name, 0, each.default, each.low, each.high)
            for each in heuristic.parameters
        )
        self._renderer, self._seeds, self._counted = renderer, seeds, counted
        self._images: dict[bytes, np.ndarray] = {}
        self._columns: dict[bytes, np.ndarray] = {}

    def whole(self, x: np.ndarray) -> np.ndarray:
        """Return the whole image, (H, W, 3)."""
        key = x.tobytes()
        if key not in self._images:
            self._images = {key: self._rendered(x, None)}
        return self._images[key]

    def image(self, x: np.ndarray) -> np.ndarray:
        """Return the image (N, 3) of the counted pixels."""
        return self.whole(x)[self._counted]

    def columns(self, x: np.ndarray) -> np.ndarray:
        """Return the derivatives (number of parameters, N, 3) of the image."""
        key = x.tobytes()
        if key not in self._columns:
            images = [self._rendered(x, place)[self._counted] for place in range(len(x))]
            self._columns = {key: np.stack(images)}
        return self._columns[key]

    def _rendered(self, x: np.ndarray, by: int | None) -> np.ndarray:
        """Return the mean of the passes, or of their derivatives by one parameter."""
        integrator, scene = self._renderer.integrator, self._renderer.scene
        total = np.zeros(())
        with variant(self._renderer.variant):
            values = {one.name: mi.Float(v) for one, v in zip(self.parameters, x, strict=True)}
            dr.make_opaque(values)
            integrator.parameters = values
            if by is not None:
                varied = values[self.parameters[by].name]
                dr.enable_grad(varied)
            for seed in self._seeds:
                image = integrator.render(scene, seed=dr.opaque(mi.UInt32, seed),
                                          spp=self._renderer.spp)  # fmt: skip
                if by is not None:
                    dr.set_grad(varied, 1)
                    dr.enqueue(dr.ADMode.Forward, varied)
                    dr.traverse(dr.ADMode.Forward, dr.ADFlag.ClearInterior)
                    image = dr.grad(image)
                total = total + np.array(image, float)
        return total / len(self._seeds)


@dataclass(frozen=True)
class OwnAttempt(Attempt[OwnModel]):
    """The best fit of the heuristic's own parameters."""

    def image(self, rendered: Rendered) -> np.ndarray:
        """Return the whole image, (H, W, 3)."""
        return self.model.whole(self.solution.x)

    def fitted(self) -> tuple[Fitted, ...]:
        """Return the fitted parameters."""
        return tuple(self._one(place) for place in range(len(self.model.parameters)))

    def _one(self, place: int) -> Fitted:
        parameter, verdict = self.model.parameters[place], self.verdicts[place]
        found = float(self.solution.x[place])
        spread = COVERAGE * float(np.sqrt(self.covariance[place, place]))
        low, high = parameter.low, parameter.high
        interval = max(found - spread, low), min(found + spread, high)
        return Fitted(
            name=parameter.name,
            is_factor=False,
            paired=parameter.paired,
            fitted=None if verdict.reason else found,
            stopped_at=found,
            interval=None if verdict.reason or verdict.at_bound else interval,
            bounds=(low if np.isfinite(low) else None, high if np.isfinite(high) else None),
            at_bound=verdict.at_bound,
            identifiable=not verdict.reason,
            reason=verdict.reason,
            partners=tuple(self.model.parameters[other].name for other in verdict.partners),
        )


def attempt(
    ready: Prepared, heuristic: Heuristic, rendered: Rendered, loss: Loss, options: Options
) -> OwnAttempt:
    """Fit the parameters that a heuristic declares.

    Parameters
    ----------
    ready
        The scene.
    heuristic
        Shades its heuristic half.
    rendered
        Both halves, with the parameters' defaults.
    loss
        To be minimised.
    options
        Seed and viewing.

    Raises
    ------
    InputError
        If it declares no parameters, or has no derivatives.
    """
    if not heuristic.traced:
        raise InputError(
            f"heuristic {heuristic.name} has no derivatives, which a fit needs. Write it in Python:"
            " `def shade(point, gloss: Range(0, 1) = 0.5)` has a parameter to fit."
        )
    if not heuristic.parameters:
        raise InputError(
            f"heuristic {heuristic.name} has no parameters to fit. Declare one with its bounds:"
            " `def shade(point, gloss: Range(0, 1) = 0.5)`."
        )
    counted = rendered.counted
    seeds = [pass_seed(options.seed, number) for number in range(ready.passes)]
    model = OwnModel(ready.heuristic, heuristic, seeds, counted)
    residuals = Residuals(model, rendered.reference.mean[counted], loss, options.viewing)
    solution = _minimised(residuals)
    pixels = np.full(len(model.parameters), counted.sum())
    error = rendered.difference.standard_error[counted]
    verdicts, covariance = identify(residuals, solution.x, pixels, error)
    paired_loss = residuals.loss_of(rendered.before[counted])
    return OwnAttempt(model, solution, paired_loss, verdicts, covariance)


def _minimised(residuals: Residuals) -> Solution:
    """Find the parameters of least loss, from the defaults and from places within the bounds."""
    parameters = residuals.model.parameters
    places = [np.array([each.paired for each in parameters])]
    random = np.random.default_rng(0)
    for _ in range(STARTS):
        places.append(np.array([random.uniform(*_within(each)) for each in parameters]))
    losses = [residuals.loss(place) for place in places]
    followed = {0, *(1 + np.argsort(losses[1:], kind="stable")[:FOLLOWED])}
    starts, found = [], []
    for number, (place, loss) in enumerate(zip(places, losses, strict=True)):
        if number in followed:
            x, _, before, _ = descend(residuals.smoothed(), place)
            x, least, evaluations, converged = descend(residuals, x)
            found.append((least, number, x))
            starts.append(Start(None, loss, least, evaluations + before, converged))
        else:
            starts.append(Start(None, loss))
    least, _, best = min(found)
    return Solution(best, least, tuple(starts))


def _within(parameter: Parameter) -> tuple[float, float]:
    """Return the interval in which a parameter's starts lie."""
    reach = REACH * max(abs(parameter.paired), 1.0)
    return max(parameter.low, parameter.paired - reach), min(
        parameter.high, parameter.paired + reach
    )
