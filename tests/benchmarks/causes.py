"""The share of a comparison's CPU time that finding its causes takes, over the built-in scenes.

::

    python -m tests.benchmarks.causes [SCENE ...]
"""

import heuristic  # noqa: F401  isort: skip  finds LLVM before Mitsuba is imported

import os
import sys

from comparisons.case import Request, open_case
from comparisons.compare import compare
from comparisons.cost.cost import quick
from comparisons.gallery.builtin import SCENES

SIZE = 256


def cpu_seconds():
    """Return what this process has used so far, in user and system mode."""
    used = os.times()
    return used.user + used.system


def main(names):
    """Print a line for each scene, and the median of the shares."""
    shares = []
    for name in names or SCENES:
        case = open_case(name, Request.of({"resolution": (SIZE, SIZE)}))
        begin = cpu_seconds()
        compare(case.source, case.options)
        compared = cpu_seconds()
        quick(case.source, case.options)
        whole, causes = cpu_seconds() - begin, cpu_seconds() - compared
        shares.append(causes / whole)
        print(f"{name:20} {whole:6.1f} s, causes {causes:5.1f} s, {shares[-1]:.0%}", flush=True)
    print(f"median {sorted(shares)[len(shares) // 2]:.0%}, largest {max(shares):.0%}")


if __name__ == "__main__":
    main(sys.argv[1:])
