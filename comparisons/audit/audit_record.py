"""The record of an audit, ``audit.json``: what holds for a shading model, and where it fails."""

from typing import Annotated, Literal

from msgspec import Meta

from reference.records import VERSION, Amount, Record, Versions


class Checked(Record):
    """One check.

    Attributes
    ----------
    verdict
        ``not asked`` if the check does not apply to the subject.
    value
        The value in the worst case; None if the check was not made.
    expected
        The condition on the value for the check to hold, in words.
    worst
        The worst case, or why the check was not made.
    """

    name: str
    verdict: Literal["holds", "does not hold", "not asked"]
    value: float | None
    expected: str
    worst: str


class MaterialCurves(Record):
    """How much light a white material returns, over angles from the normal.

    Attributes
    ----------
    alpha
        Its roughness; None if it has none, or if it was not varied.
    seen
        Radiance seen at each angle under radiance 1 from all directions.
    returned
        Share of the light from each angle that the surface returns in all directions.
    lobes
        ``pi f`` in the plane of incidence at ``views``, for each of ``lights``; empty for most
        roughnesses.
    """

    material: str
    alpha: float | None
    seen: tuple[float, ...]
    returned: tuple[float, ...]
    lobes: tuple[tuple[Amount, ...], ...] = ()


class Audit(Record, kw_only=True):
    """What holds for one heuristic or BSDF."""

    record_version: int = VERSION
    subject: str
    kind: Literal["heuristic", "bsdf"]
    parameters: Annotated[dict[str, float | str], Meta(description="Those given, by name.")]
    variant: str
    angles: Annotated[tuple[Amount, ...], Meta(description="From the normal, in degrees.")]
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
        tuple[str, ...], Meta(description="Mistakes that the heuristic seems to have, in words.")
    ] = ()
    command: str
    versions: Versions

    def named(self, name: str) -> Checked:
        """Return a check by its name."""
        return next(check for check in self.checks if check.name == name)
