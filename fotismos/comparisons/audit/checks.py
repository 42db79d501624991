"""The checks of an audit, and the audit itself, from a heuristic's or BSDF's values alone."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from typing import Annotated, Any, Literal, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np
from msgspec import Meta
from msgspec.structs import replace

from fotismos.comparisons.audit import closed_forms, diagnosis, furnace, samples
from fotismos.comparisons.audit.samples import Worst
from fotismos.comparisons.audit.subjects import ScatteringSubject, ShadingSubject, Subject
from fotismos.heuristic import heuristics
from fotismos.heuristic.convention import Floats
from fotismos.heuristic.errors import FotismosError, InputError
from fotismos.heuristic.program import versions
from fotismos.heuristic.user_code import error_text
from fotismos.reference.records import VERSION, Amount, Record, Versions

ANGLES = (0.0, 15.0, 30.0, 45.0, 60.0, 70.0, 80.0, 85.0, 89.0)
"""Degrees from the normal."""

LIGHTS = (0.0, 30.0, 60.0)
VIEWS = tuple(np.arange(-88.0, 89.0, 2.0).tolist())
"""Of lobes: degrees from the normal, in the plane of incidence; the light's side is negative."""

PICTURED = 0.3
"""Roughness of the lobes."""

TOLERANCE = 0.01
"""Of albedos, and of what samples carry."""

RECIPROCAL = 1e-3
"""Largest relative difference of ``f(i, o)`` and ``f(o, i)`` in single precision."""

PAIRS = 20_000

GRAZING = 1e-6
"""Sine of the light's elevation, so small that anything continuous has reached 0 there."""

JUMP = 0.01
"""In units of display white."""

DARK = 1e-5
"""What light from below may show, in units of display white."""

INCIDENT = (0.0, 45.0, 75.0)
"""Degrees at which samples are compared with the density."""

LEVEL = 0.001
"""Chance that correct densities fail, over all angles together."""

STEP = 0.02
"""Step of a finite difference, relative to the number."""

QUANTILE = 0.9
AGREES = 0.05
"""Largest relative difference at this quantile of the points: others may lie at kinks, where the
two rightly differ."""

FAINT = 1e-3
NOTHING = 1e-5
"""A derivative below FAINT times the largest is judged by its absolute difference. If all are below
NOTHING, they are rounding errors."""

OPPOSITE = 2.0
"""The largest possible relative difference; it also stands for derivatives that are not finite."""

Kind = Literal["heuristic", "bsdf"]

# --- The record, ``audit.json`` ----------------------------------------------------------------


class Checked(Record):
    """One check, with its value in the worst case, and the condition on it in words."""

    name: str
    verdict: Literal["holds", "does not hold", "not asked"]
    value: Annotated[float | None, Meta(description="Null if the check was not made.")]
    expected: str
    worst: Annotated[str, Meta(description="The worst case, or why the check was not made.")]


class MaterialCurves(Record):
    """How much light a white material returns, over angles from the normal."""

    material: str
    alpha: Annotated[float | None, Meta(description="Roughness, if it has one and was varied.")]
    seen: Annotated[tuple[float, ...], Meta(description="Radiance seen in the white furnace.")]
    returned: Annotated[tuple[float, ...], Meta(description="Share of the light from each angle.")]
    lobes: Annotated[
        tuple[tuple[Amount, ...], ...],
        Meta(description="``pi f`` in the plane of incidence, by light and view; often empty."),
    ] = ()
    single_scattering: Annotated[
        tuple[float, ...],
        Meta(description="Seen of a white metal by GGX of this ``alpha``; empty without one."),
    ] = ()


class Audit(Record):
    """What holds for one heuristic or BSDF."""

    record_version: int = VERSION
    subject: str
    kind: Kind
    parameters: Annotated[dict[str, float | str], Meta(description="The parameters that were set.")]
    variant: str
    angles: Annotated[
        tuple[Amount, ...], Meta(description="From the normal, in degrees; above 90 from behind.")
    ]
    curves: tuple[MaterialCurves, ...]
    lights: Annotated[tuple[Amount, ...], Meta(description="Of lobes, in degrees.")]
    views: Annotated[tuple[float, ...], Meta(description="Of lobes, in degrees; the light's < 0.")]
    derivatives: Annotated[
        dict[str, Amount],
        Meta(description="By each number: relative difference from finite differences."),
    ]
    checks: tuple[Checked, ...]
    faults: Annotated[
        tuple[str, ...], Meta(description="Values that light cannot have, and where.")
    ] = ()
    mistakes: Annotated[
        tuple[str, ...], Meta(description="Mistakes that the shader seems to have, in words.")
    ] = ()
    command: str
    versions: Versions

    def named(self, name: str) -> Checked:
        """Return a check by its name."""
        return next(check for check in self.checks if check.name == name)


