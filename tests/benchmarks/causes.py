"""The share of a comparison's CPU time that finding its causes takes, over the built-in scenes."""

import os
from statistics import median

from comparisons.case import open_case
from comparisons.compare import compare
from comparisons.cost.cost import quick
from comparisons.gallery.builtin import SCENES
from comparisons.options import Options

SIZE = 256


def cpu_seconds():
    """Return what this process has used so far, in user and system mode."""
    used = os.times()
    return used.user + used.system


def run(rounds):
    """Return CPU seconds of each scene as a whole and of its causes, from one run of each."""
    found = {}
    for name in SCENES:
        case = open_case(name, Options.of({"resolution": (SIZE, SIZE)}))
        begin = cpu_seconds()
        compare(case.source, case.options)
        compared = cpu_seconds()
        quick(case.source, case.options)
        whole, causes = cpu_seconds() - begin, cpu_seconds() - compared
        found[name] = {"whole": whole, "causes": causes}
        print(f"{name:20} {whole:6.1f} s, causes {causes:5.1f} s, {causes / whole:.0%}", flush=True)
    shares = [each["causes"] / each["whole"] for each in found.values()]
    print(f"median {median(shares):.0%}, largest {max(shares):.0%}")
    return found
