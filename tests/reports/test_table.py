"""One table in all forms: on a terminal, on a page, as Markdown and as CSV."""

import csv
from io import StringIO
from operator import itemgetter

import pytest
from msgspec import structs

from fotismos.comparisons.departure.metrics import THRESHOLDS
from fotismos.comparisons.records.departure import Gate, VisibleShare
from fotismos.reference.records import Interval
from fotismos.reports import cost_tables, sentences, tables
from fotismos.reports.ci import summary
from fotismos.reports.page.templating import environment
from fotismos.reports.terminal.table import Column, Piece, Table, comma_separated, markdown, printed
from tests.shared import cost_records, records
from tests.shared.pages import HOSTILE, Page

TABLE = Table(
    (
        Column("method", itemgetter(0)),
        Column("time", itemgetter(1), "{:.1f} s".format, is_right=True),
        Column("interval", itemgetter(2), "{:.2f}".format, detail="(95 %)"),
        Column("noted", itemgetter(3)),
    ),
    [
        ("direct|all", 1.25, Interval(value=1.0, low=0.5, high=1.5), None),
        ("=sum(1)", "none", (1.0, " ± ", Piece(0.125, "an eighth")), "[b]x[/b]"),
    ],
)


def page_of(table):
    macro = "{% from 'macros.html.j2' import table_of with context %}{{ table_of('T', table) }}"
    return environment().from_string(macro).render(table=table)


def test_a_terminal_and_markdown_show_numbers_in_their_form():
    assert [line.split() for line in printed(TABLE)] == [
        ["method", "time", "interval", "(95", "%)", "noted"],
        ["direct|all", "1.2", "s", "0.50", "to", "1.50", "–"],
        ["=sum(1)", "none", "1.00", "±", "an", "eighth", "[b]x[/b]"],
    ]
    assert [*markdown(TABLE)] == [
        "| method | time | interval (95 %) | noted |",
        "| --- | ---: | --- | --- |",
        "| direct\\|all | 1.2 s | 0.50 to 1.50 | – |",
        "| =sum(1) | none | 1.00 ± an eighth | [b]x[/b] |",
    ]


def test_a_page_keeps_the_numbers_in_full_and_escapes_texts():
    html = page_of(TABLE)
    assert [value for value, _ in Page(html).values] == [1.25, 0.5, 1.5, 1.0, 0.125]
    assert '<th scope="col">interval <small>(95 %)</small></th>' in html
    assert '<td class="text">[b]x[/b]</td>' in html
    hostile = page_of(Table.of([(HOSTILE,), (HOSTILE,)]))
    assert HOSTILE not in hostile
    assert Page(hostile).text.count(HOSTILE) == 2


def test_csv_has_numbers_in_full_and_no_formulas():
    plain = Table(TABLE.columns[:2], TABLE.rows)
    rows = list(csv.reader(StringIO(comma_separated(plain))))
    assert rows == [["method", "time"], ["direct|all", "1.25"], ["'=sum(1)", "none"]]


@pytest.mark.parametrize("table", [cost_tables.times, cost_tables.points, cost_tables.attribution])
def test_headings_of_costs_have_the_glossarys_sentences(table):
    known = {"time", "mean ΔE2000", "effect", "interval", "95 % interval"}
    for column in table(cost_records.study().record).columns:
        assert column.meaning or column.heading in known, column.heading


def test_a_gate_is_a_row_and_a_sentence_with_the_same_numbers():
    found = VisibleShare(threshold=2.0, value=0.4, low=0.3, high=0.5)
    gate = Gate(scene="hall", bound=0.05, visible=found, state="fail")
    (row,) = Table(summary.GATES, [gate]).texts()
    assert row == ["hall", "5.00 %", "40.0 %", "30.0 %", "50.0 %", "fail"]
    assert all(text in summary.sentence(gate) for text in row[1:])


def test_terminal_and_page_have_the_same_sentences():
    """The terminal's lines take them from the module that pages take them from."""
    for name in ("answer", "closure", "together", "judgements", "stated"):
        assert getattr(cost_tables, name) is getattr(sentences, name)


RANKED = Table(
    (
        Column("scene", itemgetter(0), fold=10),
        Column("mean", itemgetter(1), is_right=True, rank=1),
        Column("why", itemgetter(2), rank=3, fold=8),
        Column("time", itemgetter(3), rank=2),
        Column("empty", itemgetter(4), rank=9),
    ),
    [("cornell-box", "12.3", "no light between surfaces", "4 ms", "")],
)


@pytest.mark.parametrize(
    ("width", "headings", "left_out"),
    [
        (120, "scene mean why time", ""),
        (32, "scene mean why time", ""),
        (31, "scene mean time", "why: "),
        (21, "scene mean", "time, why: "),
        (9, "scene", "mean, time, why: "),
    ],
)
def test_columns_are_left_out_by_rank_where_they_do_not_fit(width, headings, left_out):
    first, *others = printed(RANKED, width)
    assert first.split() == headings.split()
    table = others[:-1] if left_out else others
    assert max(map(len, [first, *table])) <= width
    assert others[-1].startswith(left_out)
    assert (f"not in {width} characters, but in 120" in others[-1]) is bool(left_out)


@pytest.mark.parametrize("share", [0.01, 0.05, 0.4])
def test_the_table_of_scenes_fits_and_marks_what_is_undecided(share):
    """As a terminal of 120 or 80 characters shows it."""
    lead = records.summary(3.0)
    spread = 0.02 if share == 0.05 else 0.0
    shares = tuple(
        VisibleShare(threshold=t, value=share, low=share - spread, high=share + spread)
        for t in THRESHOLDS
    )
    lead = structs.replace(lead, visible=shares)
    made = [
        records.record(scene="scenes/" + "x" * length, metrics={"dE2000": lead})
        for length in (3, 90)
    ]
    for width in (120, 80):
        lines = [*printed(tables.scenes(made, 2.0), width)]
        assert max(map(len, lines)) <= width
    assert any("? 5.00 %" in line for line in lines) is (share == 0.05)
    assert ("nothing" in " ".join(printed(tables.scenes(made, 2.0)))) is (share == 0.01)
