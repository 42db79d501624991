"""The record of an audit, ``audit.json``: what holds for a shading model, and where it fails."""

from typing import Annotated, Literal

from msgspec import Meta

from comparisons.records import VERSION, Amount, Count, Record, Versions

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
    alpha
        Its roughness; None if it has none, or if it was not varied.
    seen
        Radiance seen at each angle under radiance 1 from all directions.
    returned
        Share of the light from each angle that the surface returns in all directions.
    """

    material: str
    alpha: float | None
    seen: tuple[float, ...]
    returned: tuple[float, ...]

    @property
    def kind(self) -> str:
        """The material's name without its roughness."""
        return self.material.partition(",")[0]


class Lobe(Record):
    """A material's BRDF in the plane of incidence, times pi.

    Attributes
    ----------
    material
        Name of the material.
    light
        Angle of the light from the normal, in degrees.
    values
        At ``views``; 1 for a white diffuse surface.
    """

    material: str
    light: Amount
    values: tuple[Amount, ...]


class Sunset(Record):
    """What a viewer sees as the light sets.

    Attributes
    ----------
    material, viewer
        The material, and the viewer who sees the largest jump, in words.
    values
        At ``elevations``, under a light of intensity 1.
    """

    material: str
    viewer: str
    values: tuple[Amount, ...]


class Asymmetry(Record):
    """Relative difference of ``f(l, v)`` and ``f(v, l)``, the largest over azimuths.

    Attributes
    ----------
    material
        The material with the largest difference.
    angles
        From the normal, in degrees.
    differences
        Rows are the light's angles, columns the viewer's.
    """

    material: str
    angles: tuple[Amount, ...]
    differences: tuple[tuple[Amount, ...], ...]


class Derivative(Record):
    """Dr.Jit's derivative with respect to one number, compared with finite differences.

    Attributes
    ----------
    by
        The number.
    difference
        Relative, at the quantile of points that the check states.
    """

    by: str
    difference: Amount


class Extreme(Record):
    """One of the hard cases.

    Attributes
    ----------
    case
        The case in words.
    lowest, highest
        Finite values found; None if there was none.
    wrong
        Number of values that are NaN, infinite or negative.
    worst
        The first of them; empty if there is none.
    """

    case: str
    lowest: float | None
    highest: float | None
    wrong: Count
    worst: str


class Audit(Record, kw_only=True):
    """What holds for one heuristic or BSDF."""

    record_version: int = VERSION
    subject: str
    kind: Literal["heuristic", "bsdf"]
    parameters: Annotated[dict[str, float | str], Meta(description="Those given, by name.")]
    variant: str
    angles: Annotated[tuple[Amount, ...], Meta(description="From the normal, in degrees.")]
    curves: tuple[Curve, ...]
    views: Annotated[tuple[float, ...], Meta(description="Of lobes, in degrees; the light's < 0.")]
    lobes: tuple[Lobe, ...]
    elevations: Annotated[tuple[float, ...], Meta(description="Of setting lights, in degrees.")]
    sunsets: tuple[Sunset, ...]
    asymmetry: Asymmetry
    derivatives: tuple[Derivative, ...]
    extremes: tuple[Extreme, ...]
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
