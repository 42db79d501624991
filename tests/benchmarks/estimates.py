"""How often intervals hold the truth, and how often verdicts are right, by kind of noise.

Run it as ``python -m tests.benchmarks.estimates 24``: so many draws of each kind, count of
replicates and share. It needs NumPy alone.
"""

import sys
from collections import defaultdict

import numpy as np

from fotismos.comparisons.departure.criterion import LIMIT, decide, share_above
from fotismos.comparisons.departure.estimate import estimate
from fotismos.comparisons.departure.metrics import LEADING
from tests.shared.noisy_pairs import COUNTS, KINDS, SHARES, pair

HEADER = f"{'':16}  mean % share % wrong % | undecided % at " + ", ".join(map(str, SHARES))


def rows(draws):
    """Yield kind, count, share, and what held: mean, share, right, decided."""
    for kind in KINDS:
        for count in COUNTS:
            for share in SHARES:
                for number in range(draws):
                    seed = [KINDS.index(kind), count, int(1000 * share), number]
                    replicates, distances = pair(kind, count, share, np.random.default_rng(seed))
                    found = estimate(LEADING, replicates)
                    true = float((distances > 2).mean())
                    of_two = share_above(found.visible, 2.0)
                    verdict = decide(found.visible)
                    yield (
                        kind,
                        count,
                        share,
                        found.mean.low - 1e-4 <= distances.mean() <= found.mean.high + 1e-4,
                        of_two.low - 1e-9 <= true <= of_two.high + 1e-9,
                        verdict == ("fail" if true <= LIMIT else "pass"),
                        verdict == "undecided",
                    )


def line(name, found):
    """Return a row of the table."""
    held = 100 * np.mean([row[3:6] for row in found], axis=0)
    open_ = [100 * np.mean([row[6] for row in found if row[2] == share]) for share in SHARES]
    return f"{name:16} {held[0]:7.1f} {held[1]:7.1f} {held[2]:7.1f} | " + " ".join(
        f"{percent:7.1f}" for percent in open_
    )


def main():
    """Print the table."""
    found = list(rows(int(sys.argv[1])))
    groups = defaultdict(list)
    for row in found:
        groups[row[0]].append(row)
        groups[f"{row[1]} replicates"].append(row)
    print(HEADER)
    for name, group in groups.items():
        print(line(name, group))
    print(line("all", found))


if __name__ == "__main__":
    main()
