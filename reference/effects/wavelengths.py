"""Light of many wavelengths, which a spectral variant of Mitsuba follows."""

import mitsuba as mi

from reference.effects.effect import Effect

SPECTRAL = Effect(
    order=140,
    label="spectral",
    heuristic="as many values as given (8.11)",
    reference="wavelengths",
    cost="samples, 4 values each",
    rule=lambda facts: (mi.is_spectral, f"variant {mi.variant()}"),
    part="spectral",
    colour="#882255",
    sampled=True,
)