# --- The audit ---------------------------------------------------------------------------------


def audit(
    kind: Kind, name: str, parameters: Mapping[str, Any], command: str = "", like: str | None = None
) -> Audit:
    """Make every check of a heuristic, as a comparison accepts it, or of a type of BSDF.

    In the current variant. Its lobe is compared with the closed form that it is ``like``.
    ``command`` is the one that was run, for the record.
    """
    record, _ = audit_with_subject(kind, name, parameters=parameters, command=command, like=like)
    return record


def audit_with_subject(
    kind: Kind, name: str, parameters: Mapping[str, Any], command: str, like: str | None = None
) -> tuple[Audit, Subject]:
    """Return what :func:`audit` returns, and what was audited."""
    try:
        if kind == "bsdf":
            subject: Subject = ScatteringSubject(name, parameters)
        else:
            subject = ShadingSubject(heuristics.named(name), parameters)
        record = examined(subject)
        compared = tuple(alike(subject, like)) if like else ()
    except Exception as error:  # a user's code may raise anything
        is_users = kind == "bsdf" and heuristics.in_file(name)
        if isinstance(error, FotismosError) or not is_users:
            raise
        raise InputError(f"{error_text(error)} (BSDF {name}).") from error
    named = replace(
        record,
        subject=name,
        kind=kind,
        parameters=dict(parameters),
        checks=(*record.checks, *compared),
        mistakes=diagnosis.describe(name) if kind == "heuristic" else (),
        command=command,
    )
    return named, subject


def examined(subject: Subject) -> Audit:
    """Return the record of an audit, in which the subject has no name yet."""
    curves = tuple(curve(subject, material) for material in subject.materials)
    record = Audit(
        subject="",
        kind="bsdf",
        parameters={},
        variant=mi.variant(),
        angles=subject.both_sides(ANGLES),
        curves=curves,
        lights=LIGHTS,
        views=subject.both_sides(VIEWS),
        derivatives={by: disagreement(value, shade) for by, value, shade in subject.numbers()},
        checks=(),
        command="",
        versions=versions(),
    )
    found = tuple(check.of(subject, record) for check in CHECKS)
    return replace(record, checks=found, faults=tuple(subject.faults))


def alike(subject: Subject, name: str) -> Iterator[Checked]:
    """Yield a check for each angle of the light: the lobe over that of a closed form."""
    for ratio in closed_forms.ratios(subject, name):
        source = closed_forms.CLOSED_FORMS[name].source
        holds = abs(ratio.value - 1) <= closed_forms.LARGEST_DIFFERENCE
        yield Checked(
            name=f"as {name}, light at {ratio.light:g}°",
            verdict="holds" if holds else "does not hold",
            value=ratio.value,
            expected=f"1 ± {closed_forms.LARGEST_DIFFERENCE}, over {source}",
            worst=ratio.case,
        )


def curve(subject: Subject, material: str) -> MaterialCurves:
    """Return the albedos of a white material over the angles, and its lobes."""
    response = partial(subject.response, material)
    alpha = subject.materials[material]
    eta = subject.eta
    angles = subject.both_sides(ANGLES)
    lights = LIGHTS if alpha in (None, PICTURED) else ()
    return MaterialCurves(
        material=material,
        alpha=alpha,
        seen=tuple(furnace.seen(response, angle, subject.grid, eta) for angle in angles),
        returned=tuple(furnace.returned(response, angle, subject.grid, eta) for angle in angles),
        single_scattering=tuple(
            furnace.single_scattering(alpha, min(angle, 180 - angle)) for angle in angles if alpha
        ),
        lobes=tuple(lobe(subject, material, light) for light in lights),
    )


def lobe(subject: Subject, material: str, degrees: float) -> tuple[float, ...]:
    """Return ``pi f`` at :data:`VIEWS`."""
    light = furnace.direction(np.deg2rad(-degrees), 0.0)
    view = furnace.direction(np.deg2rad(subject.both_sides(VIEWS)), 0.0)
    # The response includes the light's cosine; of its channels, the largest counts.
    return tuple((subject.response(material, light, view) / light[2]).max(axis=0).tolist())


# --- Checks ------------------------------------------------------------------------------------


