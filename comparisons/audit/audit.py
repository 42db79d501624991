"""Audit one heuristic or BSDF, from its values alone."""

from collections.abc import Mapping
from typing import Any, Literal

import mitsuba as mi

from comparisons import record
from comparisons.audit import angles, diagnosis, extremes, gradients, profiles, scattering, shaded
from comparisons.audit.audit_record import Audit, Checked
from comparisons.audit.subject import Subject
from heuristic.heuristics import THREE

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
    return Audit(
        subject=name,
        kind=kind,
        parameters=dict(given),
        variant=mi.variant(),
        **_examined(kind, name, given),
        suspicions=diagnosis.told(name) if kind == "heuristic" else (),
        command=command,
        versions=record.versions(),
    )


def _examined(kind: Kind, name: str, given: Mapping[str, Any]) -> dict[str, Any]:
    if kind == "bsdf":
        return examined(scattering.Scattering(name, given))
    if not name.startswith(THREE):
        return examined(shaded.opened(name, given))
    from comparisons.audit import probed  # only this needs a browser

    subject = probed.Probed(name, given)
    examined(subject)  # to learn which values it takes
    subject.draw()
    return examined(subject)


def examined(subject: Subject) -> dict[str, Any]:
    """Return what an :class:`Audit` says of a subject: its checks, and the data of its charts."""
    curves = tuple(angles.curve(subject, material) for material in subject.materials)
    derivatives = gradients.derivatives(subject)
    return {
        "angles": angles.ANGLES,
        "curves": curves,
        "views": profiles.VIEWS,
        "lobes": profiles.lobes(subject),
        "elevations": profiles.ELEVATIONS,
        "sunsets": profiles.sunsets(subject),
        "asymmetry": profiles.asymmetry(subject),
        "derivatives": derivatives,
        "extremes": extremes.extremes(subject),
        "checks": (
            angles.white_furnace(curves),
            angles.energy(curves),
            angles.reciprocity(subject),
            angles.horizon(subject),
            angles.below(subject),
            gradients.gradients(subject, derivatives),
            _sampling(subject),
            extremes.values(subject),  # last: it reports what the others met
        ),
    }


def _sampling(subject: Subject) -> Checked:
    if isinstance(subject, scattering.Scattering):
        return subject.sampling()
    return Checked(
        name="sampling", verdict="not asked", value=None, expected="p of χ²",
        worst="a heuristic is not sampled",
    )  # fmt: skip
