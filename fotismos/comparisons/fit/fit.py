"""Fitting the textbook half of a scene to its reference.

The loss at the best parameters is the *model error*: no other values would remove it. The part that
they removed is the *parameter error* of the pairing table. Both refer to the loss that was
minimised: by another metric, other parameters may be better.

For Phong's model, the forms of its lobe are fitted; for a user's heuristic, the parameters that it
declares.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import log
from time import perf_counter
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from fotismos.comparisons.departure import marks
from fotismos.comparisons.departure.criterion import share_above
from fotismos.comparisons.departure.metrics import LEADING, drawn, leading_distance
from fotismos.comparisons.departure.statistics import noise_floor, summarise
from fotismos.comparisons.fit import model
from fotismos.comparisons.fit.model import OwnModel, PhongModel
from fotismos.comparisons.fit.search import (
    LOSSES,
    Loss,
    Objective,
    bounded_minimum,
    identify,
    parameter_record,
    physical_materials,
    search,
)
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import Prepared, guarded
from fotismos.comparisons.records.departure import Summary, Viewing
from fotismos.comparisons.records.fit import (
    EXACT,
    INVISIBLE,
    FitDeparture,
    FitRecord,
    FittedMaterial,
    FormFit,
    Judgement,
)
from fotismos.heuristic.convention import Floats
from fotismos.heuristic.errors import InputError, unknown
from fotismos.heuristic.heuristics import PHONG, Interpolation, named
from fotismos.heuristic.materials import FORMS
from fotismos.heuristic.program import versions
from fotismos.reference.records import Interval, Pixels
from fotismos.reference.rendering.passes import Progress, pass_seed, passes
from fotismos.reference.rendering.renderer import variant
from fotismos.reference.rendering.sums import (
    Accumulator,
    DifferenceEstimate,
    DifferenceSums,
    Estimate,
    add_difference,
)
from fotismos.reference.scene.graph import Graph, properties
from fotismos.reference.scene.source import Source

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
class Fit:
    """A fit: its record, linear images (H, W, 3), and maps (H, W) of the best form, by metric."""

    record: FitRecord
    before: Floats
    reference: Floats
    after: Floats
    maps: dict[str, Floats]


@dataclass(frozen=True)
class RenderedHalves:
    """Both halves of a scene: the image of the paired parameters, the reference, the pixels."""

    ready: Prepared
    seeds: tuple[int, ...]
    before: Floats
    reference: Estimate
    difference: DifferenceEstimate
    counted: NDArray[np.bool_]
    viewing: Viewing

    def difference_of(self, image: Floats) -> DifferenceEstimate:
        """Return the difference of another image (H, W, 3), with no noise of its own, as passes."""
        moved = image - self.before
        grouped = self.difference.grouped
        means = grouped.means + moved.reshape(-1, 3)[grouped.places]
        return replace(
            self.difference,
            mean=self.difference.mean + moved,
            grouped=replace(grouped, means=means),
        )


def fit(
    source: Source,
    options: Options | None = None,
    loss: str = "perceptual",
    forms: Sequence[str] = FORMS,
    progress: Progress | None = None,
    command: str = "",
) -> Fit:
    """Fit the textbook half of a scene to its reference, in the current variant.

    ``loss`` is a name in :data:`fotismos.comparisons.fit.search.LOSSES`; ``forms`` are forms of the
    lobe. The resolution and samples are :data:`RESOLUTION` and :data:`SPP` if omitted. Films get a
    box filter, which keeps pixels independent. Pictures of another renderer may be the reference.
    ``progress(stage, done, total)`` is called after
    each pass; ``command`` repeats the fit, for the record.
    """
    begin = perf_counter()
    if loss not in LOSSES:
        raise unknown("loss", loss, LOSSES)
    if not forms or not set(forms) <= set(FORMS):
        raise InputError(f"forms {forms}: give one or more of {', '.join(FORMS)}.")
    options = _completed(options or Options())
    heuristic = named(options.heuristic)
    # Both halves are rendered once; every form is fitted to the same images.
    rendered = render(guarded(source.edited(filter_by_box), options), progress)
    rendering = perf_counter() - begin
    ready = rendered.ready
    if heuristic is PHONG:
        with variant(VARIANT):
            surface = model.see(ready.heuristic, rendered.seeds)
            models = [PhongModel(surface, form, rendered.counted.ravel()) for form in forms]
            fits = [_best(rendered, form_model, form_starts, LOSSES[loss]) for form_model in models]
    else:
        own_model = OwnModel(
            ready.heuristic, heuristic, seeds=rendered.seeds, counted=rendered.counted
        )
        fits = [_best(rendered, own_model, own_starts, LOSSES[loss])]
    best = min(range(len(fits)), key=lambda number: fits[number][0].loss)
    record = FitRecord(
        scene=source.name,
        variant=ready.reference.variant,
        seed=options.seed,
        resolution=rendered.counted.shape[::-1],
        spp=ready.spp,
        passes=ready.passes,
        viewing=options.viewing,
        pairing=options.pairing,
        loss={"name": loss, "unit": LOSSES[loss].unit},
        pixels=Pixels(counted=int(rendered.counted.sum()), total=rendered.counted.size),
        fits=tuple(form for form, _, _ in fits),
        best=best,
        warnings=tuple(ready.warnings()),
        versions=versions(),
        time={"rendering_s": rendering, "fitting_s": perf_counter() - begin - rendering},
        command=command,
    )
    _, after, maps = fits[best]
    return Fit(
        record=record,
        before=rendered.before,
        reference=rendered.reference.mean,
        after=after,
        maps=maps,
    )


def _completed(options: Options) -> Options:
    """Fill in a fit's own defaults."""
    options.require_model("a fit", halves=["image"])
    heuristic = named(options.heuristic)
    if heuristic is not PHONG and heuristic.is_builtin:
        raise InputError(
            f"heuristic {options.heuristic} cannot be fitted: `form` has the built-in lobes,"
            f" {' and '.join(FORMS)}. Omit `heuristic`."
        )
    if options.polygon_shading is not Interpolation.PHONG:
        raise InputError(
            f"interpolation {options.polygon_shading.value} cannot be fitted: it shades vertices or"
            " faces. Give `interpolation=phong`."
        )
    advice = "`def shade(point, gloss: Range(0, 1) = 0.5)`"
    if not heuristic.traced:
        raise InputError(
            f"heuristic {heuristic.name} has no derivatives, which a fit needs. Write it in Python:"
            f" {advice} has a parameter to fit."
        )
    if heuristic is not PHONG and not heuristic.parameters:
        raise InputError(
            f"heuristic {heuristic.name} has no parameters to fit. Declare one with its bounds:"
            f" {advice}."
        )
    # A reference that is a picture has its own size.
    resolution = options.resolution or (None if options.reference else RESOLUTION)
    spp = options.spp or SPP
    return options.changed(resolution=resolution, spp=spp, allow_empty=False)


