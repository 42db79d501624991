"""Audit one heuristic or BSDF, from its values alone."""

from collections.abc import Mapping
from typing import Any, Literal

import mitsuba as mi

from comparisons import record
from comparisons.audit import angles, diagnosis, scattering, shaded
from comparisons.audit.audit_record import Audit, Checked, Curve
from comparisons.audit.extremes import values
from comparisons.audit.gradients import gradients
from comparisons.audit.subject import Subject

Kind = Literal["heuristic", "bsdf"]


def audit(kind: Kind, name: str, given: Mapping[str, Any], command: str = "") -> Audit:
    """Make every check of a heuristic, or of a Mitsuba BSDF, in the current variant.

    Parameters
    ----------
    kind, name
        A heuristic as ``compare --heuristic`` accepts it, or the type of a BSDF.
    given
        Its parameters by name.
    command
        The command that was run, for the record.

    Raises
    ------
    InputError
        When it does not exist, does not take a parameter, or cannot be audited.
    """
    opened = shaded.opened if kind == "heuristic" else scattering.Scattering
    subject = opened(name, given)
    curves = tuple(angles.curve(subject, material) for material in subject.materials)
    return Audit(
        subject=name,
        kind=kind,
        parameters=dict(given),
        variant=mi.variant(),
        angles=angles.ANGLES,
        curves=curves,
        checks=checks_of(subject, curves),
        suspicions=diagnosis.told(name) if kind == "heuristic" else (),
        command=command,
        versions=record.versions(),
    )


def checks_of(subject: Subject, curves: tuple[Curve, ...]) -> tuple[Checked, ...]:
    """Return all checks of a subject, given the curves of its materials."""
    return (
        angles.white_furnace(curves),
        angles.energy(curves),
        angles.reciprocity(subject),
        angles.horizon(subject),
        angles.below(subject),
        gradients(subject),
        _sampling(subject),
        values(subject),  # last: it reports what the others met
    )


def _sampling(subject: Subject) -> Checked:
    if isinstance(subject, scattering.Scattering):
        return subject.sampling()
    return Checked(
        name="sampling", verdict="not asked", value=None, expected="p of χ²",
        worst="a heuristic is not sampled",
    )  # fmt: skip
