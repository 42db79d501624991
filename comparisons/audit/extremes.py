"""Check that values are finite and not negative, in hard cases and wherever a check looked."""

import numpy as np

from comparisons.audit.angles import checked
from comparisons.audit.audit_record import Checked, Extreme
from comparisons.audit.subject import Setting, Subject


def extremes(subject: Subject) -> tuple[Extreme, ...]:
    """Evaluate all hard cases of a subject."""
    return tuple(_extreme(subject, setting) for setting in subject.settings())


def _extreme(subject: Subject, setting: Setting) -> Extreme:
    values = setting.values()
    wrong = subject.noted(values, setting.told)
    finite = values[np.isfinite(values)]
    return Extreme(
        case=setting.words,
        lowest=float(finite.min()) if finite.size else None,
        highest=float(finite.max()) if finite.size else None,
        wrong=wrong,
        worst=subject.faults[-1].told() if wrong else "",
    )


def values(subject: Subject) -> Checked:
    """Check that no value met so far is NaN, infinite or negative."""
    faults = subject.faults
    worst = faults[0].told() if faults else "none"
    expected = "0 cases of NaN, infinity or a negative value"
    return checked("values", not faults, len(faults), expected, worst)
