"""The answer of ``fotismos plan --within``, in a sentence with a price, and its terms."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from comparisons.departure.metrics import METRICS
from reports.glossary import meanings
from reports.terminal.printing import number, parameter, seconds

if TYPE_CHECKING:
    from comparisons.cost.choice import Choice, Offer


def lines(choice: Choice) -> Iterator[str]:
    """Yield the sentence, then what each method in it is."""
    yield sentence(choice)
    known = meanings()
    for method in dict.fromkeys(((choice.chosen or choice.best).method, choice.full.method)):
        if method in known:
            yield f"{method}: {known[method]}"


def sentence(choice: Choice) -> str:
    """Return the method to take, its error and time, and the method that it replaces."""
    label = METRICS[choice.metric].label
    size = "x".join(map(str, choice.resolution))
    chosen, full = choice.chosen, choice.full
    if chosen is None:
        best = _offered(choice.best, label)
        return (
            f"At {size} no measured method stays within {label} {parameter(choice.within)}. The"
            f" nearest is {best}. Give more samples with --spp, or a larger tolerance."
        )
    if chosen.method == full.method:
        return (
            f"At {size}: {_offered(chosen, label)}. Nothing cheaper stays within"
            f" {parameter(choice.within)}."
        )
    return f"At {size}: {_offered(chosen, label)}, in place of {_offered(full, label)}."


def _offered(offer: Offer, label: str) -> str:
    once = f" and once {seconds(offer.prepare_s)} to prepare" if offer.prepare_s else ""
    return (
        f"{offer.method} with {offer.spp} samples per pixel: {label} {number(offer.error)} at"
        f" {seconds(offer.seconds)}{once}"
    )
