"""The share of a comparison's time that finding its causes takes, over the built-in scenes."""

from statistics import median

from comparisons.case import open_case
from comparisons.compare import compare
from comparisons.gallery.builtin import SCENES
from comparisons.options import Options

SIZE = 256


def run(rounds):
    """Return the shares of causes in the time of each scene's comparison, from one run of each."""
    found = {}
    for name in SCENES:
        case = open_case(name, Options.of({"resolution": (SIZE, SIZE)}))
        record = compare(case.source, case.options, why=True).record
        found[name] = record.time.share_of_causes
        print(f"{name:20} causes {found[name]:.0%}", flush=True)
    print(f"median {median(found.values()):.0%}, largest {max(found.values()):.0%}")
    return found
