"""The record of an audit, ``audit.json``: what holds for a shading model, and where it fails."""

from typing import Annotated, Literal

from msgspec import Meta

from comparisons.records import VERSION, Amount, Record, Versions

Verdict = Literal["holds", "does not hold", "not asked"]


class Checked(Record):
    """One check.

    Attributes
    ----------
    name
        Name of the check.
    verdict
        ``not asked`` if the check does not apply to the subject.
    value
        The value found in the worst case; None if the check was not made.
    expected
        The condition on the value for the check to hold, in words.
    worst
        The worst case found, or why the check was not made.
    """

    name: str
    verdict: Verdict
    value: float | None
    expected: str
    worst: str


class Curve(Record):
    """How much light a white material returns, over angles from the normal.

    Attributes
    ----------
    material
        Name of the material.
    seen
        Radiance seen at each angle under radiance 1 from all directions.
    returned
        Share of the light from each angle that the surface returns in all directions.
    """

    material: str
    seen: tuple[float, ...]
    returned: tuple[float, ...]


class Audit(Record, kw_only=True):
    """What holds for one heuristic or BSDF."""

    record_version: int = VERSION
    subject: str
    kind: Literal["heuristic", "bsdf"]
    parameters: Annotated[dict[str, float | str], Meta(description="Those given, by name.")]
    variant: str
    angles: Annotated[tuple[Amount, ...], Meta(description="From the normal, in degrees.")]
    curves: tuple[Curve, ...]
    checks: tuple[Checked, ...]
    suspicions: Annotated[
        tuple[str, ...], Meta(description="Mistakes that the heuristic seems to have, in words.")
    ] = ()
    command: str
    versions: Versions

    def named(self, name: str) -> Checked:
        """Return a check by its name."""
        return next(check for check in self.checks if check.name == name)

    @property
    def is_defined(self) -> bool:
        """Whether every value computed is a finite number of 0 or more."""
        return self.named("values").verdict == "holds"