class Check(NamedTuple):
    """A measurement, the bounds within which it holds, in words, and why it is not asked.

    It is made of a subject, and of the ``Audit`` with the subject's curves and derivatives.
    """

    name: str
    measure: Callable[[Subject, Audit], Worst]
    expected: str
    most: float = np.inf
    least: Callable[[Subject], float] = lambda subject: -np.inf
    unasked: Callable[[Subject, Audit], str] = lambda subject, record: ""

    def of(self, subject: Subject, record: Audit) -> Checked:
        """Make the check."""
        least = self.least(subject)
        verdict: Any = "not asked"
        value = None
        worst = self.unasked(subject, record)
        if not worst:
            value, worst = self.measure(subject, record)
            verdict = "holds" if least <= value <= self.most else "does not hold"
        expected = self.expected.format(least=least)
        return Checked(name=self.name, verdict=verdict, value=value, expected=expected, worst=worst)


def white_furnace(subject: Subject, record: Audit) -> Worst:
    """A white surface is as bright as its surroundings at every angle."""
    return max(
        ((value, f"{curve.material}, viewer at {angle:g}°")
         for curve in record.curves
         for angle, value in zip(record.angles, curve.seen, strict=True)),
        key=lambda pair: abs(pair[0] - 1),
    )  # fmt: skip


def energy(subject: Subject, record: Audit) -> Worst:
    """No more light leaves than arrives, at the worst angle."""
    return max(
        (value, f"{curve.material}, light at {angle:g}°")
        for curve in record.curves
        for angle, value in zip(record.angles, curve.returned, strict=True)
    )


def reciprocity(subject: Subject, record: Audit) -> Worst:
    """``f(i, o) = f(o, i)``, over the squares of indices, for random directions."""
    a, b = furnace.random_pairs(PAIRS, subject.eta)
    return _largest(subject, a, b, lambda s: furnace.asymmetries(s, a, b, eta=subject.eta))


def horizon(subject: Subject, record: Audit) -> Worst:
    """No value jumps as a light along x sets."""
    # Viewers on one side of the light's plane stand for those on the other.
    polar, azimuth = np.meshgrid(np.linspace(0, 80, 33), np.linspace(0, 180, 61))
    view = furnace.direction(np.deg2rad(polar.ravel()), np.deg2rad(azimuth.ravel()))
    above = np.array([[1.0], [0.0], [GRAZING]])
    below = np.array([[1.0], [0.0], [-GRAZING]])
    return _largest(subject, above, view, lambda s: np.abs(s(above, view) - s(below, view)))


def light_from_below(subject: Subject, record: Audit) -> Worst:
    """Light from behind the surface is not seen."""
    # Every combination of the light's angle, its azimuth and the viewer's angle, (3, N).
    angles = np.meshgrid(np.linspace(91, 180, 90), np.arange(0, 181, 20.0), [0.0, 30, 60, 80])
    polar, azimuth, viewer = np.deg2rad(np.stack(angles).reshape(3, -1))
    light = furnace.direction(polar, azimuth)
    view = furnace.direction(viewer, 0 * viewer)
    return _largest(subject, light, view, lambda s: s(light, view))


def _largest(
    subject: Subject, light: Floats, view: Floats, asked: Callable[[furnace.Response], Floats]
) -> Worst:
    """Return the largest value (C, N) that is asked of any material, and describe its case."""
    values = {
        material: asked(partial(subject.response, material)) for material in subject.materials
    }
    material = max(values, key=lambda name: values[name].max())
    largest = values[material].max(axis=0)
    index = int(largest.argmax())
    return float(largest[index]), f"{material}, {furnace.describe(light, view, index)}"


def gradient(subject: Subject, record: Audit) -> Worst:
    """Dr.Jit's derivatives by all numbers are right."""
    worst = max(record.derivatives, key=record.derivatives.__getitem__)
    return record.derivatives[worst], f"by {worst}"


def directions(subject: Subject, record: Audit) -> Worst:
    """The density of samples is ``pdf``, of BSDFs."""
    return min(
        (samples.p_value(subject.scattering, angle, subject.eta is not None),
         f"viewer at {angle:g}°")
        for angle in subject.both_sides(INCIDENT)
    )  # fmt: skip


def weights(subject: Subject, record: Audit) -> Worst:
    """What samples carry is ``eval`` and ``pdf``, of BSDFs."""
    deviations = [samples.worst(bsdf) for bsdf in subject.bsdfs.values()]
    return max(deviations, key=lambda deviation: deviation[0])


def values(subject: Subject, record: Audit) -> Worst:
    """Hard cases, and all values met so far, are finite and not negative."""
    for description, cases, pairs in subject.hard_cases():
        subject.note(description, cases, pairs)
    return len(subject.faults), subject.faults[0] if subject.faults else "none"


