"""A run's tables hold the records' numbers."""

import csv
import json
from io import StringIO

import pytest
from markdown_it import MarkdownIt
from msgspec import structs

from comparisons.cost.cost_record import ObjectPrice, Price
from comparisons.records import Estimated, plain
from reports.terminal import tables
from tests import cost_records, records


def two_records():
    other = records.data()
    other["scene"] = 'a "b", c | d'
    other["metrics"]["dE2000"]["mean"] = 99.5
    return [records.record(), records.of(other)]


def test_csv_holds_every_number_in_full():
    made = two_records()
    rows = list(csv.DictReader(StringIO(tables.metrics_csv(made))))
    assert len(rows) == 2 * len(made[0].metrics)
    for row in rows:
        (record,) = [each for each in made if each.scene == row["scene"]]
        metric = plain(record.metrics[row["metric"]])
        for name in ("mean", "p50", "p95", "max", "noise_floor"):
            assert float(row[name]) == metric[name]
        for part in ("after_exposure", "visible"):
            for name, value in metric[part].items():
                assert float(row[f"{part}.{name}"]) == value
        assert float(row["significant"]) == record.significant.fraction
    assert {row["visible.5"] for row in rows if row["metric"] == "rmse"} == {""}


def test_markdown_is_a_table_with_a_row_a_scene():
    text = "\n".join(tables.metrics_markdown(two_records()))
    page = MarkdownIt().enable("table").render(text)
    assert page.count("<tr>") == 3
    assert "a &quot;b&quot;, c | d" in page
    assert "4.33 (3.07; 0.0532)" in page


def test_a_study_of_cost_is_written_with_its_methods_and_prices(tmp_path):
    amount = Estimated(1.5, 1.25, 1.75)
    price = Price("occlusion", amount, -0.5, 3.0, amount, 0.0)
    found = cost_records.record()
    seconds = structs.replace(found.points[0].seconds, median=0.25, low=0.125, high=0.5)
    point = structs.replace(
        found.points[0], rung="direct", spp=4, seconds=seconds, error=12.75, error_stderr=0.03125
    )
    prices = structs.replace(found.prices, effects=(price,))
    wall = ObjectPrice("wall", 12, 0.75, 2.5, (amount,), 1.0)
    shown = structs.replace(found, points=(point,), prices=prices, objects=(wall,))
    tables.write_cost(tmp_path / "tables", "box", shown)
    read = {path.name: path.read_text("utf-8") for path in (tmp_path / "tables").glob("box*")}
    parts = ("cost", "prices", "shapes")
    assert sorted(read) == [f"box-{part}.{kind}" for part in parts for kind in ("csv", "md")]
    assert "\nwall,12,0.75,2.5,occlusion,1.5,1.25,1.75\n" in read["box-shapes.csv"]
    assert "\ndirect,4,0.25,0.125,0.5,12.75,0.03125,yes\n" in read["box-cost.csv"]
    assert "\nocclusion,1.5,1.25,1.75,-0.5,3.0,1.5\n" in read["box-prices.csv"]
    assert "| occlusion | 1.50 | 1.25 | 1.75 | −0.500 | 3.00 | 1.50 |" in read["box-prices.md"]


@pytest.mark.parametrize("colour", ["", "1"])
def test_printed_tables_hold_no_codes_and_fold_long_cells(monkeypatch, colour):
    monkeypatch.setenv("FORCE_COLOR", colour)
    lines = list(tables.printed([("scene", "rule"), ("x", "word " * 60)]))
    assert len(lines) > 2
    assert max(map(len, lines)) <= tables.WIDTH
    assert "\x1b" not in json.dumps(lines)
