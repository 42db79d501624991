"""Flat and Gouraud shading, which the heuristic kernel alone has."""

from heuristic.interpolation import Interpolation
from reference.effects.effect import Effect

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