def filter_by_box(graph: Graph) -> None:
    """Give the films of a scene a box filter."""
    for film in graph.nodes(mi.ObjectType.Film):
        for key, _ in graph.children(film, mi.ObjectType.ReconstructionFilter):
            graph.detach(film, key)
    # A sensor without a film would get Mitsuba's own, with another filter.
    for sensor in graph.nodes(mi.ObjectType.Sensor):
        if not graph.children(sensor, mi.ObjectType.Film):
            film = graph.add(mi.ObjectType.Film, properties("hdrfilm"))
            graph.attach(sensor, "film", film)
    for film in graph.nodes(mi.ObjectType.Film):
        box = graph.add(mi.ObjectType.ReconstructionFilter, properties("box"))
        graph.attach(film, "rfilter", box)


def render(ready: Prepared, progress: Progress | None) -> RenderedHalves:
    """Render the passes of both halves in turn."""
    options = ready.options
    if ready.heuristic.variant != VARIANT:
        raise InputError(
            f"variant {ready.heuristic.variant}: parameters are fitted in RGB. Give"
            f" `heuristic_variant={VARIANT}`."
        )
    difference_sums = DifferenceSums(ready.counted)
    sums = [Accumulator(), Accumulator(), difference_sums]
    halves = (ready.first, ready.second)
    for rendered in passes(halves, options.seed, ready.passes, progress=progress):
        add_difference(sums, rendered)
    before = sums[0].estimate()
    reference = sums[1].estimate()
    return RenderedHalves(
        ready=ready,
        seeds=tuple(pass_seed(options.seed, number) for number in range(ready.passes)),
        before=before.mean,
        reference=reference,
        difference=difference_sums.estimate(),
        counted=ready.counted,
        viewing=options.viewing,
    )


