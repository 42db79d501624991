"""Names and defaults of integrators and samplers, which records hold."""

PATHS = ("path", "volpath", "volpathmis")
"""Integrators with the same light as the reference: all paths up to a length."""

STOCK_RR_DEPTH = 5
"""Where Mitsuba's integrators begin to end paths at random."""

RR_DEPTH = 3
"""The same for ``direct_all``. Ending paths two reflections sooner saves a sixth of the time and
adds a tenth of the variance, on the Cornell box and on glossy spheres alike; the mean stays."""

SAMPLER = "rotated_multijitter"
STOCK_SAMPLER = "independent"
"""The sampler of Mitsuba's examples."""
