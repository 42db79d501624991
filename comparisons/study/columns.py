"""The columns of a study's dataset: unit and meaning of each."""

from dataclasses import dataclass
from typing import Any, TypeAlias

from comparisons.departure.metrics import LEADING, METRICS, RATIO
from comparisons.study.scenes import PHONG, ROUGHPLASTIC, SCENES
from reference.effects import EFFECTS

Row: TypeAlias = dict[str, Any]
"""Values by column."""


@dataclass(frozen=True)
class Column:
    """A column: its unit (``1`` for pure numbers), its meaning, and its Python type."""

    unit: str
    meaning: str
    kind: type = float


STEPPED = tuple(effect for effect in EFFECTS if effect.step)
STEPS = ("form", *(effect.label for effect in STEPPED))
"""The steps between the halves, in the order in which they are added to the heuristic image: the
form of BSDFs and lights, then one effect after another."""

DIMMED = {"quarter": 1 / 4, "sixteenth": 1 / 16}
"""Further light levels at which the departure is measured: visibility depends on the level."""

LUMINANCE = "display-linear, 1 for a white diffuse surface that faces the light"
IDENTITY = {
    "part": Column("", "part of the study", str),
    "point": Column("", "number of the point in its part", int),
}
PARAMETERS = {
    name: Column(parameter.unit, parameter.meaning)
    for scene in SCENES.values()
    for name, parameter in (ROUGHPLASTIC | PHONG | scene.parameters).items()
}
MEANS = {
    "heuristic": Column("1", f"mean of the heuristic image, {LUMINANCE}"),
    "reference": Column("1", f"mean of the reference, {LUMINANCE}"),
}
CHANGES = {
    STEPS[0]: Column("1", "RMS change by the physical BSDFs and lights, without shadows"),
    **{effect.label: Column("1", f"RMS change by {effect.step}") for effect in STEPPED},
    "dominant": Column("", f"the largest of {', '.join(STEPS[:-1])} and {STEPS[-1]}", str),
    "specular_heuristic": Column(
        "1", "the heuristic's specular part (scene lobe: in the mirror direction)"
    ),
    "specular_reference": Column(
        "1", "the reference's specular part (scene lobe: in the mirror direction)"
    ),
    "albedo_heuristic": Column("1", "share of the light that the heuristic reflects"),
    "albedo_reference": Column("1", "share of the light that the reference reflects"),
    "specular_albedo_heuristic": Column("1", "share that the heuristic's specular part reflects"),
    "specular_albedo_reference": Column("1", "share that the reference's specular part reflects"),
    "peak_heuristic": Column(
        "deg", "view angle at which the heuristic's specular part peaks, in the plane of incidence"
    ),
    "peak_reference": Column(
        "deg", "view angle at which the reference's specular part peaks, in the plane of incidence"
    ),
    "miss": Column("1", "largest relative miss of the pairing, 0 if it is exact"),
    "error": Column("", "why there is no result; empty if there is one", str),
}


def results() -> dict[str, Column]:
    """Return the columns of results, including the departure in each metric."""
    name, label = LEADING.name, LEADING.label
    departure = {
        name: Column("1", LEADING.heading),
        f"{name}_p95": Column("1", f"{label}, 95th percentile"),
        f"{name}_noise": Column("1", f"{label} that the noise of the comparison alone would cause"),
        f"{name}_shape": Column("1", f"{label}, mean, after the best exposure"),
        **{
            f"{name}_{part}": Column("1", f"{label}, mean, under a {part} of the light")
            for part in DIMMED
        },
        "exposure": Column("1", f"factor on the heuristic image that minimises {label}"),
    }
    departure |= {name: Column("1", metric.heading) for name, metric in METRICS.items()}
    departure[RATIO.name] = Column(RATIO.unit, "mean ratio of luminances, heuristic to reference")
    return MEANS | departure | CHANGES
