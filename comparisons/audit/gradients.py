"""Check Dr.Jit's derivatives against finite differences, which share no code with them."""

from collections.abc import Callable
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from comparisons.audit.angles import checked
from comparisons.audit.audit_record import Checked, Derivative
from comparisons.audit.subject import Subject, Tuned

STEP = 0.02
"""Step of a finite difference, relative to the number."""

QUANTILE = 0.9
"""Quantile over the points: the rest may lie at kinks, where the two rightly differ."""

AGREES = 0.05
"""Largest relative difference at that quantile."""

FAINT = 1e-3
"""Derivatives below this share of the largest are judged by their absolute difference."""


NOTHING = 1e-5
"""A derivative that is below this everywhere is rounding error."""

OPPOSITE = 2.0
"""The largest possible relative difference; it also stands for derivatives that are not finite."""


def derivatives(subject: Subject) -> tuple[Derivative, ...]:
    """Compare the derivatives with respect to every number that a subject depends on."""
    return tuple(
        Derivative(by=tuned.name, difference=_disagreement(tuned)) for tuned in subject.tuned()
    )


def gradients(subject: Subject, found: tuple[Derivative, ...]) -> Checked:
    """Check that all derivatives agree."""
    expected = f"at most {AGREES} of it at {QUANTILE:.0%} of the points"
    if not found:
        return Checked(
            name="gradient", verdict="not asked", value=None, expected=expected,
            worst=subject.untuned,
        )  # fmt: skip
    worst = max(found, key=lambda each: each.difference)
    value = worst.difference
    return checked("gradient", value <= AGREES, value, expected, f"by {worst.by}")


def _disagreement(tuned: Tuned) -> float:
    automatic = _automatic(tuned)
    finite = _finite(tuned.shade, tuned.centre, len(automatic))
    size = np.maximum(np.abs(automatic), np.abs(finite))
    if not np.isfinite(size).all():
        return OPPOSITE
    if size.max() < NOTHING:
        return 0.0
    relative = np.abs(automatic - finite) / np.maximum(size, FAINT * size.max())
    return float(np.quantile(relative, QUANTILE))


def _automatic(tuned: Tuned) -> np.ndarray:
    number = mi.Float(tuned.centre)
    dr.enable_grad(number)
    value = tuned.shade(number)
    if not dr.grad_enabled(value):
        return np.zeros(dr.width(value))
    dr.set_grad(number, 1.0)
    return np.array(dr.forward_to(value), float)


def _finite(shade: Callable[[Any], Any], centre: float, count: int) -> np.ndarray:
    """Return Richardson's extrapolation of two central differences."""
    wide, narrow = (_central(shade, centre, step * centre) for step in (STEP, STEP / 2))
    return np.broadcast_to((4 * narrow - wide) / 3, count)


def _central(shade: Callable[[Any], Any], centre: float, step: float) -> np.ndarray:
    above, below = (np.array(dr.detach(shade(mi.Float(centre + h))), float) for h in (step, -step))
    return (above - below) / (2 * step)
