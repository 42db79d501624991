"""The report's section on hard cases."""

import re

import numpy as np
import pytest

from comparisons.hard import collection as hard_record
from comparisons.hard.cases import Convention, Outcome, evaluate
from comparisons.hard.collection import CASES, HardCases, Picture
from comparisons.hard.furnace import Furnace
from reports.page import hard_cases as section
from reports.page import page
from reports.run import output


@pytest.fixture
def record():
    outcomes = tuple(evaluate(case) for case in CASES[:3])
    lost = Outcome(CASES[4], np.inf, 0.5)
    picture = Picture("A highlight", np.full((4, 4), np.nan), np.ones((4, 4)))
    stated = Convention("a limit", "It is 0 & stays so.", 0.0, lambda: 1.0)
    return HardCases(
        (*outcomes, lost),
        ((stated, stated.holds()),),
        (picture,),
        (Furnace("a < model", (1.2, 1, 0.5), 0.25),),
    )


def test_a_page_without_hard_cases_has_no_such_section():
    assert 'id="hard-cases"' not in page.render([])


def test_every_case_has_its_row_and_a_violated_bound_is_said(record):
    text = page.render([], hard_cases=record)
    assert 'id="hard-cases"' in text
    for outcome in record.outcomes:
        assert outcome.case.hard in text
    assert text.count("bound violated") == 1
    assert "not finite" in text
    assert "a &lt; model" in text
    assert re.search(r"It is 0 &amp; stays so\..*?strong.>no<", text)
    assert len(re.findall(r'<img src="data:image/png;base64,', text)) == 2


def test_all_groups_of_the_catalogue_are_shown():
    assert {case.group for case in CASES} == set(section.GROUPS)


def test_the_page_is_written_with_its_hard_cases(record, tmp_path):
    output.write_page(tmp_path, [], hard_cases=record)
    assert 'id="hard-cases"' in (tmp_path / "index.html").read_text(encoding="utf-8")


def test_everything_is_collected(rgb):
    """Pictures differ where there is something to see, and every case keeps its bound."""
    record = hard_record.collect()
    assert all(outcome.holds for outcome in record.outcomes)
    assert all(holds for _, holds in record.conventions)
    for picture in record.pictures:
        assert picture.ours.shape == (hard_record.PICTURE, hard_record.PICTURE)
        assert np.isfinite(picture.ours).all()
        assert 0.02 < (picture.ours > 0.1).mean() < 0.9
        assert np.abs(np.nan_to_num(picture.naive) - picture.ours).max() > 0.05