CHECKS = (
    Check(
        "white furnace", white_furnace, f"1 ± {TOLERANCE}",
        most=1 + TOLERANCE, least=lambda subject: 1 - TOLERANCE,
    ),
    Check("energy", energy, f"at most {1 + TOLERANCE}", most=1 + TOLERANCE),
    Check("reciprocity", reciprocity, f"at most {RECIPROCAL} of the mean", most=RECIPROCAL),
    Check("horizon", horizon, f"a jump of at most {JUMP}", most=JUMP),
    Check(
        "light from below", light_from_below, "0", most=DARK,
        unasked=lambda subject, record: "it transmits light" if subject.eta else "",
    ),
    Check(
        "gradient", gradient, f"at most {AGREES} of it at {QUANTILE:.0%} of the points",
        most=AGREES, unasked=lambda subject, record: "" if record.derivatives else subject.untuned,
    ),
    Check(
        "directions", directions, "p of χ² at least {least:.2g}",
        least=lambda subject: 1 - (1 - LEVEL) ** (1 / len(subject.both_sides(INCIDENT))),  # Šidák
        unasked=lambda subject, record: subject.unsampled,
    ),
    Check(
        "weights", weights, f"at most {TOLERANCE:.0%} off",
        most=TOLERANCE, unasked=lambda subject, record: subject.unsampled,
    ),
    Check("values", values, "0 cases of NaN, infinity or a negative value", most=0),
)  # fmt: skip
"""All checks, in their order: the last reports what the others met."""


# --- Derivatives against finite differences, which share no code with them ---------------------


def disagreement(centre: float, shade: Any) -> float:
    """Return how far Dr.Jit's derivative is from finite differences, at :data:`QUANTILE`."""

    def shaded(value: float) -> Floats:
        return np.array(dr.detach(shade(mi.Float(value))), float)

    number = mi.Float(centre)
    dr.enable_grad(number)
    value = shade(number)
    # A value that does not depend on the number has no derivative to forward: it stays 0.
    automatic = np.zeros(dr.width(value))
    if dr.grad_enabled(value):
        dr.set_grad(number, 1.0)
        automatic = np.array(dr.forward_to(value), float)

    # Richardson's extrapolation of two central differences.
    def central(step: float) -> Floats:
        return (shaded(centre + step) - shaded(centre - step)) / (2 * step)

    wide = central(STEP * centre)
    narrow = central(STEP / 2 * centre)
    finite = np.broadcast_to((4 * narrow - wide) / 3, len(automatic))
    # Relative to the larger of the two, a difference is at most 2.
    size = np.maximum(np.abs(automatic), np.abs(finite))
    if not np.isfinite(size).all():
        return OPPOSITE
    if size.max() < NOTHING:
        return 0.0
    relative = np.abs(automatic - finite) / np.maximum(size, FAINT * size.max())
    return float(np.quantile(relative, QUANTILE))


# --- Pictures of what is audited ----------------------------------------------------------------

SIDE = 96
FINER = 3
"""Pixels of a side, and points of each pixel's side."""

TOWARD_LIGHT = np.array([-0.5, 0.6, 0.7]) / np.linalg.norm([-0.5, 0.6, 0.7])
"""The direction to the light: from the left, above and before the sphere."""

BACKGROUND = 0.03
"""Shows where the sphere ends on its dark side."""


def spheres(subject: Subject, materials: Iterable[str]) -> dict[str, Floats]:
    """Return a linear picture (H, W, 3) of a sphere of each material under one parallel light.

    White diffuse is 1 facing the light. The viewer is far away, in the direction z.
    """
    count = SIDE * FINER
    x, y = np.meshgrid(*2 * [(2 * np.arange(count) + 1) / count - 1])
    is_hit = x**2 + y**2 < 1
    x, y = x[is_hit], -y[is_hit]
    normal = np.stack([x, y, np.sqrt(1 - x**2 - y**2)])
    # Frames whose third axis is the normal; the first is level.
    tangent = np.stack([normal[2], 0 * x, -normal[0]]) / np.hypot(normal[0], normal[2])
    frame = np.stack([tangent, np.cross(normal, tangent, axis=0), normal])
    light = np.einsum("acn,c->an", frame, TOWARD_LIGHT)
    view = frame[:, 2]
    made = {}
    for material in materials:
        whole = np.full((count, count, 3), BACKGROUND)
        whole[is_hit] = subject.response(material, light, view).T
        made[material] = whole.reshape(SIDE, FINER, SIDE, FINER, 3).mean(axis=(1, 3))
    return made
