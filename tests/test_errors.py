"""Messages on words that are not known: what was given, what is allowed, and what may be meant."""

import pytest

from comparisons.fit.fit import fit
from comparisons.gallery.builtin import builtin
from comparisons.study import design
from heuristic.errors import InputError, unknown
from heuristic.materials import check_form

STUDY = """
[[part]]
scene = "lobe"
[part.parameters]
alfa = [0.1, 0.2]
"""


def test_a_word_that_is_not_known_is_told_with_what_is_allowed():
    message = str(unknown("form =", "cook", ["phong", "blinn"]))
    assert message == "form = 'cook' is not known: choose one of phong, blinn."
    message = str(unknown("form =", "blin", ["phong", "blinn"]))
    assert message.startswith("form = 'blin' is not known (did you mean blinn?): choose one of")
    assert "did you mean" not in str(unknown("n =", None, ["phong"]))


@pytest.mark.parametrize(
    ("ask", "meant"),
    [
        (lambda: builtin("cornel-box"), "cornell-box"),
        (lambda: check_form("Phong"), "phong"),
        (lambda: fit(builtin("fig-8-9").source(), loss="perceptive"), "perceptual"),
        (lambda: design.parse(STUDY), "alpha"),
    ],
)
def test_the_nearest_word_is_suggested(ask, meant):
    with pytest.raises(InputError, match=rf"did you mean {meant}\?"):
        ask()
