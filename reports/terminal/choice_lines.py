"""The answer of ``fotismos plan --within``, in a sentence with a price."""

from __future__ import annotations

from typing import TYPE_CHECKING

from comparisons.departure.metrics import METRICS
from reports.terminal.printing import number, parameter, seconds

if TYPE_CHECKING:
    from comparisons.cost.choice import Choice, Offer


def sentence(choice: Choice) -> str:
    """Return the method to take, its error and time, and the method that it replaces."""
    label = METRICS[choice.metric].label
    chosen, full = choice.chosen, choice.full
    if chosen is None:
        best = _offered(choice.best, label)
        return (
            f"No measured method stays within {label} {parameter(choice.within)}. The nearest is"
            f" {best}. Give more samples with --spp, or a larger tolerance."
        )
    if chosen.method == full.method:
        return (
            f"{_offered(chosen, label)}: nothing cheaper stays within {parameter(choice.within)}."
        )
    return f"{_offered(chosen, label)}, in place of {_offered(full, label)}."


def _offered(offer: Offer, label: str) -> str:
    once = f" and once {seconds(offer.prepare_s)} to prepare" if offer.prepare_s else ""
    return (
        f"{offer.method} with {offer.spp} samples per pixel: {label} {number(offer.error)} at"
        f" {seconds(offer.seconds)}{once}"
    )
