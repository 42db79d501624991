"""Effects of the heuristic kernel: its terms, interpolation of polygons and wavelengths."""

import mitsuba as mi

from heuristic.interpolation import Interpolation
from reference.effects.effect import Effect
from reference.planning.facts import Facts


def _coefficient(facts: Facts, name: str) -> tuple[bool, str]:
    present = name in facts.kernel_terms
    return present, f"{name} is {'not 0 in some material' if present else '0 in every material'}"


def _ambient(facts: Facts) -> tuple[bool, str]:
    if "ambient" not in facts.kernel:
        return False, "no ambient light"
    return _coefficient(facts, "k_a")


EMISSION = Effect(
    order=10,
    label="emission",
    heuristic="k_i (8.1)",
    reference="area emitters, seen",
    cost="an addition",
    rule=lambda facts: _coefficient(facts, "k_i"),
)

AMBIENT = Effect(
    order=20,
    label="ambient",
    heuristic="I_a k_a (8.2)",
    reference="see environment",
    cost="an addition",
    rule=_ambient,
)

DIFFUSE = Effect(
    order=30,
    label="diffuse",
    heuristic="k_d (N.L) (8.5)",
    reference="diffuse, or roughplastic's base",
    cost="a scalar product",
    rule=lambda facts: _coefficient(facts, "k_d"),
)

SPECULAR = Effect(
    order=40,
    label="specular",
    heuristic="k_s (R.V)^n (8.9)",
    reference="roughplastic's coat",
    cost="a vector and a power",
    rule=lambda facts: _coefficient(facts, "k_s"),
)


POLYGONS = Effect(
    order=70,
    label="polygon interpolation",
    heuristic="flat, Gouraud (6.35-6.38)",
    reference="none",
    cost="less than Phong",
    rule=lambda facts: (
        facts.interpolation is not Interpolation.PHONG,
        f"interpolation {facts.interpolation.value}",
    ),
    part="interpolation",
    colour="#f0e442",
)


SPECTRAL = Effect(
    order=140,
    label="spectral",
    noun="spectral light",
    heuristic="as many values as given (8.11)",
    reference="wavelengths",
    cost="samples, 4 values each",
    rule=lambda facts: (mi.is_spectral, f"variant {mi.variant()}"),
    part="spectral",
    colour="#882255",
    sampled=True,
)
