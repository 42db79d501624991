"""Studies: comparisons over a space of parameters, one row of one dataset each.

A worker process of a cluster imports this package before anything else of fotismos.
"""

import heuristic  # noqa: F401  before Mitsuba: it finds LLVM
