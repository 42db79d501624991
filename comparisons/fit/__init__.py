"""Fitting the heuristic model's parameters to the reference.

Is the model wrong, or only its parameters?
"""

import heuristic  # noqa: F401  before Mitsuba: it finds LLVM
