"""The reference against closed forms, at the samples that commands take, case by case."""

import numpy as np
import pytest

from tests.witnesses import corners, furnaces, lamps
from tests.witnesses.witness import deviation

WITNESSES = (*lamps.WITNESSES, *corners.WITNESSES, *furnaces.WITNESSES)
BIAS = 3e-3

QUICK = ("below a rectangular lamp", "flux", "furnace: diffuse")
"""Parts of names of cases of the quick tier."""

cases = pytest.mark.parametrize(
    "witness",
    [
        pytest.param(
            witness,
            id=witness.name,
            marks=() if any(part in witness.name for part in QUICK) else pytest.mark.thorough,
        )
        for witness in WITNESSES
    ],
)


def require_agreement(found):
    np.testing.assert_array_less(np.abs(found.value), found.half_width)


@pytest.mark.guarantee("reference", "The reference matches 25 closed forms; a bias of 0.3 % fails.")
@cases
def test_the_reference_is_the_closed_form(rgb, witness):
    """In the mean over the image, known to the stated precision, and over its blocks."""
    found = deviation(witness)
    assert found.half_width[0] < witness.precision
    require_agreement(found)
    for factor in (1 - BIAS, 1 + BIAS):
        with pytest.raises(AssertionError):
            require_agreement(deviation(witness, factor=factor))


@pytest.mark.slow
@pytest.mark.parametrize("witness", WITNESSES, ids=lambda witness: witness.name)
def test_so_is_the_reference_that_leaves_nothing_out(rgb, witness):
    require_agreement(deviation(witness, everything=True))
