"""Whether a shading model can be physical: furnace, reciprocity, horizon, gradients."""

import heuristic  # noqa: F401  before Mitsuba: it finds LLVM
