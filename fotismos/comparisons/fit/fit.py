"""Fitting the textbook half of a scene to its reference.

The loss at the best parameters is the *model error*: no other values would remove it. The part that
they removed is the *parameter error* of the pairing table. Both refer to the loss that was
minimised: by another metric, other parameters may be better.

For Phong's model, the forms of its lobe are fitted; for a user's heuristic, the parameters that it
declares.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from fotismos.comparisons.departure import marks
from fotismos.comparisons.departure.criterion import share_above
from fotismos.comparisons.departure.metrics import LEADING, Metric, drawn, leading_distance
from fotismos.comparisons.departure.statistics import noise_floor, summarise
from fotismos.comparisons.fit.model import OwnModel, PhongModel, see
from fotismos.comparisons.fit.search import LOSSES, Loss, Model, Objective, identify, search
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
    MEAN,
    Accumulator,
    DifferenceEstimate,
    DifferenceSums,
    add_difference,
)
from fotismos.reference.scene.graph import Graph, properties
from fotismos.reference.scene.source import Source
from fotismos.reference.scene.values import COLOURS

RESOLUTION = (96, 96)
SPP = 64
"""A fit is a mean over all pixels: it needs fewer, and may have more noise, than a comparison."""

VARIANT = "llvm_ad_rgb"


@dataclass(frozen=True)
class Fit:
    """A fit: its record, and linear images (H, W, 3)."""

    record: FitRecord
    before: Floats
    reference: Floats
    after: Floats


@dataclass(frozen=True)
class RenderedHalves:
    """Linear images (H, W, 3) of both halves, the textbook one with the paired parameters.

    ``difference`` is that of the passes, over the ``counted`` pixels (H, W).
    """

    before: Floats
    reference: Floats
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

    def departures(self, after: Floats) -> dict[str, FitDeparture]:
        """Return what is between the halves before and after a fit, by metric."""
        by_metric = {}
        for name, metric in drawn().items():

            def departure(image: Floats, metric: Metric = metric) -> float:
                return metric.mean(metric(image, self.reference, self.viewing)[self.counted])

            floor = noise_floor(
                metric,
                self.reference,
                noise=self.difference.noise,
                mask=self.counted,
                viewing=self.viewing,
            )
            by_metric[name] = FitDeparture(
                before=departure(self.before), after=departure(after), noise_floor=floor
            )
        return by_metric

    def summary(self, image: Floats) -> Summary:
        """Return the summary of an image with the paired or the fitted parameters."""
        summary, _ = summarise(
            LEADING,
            image,
            reference=self.reference,
            mask=self.counted,
            viewing=self.viewing,
            noise=self.difference.noise,
            grouped=self.difference_of(image).grouped,
        )
        return summary

    def judgement(self, after: Floats, left: Summary) -> Judgement:
        """Return whether the model is right, by the fitted image and its summary."""
        distance = leading_distance(self.viewing)
        found = marks.find(self.difference_of(after), after, self.counted, distance)
        if found.is_certain:
            return "wrong"
        is_right = left.low <= EXACT and left.high <= INVISIBLE
        return "right within noise" if is_right else "undecided"


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
    ``progress(stage, done, total)`` is called after each pass; ``command`` repeats the fit, for the
    record.
    """
    begin = perf_counter()
    if loss not in LOSSES:
        raise unknown("loss", loss, LOSSES)
    if not forms or not set(forms) <= set(FORMS):
        raise InputError(f"forms {forms}: give one or more of {', '.join(FORMS)}.")
    options = _completed(options or Options())
    heuristic = named(options.heuristic)
    # Both halves are rendered once; every form is fitted to the same images.
    ready = guarded(source.edited(filter_by_box), options)
    rendered = render(ready, progress)
    rendering = perf_counter() - begin
    counted = rendered.counted
    seeds = [pass_seed(options.seed, number) for number in range(ready.passes)]
    models: Sequence[Model]
    with variant(VARIANT):
        if heuristic is PHONG:
            surface = see(ready.heuristic, seeds)
            models = [PhongModel(surface, form, counted.ravel()) for form in forms]
        else:
            models = [OwnModel(ready.heuristic, heuristic, seeds=seeds, counted=counted)]
        physical = physical_materials(ready.pair.physical)
        fits = [_fitted(model, rendered, LOSSES[loss], physical) for model in models]
    best = min(range(len(fits)), key=lambda number: fits[number][0].loss)
    record = FitRecord(
        scene=source.name,
        variant=ready.reference.variant,
        seed=options.seed,
        resolution=counted.shape[::-1],
        spp=ready.spp,
        passes=ready.passes,
        viewing=options.viewing,
        pairing=options.pairing,
        loss={"name": loss, "unit": LOSSES[loss].unit},
        pixels=Pixels(counted=int(counted.sum()), total=counted.size),
        fits=tuple(form for form, _ in fits),
        best=best,
        warnings=tuple(ready.warnings()),
        versions=versions(),
        time={"rendering_s": rendering, "fitting_s": perf_counter() - begin - rendering},
        command=command,
    )
    return Fit(
        record=record,
        before=rendered.before,
        reference=rendered.reference,
        after=fits[best][1],
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
    # A sensor without a film would get Mitsuba's own, with another filter.
    for sensor in graph.nodes(mi.ObjectType.Sensor):
        if not graph.children(sensor, mi.ObjectType.Film):
            film = graph.add(mi.ObjectType.Film, properties("hdrfilm"))
            graph.attach(sensor, "film", film)
    for film in graph.nodes(mi.ObjectType.Film):
        for key, _ in graph.children(film, mi.ObjectType.ReconstructionFilter):
            graph.detach(film, key)
        box = graph.add(mi.ObjectType.ReconstructionFilter, properties("box"))
        graph.attach(film, "rfilter", box)


def render(ready: Prepared, progress: Progress | None) -> RenderedHalves:
    """Render the passes of both halves in turn."""
    if ready.heuristic.variant != VARIANT:
        raise InputError(
            f"variant {ready.heuristic.variant}: parameters are fitted in RGB. Give"
            f" `heuristic_variant={VARIANT}`."
        )
    difference = DifferenceSums(ready.counted)
    sums = [Accumulator(MEAN), Accumulator(MEAN), difference]
    halves = (ready.first, ready.second)
    for images in passes(halves, ready.options.seed, ready.passes, progress=progress):
        add_difference(sums, images)
    return RenderedHalves(
        before=sums[0].mean(),
        reference=sums[1].mean(),
        difference=difference.estimate(),
        counted=ready.counted,
        viewing=ready.options.viewing,
    )


def _fitted(
    model: Model, rendered: RenderedHalves, loss: Loss, physical: dict[str, dict[str, Any]]
) -> tuple[FormFit, Floats]:
    """Return the record of a fit, and its image (H, W, 3); ``physical`` maps names to materials."""
    counted = rendered.counted
    objective = Objective(model, rendered.reference[counted], loss=loss, viewing=rendered.viewing)
    x, least, converged = search(objective)
    # The halves share their camera rays: noise that cancels in the difference moves no fit.
    parameters, _ = identify(objective, x, rendered.difference.standard_error[counted])
    materials = [
        FittedMaterial(
            name=name,
            reference=physical.get(name),
            pixels=model.reached[owner],
            parameters=tuple(
                record
                for record, parameter in zip(parameters, model.parameters, strict=True)
                if parameter.owner == owner
            ),
        )
        for owner, name in enumerate(model.names)
    ]
    # The image with the best parameters, judged by every metric.
    after = model.whole(x).reshape(rendered.before.shape)
    paired = rendered.summary(rendered.before)
    left = rendered.summary(after)
    record = FormFit(
        form=model.form,
        loss=least,
        parameter_error=objective.value_of(rendered.before[counted]) - least,
        departure=rendered.departures(after),
        differ=(share_above(paired.visible), share_above(left.visible)),
        left=Interval(value=left.debiased, low=left.low, high=left.high),
        judgement=rendered.judgement(after, left),
        materials=tuple(materials),
        converged=converged,
    )
    return record, after


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
            elif isinstance(value, COLOURS):
                colour = [float(component) for component in value]
                materials[label][key] = colour[0] if len(set(colour)) == 1 else colour
    return materials