def _best(
    rendered: RenderedHalves,
    fitted: PhongModel | OwnModel,
    starts: Callable[[Objective], list[Floats]],
    loss: Loss,
) -> tuple[FormFit, Floats, dict[str, Floats]]:
    """Return the record of a fit, its image, and the maps of what it leaves."""
    counted = rendered.counted
    objective = Objective(
        fitted, rendered.reference.mean[counted], loss=loss, viewing=rendered.viewing
    )
    x, least, converged = search(objective, starts(objective))
    # What the image tells of each parameter, given its noise.
    pixels = np.array([fitted.reached[parameter.owner] for parameter in fitted.parameters])
    # The halves share their camera rays: noise that cancels in the difference moves no fit.
    error = rendered.difference.standard_error[counted]
    certainties, covariance = identify(objective, x, pixels=pixels, standard_error=error)
    physical = physical_materials(rendered.ready.pair.physical)
    materials = tuple(
        FittedMaterial(
            name=name,
            reference=physical.get(name),
            pixels=fitted.reached[owner],
            parameters=tuple(
                parameter_record(
                    fitted, number, x=x, certainties=certainties, covariance=covariance
                )
                for number, parameter in enumerate(fitted.parameters)
                if parameter.owner == owner
            ),
        )
        for owner, name in enumerate(fitted.names)
    )
    # The image with the best parameters, judged by every metric.
    after = fitted.whole(x).reshape(rendered.before.shape)
    by_metric, maps = departures(rendered, after)
    judged = [_judged(rendered, image) for image in (rendered.before, after)]
    left = judged[1]
    is_certain = marks.find(
        rendered.difference_of(after), after, counted, leading_distance(rendered.viewing)
    ).is_certain
    judgement: Judgement = "undecided"
    if is_certain:
        judgement = "wrong"
    elif left.low <= EXACT and left.high <= INVISIBLE:
        judgement = "right within noise"
    record = FormFit(
        form=fitted.form,
        loss=least,
        parameter_error=objective.value_of(rendered.before[counted]) - least,
        departure=by_metric,
        differ=tuple(share_above(summary.visible) for summary in judged),
        left=Interval(value=left.debiased, low=left.low, high=left.high),
        judgement=judgement,
        materials=materials,
        converged=converged,
    )
    return record, after, maps


def _judged(rendered: RenderedHalves, image: Floats) -> Summary:
    """Return the summary of an image (H, W, 3) with the paired or the fitted parameters."""
    summary, _ = summarise(
        LEADING,
        image,
        reference=rendered.reference.mean,
        mask=rendered.counted,
        viewing=rendered.viewing,
        noise=rendered.difference.noise,
        grouped=rendered.difference_of(image).grouped,
    )
    return summary


def form_starts(objective: Objective) -> list[Floats]:
    """Return the paired parameters, and lobes of several widths with coefficients that suit each.

    The latter are the best in linear RGB.
    """
    phong: Any = objective.model
    paired = model.start(phong.parameters)
    low, high = model.bounds(phong.parameters)
    at_n = np.array([parameter.name == "n" for parameter in phong.parameters])
    linear = phong.linear
    starts: list[Floats] = [paired]
    for n in STARTS:
        x = np.where(at_n, log(n * 4 if phong.form == "blinn" else n), paired)
        # At a given `n` the image is linear in its coefficients: a row (3 N,) for each.
        columns = phong.columns(x)[linear].reshape(linear.sum(), -1)
        target = (objective.reference - phong.surface.fixed[phong.counted]).ravel()
        x[linear] = bounded_minimum(
            columns @ columns.T, -columns @ target, low=low[linear], high=high[linear]
        )
        starts.append(x)
    return starts


def own_starts(objective: Objective) -> list[Floats]:
    """Return the defaults of a heuristic's parameters, and places within their bounds."""
    parameters = objective.model.parameters
    default = np.array([parameter.paired for parameter in parameters])
    reach = REACH * np.maximum(np.abs(default), 1.0)
    low, high = model.bounds(parameters)
    low = np.maximum(low, default - reach)
    high = np.minimum(high, default + reach)
    # A search expects the paired start first.
    return [default, *np.random.default_rng(0).uniform(low, high, (OWN_STARTS, len(default)))]


def departures(
    rendered: RenderedHalves, after: Floats
) -> tuple[dict[str, FitDeparture], dict[str, Floats]]:
    """Return the departures by metric, and the metrics' maps (H, W) after the fit."""
    reference = rendered.reference.mean
    counted = rendered.counted
    viewing = rendered.viewing
    by_metric = {}
    maps = {}
    for name, metric in drawn().items():
        first = metric(rendered.before, reference, viewing)
        maps[name] = metric(after, reference, viewing)
        before = metric.mean(first[counted])
        after_fit = metric.mean(maps[name][counted])
        floor = noise_floor(
            metric, reference, noise=rendered.difference.noise, mask=counted, viewing=viewing
        )
        by_metric[name] = FitDeparture(before=before, after=after_fit, noise_floor=floor)
    return by_metric, maps
