"""Whether metrics rank scenes alike: rank correlations over the scenes of a run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from comparisons.comparison import ComparisonRecord
from comparisons.departure.metrics import METRICS

#: Fewest scenes for a meaningful ranking.
FEWEST = 4


@dataclass(frozen=True)
class Agreement:
    """How two metrics rank scenes, from −1 (opposite) over 0 (unrelated) to 1 (alike).

    Attributes
    ----------
    spearman
        Correlation of the ranks.
    kendall
        Share of the pairs of scenes in the same order, minus the share in opposite order
        (τ_b, which leaves ties out).
    """

    spearman: float
    kendall: float


def rankings(records: Sequence[ComparisonRecord]) -> dict[str, dict[str, Agreement]]:
    """Return the agreement of each pair of metrics on means without noise, by their names.

    Empty for fewer than `FEWEST` scenes. A metric with the same value in all scenes ranks nothing,
    and is left out.
    """
    if len(records) < FEWEST:
        return {}
    from scipy.stats import kendalltau, spearmanr  # takes a second to import

    values = {name: [r.metrics[name].debiased for r in records] for name in METRICS}
    values = {name: means for name, means in values.items() if np.ptp(means) > 0.0}
    return {
        one: {
            other: Agreement(
                float(spearmanr(values[one], values[other]).statistic),
                float(kendalltau(values[one], values[other]).statistic),
            )
            for other in values
        }
        for one in values
    }
