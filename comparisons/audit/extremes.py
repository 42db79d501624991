"""Check that values are finite and not negative, in hard cases and wherever a check looked."""

from comparisons.audit.angles import checked
from comparisons.audit.audit_record import Checked
from comparisons.audit.subject import Subject


def values(subject: Subject) -> Checked:
    """Check that no value, here or in the checks before, is NaN, infinite or negative."""
    for setting in subject.settings():
        subject.noted(setting.values(), setting.told)
    faults = subject.faults
    worst = f"{faults[0].value:.3g} ({faults[0].where})" if faults else "none"
    expected = "0 cases of NaN, infinity or a negative value"
    return checked("values", not faults, len(faults), expected, worst)
