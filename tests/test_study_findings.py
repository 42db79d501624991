"""The shipped study: its page says what its dataset says, and its dataset what the code gives."""

import re

import pytest

from comparisons.study import dataset, design, point, query
from heuristic.errors import InputError
from reports.charts import study_charts
from reports.run import study_files
from tests.programs import ROOT

FILE = ROOT / "studies/phong-roughplastic.toml"
PAGE = ROOT / "docs/findings.md"


@pytest.fixture(scope="module")
def shipped():
    return design.read(FILE), dataset.read(FILE.with_suffix(".parquet"))


def test_the_dataset_is_that_of_the_study(shipped):
    study, table = shipped
    assert FILE.with_suffix(".parquet").stat().st_size < 1_000_000
    assert table.schema.metadata[b"study"].decode() == study.text
    assert table["error"].null_count == len(table)
    points = [(part.name, values) for part in study.parts for values in part.points()]
    rows = table.to_pylist()
    assert [row["part"] for row in rows] == [name for name, _ in points]
    for row, (_, values) in zip(rows, points, strict=True):
        assert {name: row[name] for name in values} == values


LATER = {"ldr_flip", "hdr_flip"}
"""Metrics that are younger than the shipped dataset."""


@pytest.mark.parametrize(
    ("part", "every"), [("incidence", 50), ("by name", 80), ("profile", 1), ("lamp", 14)]
)
def test_points_computed_again_are_as_in_the_dataset(part, every, rgb, shipped):
    study, table = shipped
    wanted = {row["point"]: row for row in query.rows(table, part)}
    (chosen,) = [p for p in study.parts if p.name == part]
    for block in point.blocks(chosen)[::every]:
        for row in point.rows(block):
            for name in row.keys() - LATER:
                value, expected = row[name], wanted[row["point"]][name]
                if isinstance(value, float) and name != "exposure":
                    # The fourth digit: compilers differ, and noise floors magnify it.
                    expected = pytest.approx(expected, rel=2e-3, abs=2e-3)
                    assert value == expected, (part, name, row["point"])


def test_the_page_says_what_the_dataset_says(shipped):
    study, table = shipped
    page = study_files.page(study, FILE, PAGE)
    assert study_files.findings(study, table, page) == PAGE.read_text(encoding="utf-8")
    changed = table.set_column(
        table.column_names.index("dE2000"), table.schema.field("dE2000"), table["rmse"]
    )
    assert study_files.findings(study, changed, page) != PAGE.read_text(encoding="utf-8")


def test_each_finding_names_its_figure_and_each_figure_is_there(shipped):
    study, _ = shipped
    text = PAGE.read_text(encoding="utf-8")
    findings = re.findall(r"^- (.*?)(?=^- |^$)", text, re.MULTILINE | re.DOTALL)
    assert len(findings) >= 12
    for finding in findings:
        assert re.search(r"\(figure \d+( against figure \d+)?\)\.\s*$", finding), finding
    shown = re.findall(r"!\[Figure (\d+): .*?\]\((.*?)\)", text)
    assert [int(number) for number, _ in shown] == list(range(1, len(study.figures) + 1))
    for _, path in shown:
        assert "<svg" in (PAGE.parent / path).read_text(encoding="utf-8")


def test_every_figure_has_its_points_and_a_title(shipped):
    study, table = shipped
    for figure in study.figures:
        study_charts.check(figure, study)
        spec = study_charts.chart(figure, table, study)
        assert spec["title"]["text"] == figure["title"]
        assert len(spec["data"]["values"]) >= 12
        assert "http" not in str({key: spec[key] for key in spec if key != "$schema"})


def test_a_map_of_more_parameters_says_what_it_averages(shipped):
    study, table = shipped
    figure = {"name": "f", "title": "t", "part": "energy", "kind": "map", "x": "k_s", "y": "n",
              "values": ["dE2000"]}  # fmt: skip
    spec = study_charts.chart(figure, table, study)
    assert spec["title"]["subtitle"] == "mean over light angle"
    facts = query.Facts(table)
    for cell in spec["data"]["values"][::9]:
        mean = facts.value("energy", "dE2000", k_s=cell["x"], n=cell["y"])
        assert cell["value"] == pytest.approx(mean)


@pytest.mark.parametrize(
    ("change", "expected"),
    [
        ({"kind": "pie"}, "map, lines"),
        ({"y": None}, "lacks y"),
        ({"part": "nix"}, "part = 'nix'"),
        ({"x": "wall"}, "parameter 'wall' is not known"),
        ({"colour": "red"}, "has colour"),
    ],
)
def test_a_figure_that_cannot_be_drawn_is_refused(change, expected, shipped):
    figure = dict(shipped[0].figures[0]) | change
    figure = {key: value for key, value in figure.items() if value is not None}
    with pytest.raises(InputError, match=expected):
        study_charts.check(figure, shipped[0])


def test_facts_are_asked_for_by_what_there_is(shipped):
    facts = query.Facts(shipped[1])
    with pytest.raises(InputError, match="column 'dE1976' is not known"):
        facts.value("incidence", "dE1976")
    with pytest.raises(InputError, match="part 'x' is not known"):
        facts.value("x", "dE2000")
    with pytest.raises(InputError, match="no point"):
        facts.value("incidence", "dE2000", alpha=0.33)
