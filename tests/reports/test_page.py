"""The record's schema, and the page: its numbers are the record's and it loads nothing."""

import copy
import json
import re
from collections import Counter

import jsonschema
import numpy as np
import pytest
from PIL import Image

from fotismos.comparisons.departure.metrics import METRICS, THRESHOLDS, drawn
from fotismos.comparisons.ladder.methods import BUILT_IN
from fotismos.reference.planning.effects import EFFECTS
from fotismos.reference.records import Machine
from fotismos.reports import glossary, verdict
from fotismos.reports.files import images as files
from fotismos.reports.files.results import Failure, RunRecord
from fotismos.reports.page import embedding, page, templating
from fotismos.reports.terminal import words
from tests.shared import records
from tests.shared.pages import HOSTILE, Page
from tests.shared.schemas import schema

SCHEMA = schema("comparison")


@pytest.fixture
def record():
    return records.data()


CHANNELS = (
    {f"{half}.{c}": np.ones((4, 6)) for half in ("heuristic", "reference") for c in "RGB"}
    | {f"reference_stderr.{colour}": np.zeros((4, 6)) for colour in "RGB"}
    | {f"{name}.Y": np.ones((4, 6)) for name in (*drawn(), "significant")}
)


@pytest.fixture
def pictures():
    return embedding.embed(CHANNELS, np.ones((4, 6), bool))


def numbers_in(node):
    if isinstance(node, dict):
        return [n for item in node.values() for n in numbers_in(item)]
    if isinstance(node, list | tuple):
        return [n for item in node for n in numbers_in(item)]
    return [node] if isinstance(node, int | float) and not isinstance(node, bool) else []


def test_the_schema_is_valid_and_accepts_a_record(record):
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    jsonschema.Draft202012Validator(SCHEMA).validate(record)


def data_of(html):
    return json.loads(re.search(r'id="page-data">(.*?)</script>', html, re.DOTALL)[1])


def test_the_numbers_on_the_page_are_the_records(record, pictures):
    html = page.render([records.view(record, embedded=pictures)])
    shown, (scene,) = Page(html), data_of(html)["scenes"]
    visible = {name: metric.pop("visible") for name, metric in record["metrics"].items()}
    assert scene["shares"] == [round(share["value"], 5) for share in visible["dE2000"]]
    assert len(scene["verdicts"]) == len(scene["shares"]) == len(THRESHOLDS)
    keys = ("metrics", "log2_luminance", "viewing", "pixels", "pairing", "time")
    parts = [record[key] for key in keys]
    parts += [(region["share"], region["mean_dE2000"]) for region in record["regions"]]
    missing = {*numbers_in(parts)} - {value for value, _ in shown.values}
    assert not missing
    assert ("4.33", 4.327) in {(text, value) for value, text in shown.values}
    assert ("2.79 s", 2.79) in {(text, value) for value, text in shown.values}
    for text in ("Seed 7", "unlimited depth", "256 samples per pixel", "k_d > 0", "mitsuba 3.9.1"):
        assert text in shown.text
    (unrepresentable,) = record["unrepresentable"]
    for text in (*unrepresentable.values(), *record["warnings"], record["command"]):
        assert text in shown.text


def test_texts_hold_from_the_threshold_at_which_they_begin(record):
    """What the script shows at each threshold is what the rules say there."""
    other = copy.deepcopy(record) | {"scene": "right"}
    for share in other["metrics"]["dE2000"]["visible"]:
        share |= dict.fromkeys(("value", "low", "high"), 0.5 if share["threshold"] < 3 else 0.01)
    views = [records.view(record), records.view(other)]
    data = data_of(page.render(views))
    for place, threshold in enumerate(THRESHOLDS):
        expected = verdict.headline([view.record for view in views], threshold)
        assert templating.text_at(data["headlines"], place) == expected
        for scene in data["scenes"]:
            (one,) = (view.record for view in views if view.record.scene == scene["name"])
            advice = verdict.sentence(one, None, threshold)
            assert templating.text_at(scene["advice"], place) == advice
            assert scene["verdicts"][place] == verdict.decision(one, threshold)[0]
    assert len(data["headlines"]) > 1


def test_the_page_loads_nothing_and_escapes_everything(record, pictures):
    record |= {"scene": HOSTILE, "variant": HOSTILE, "warnings": [HOSTILE]}
    record["command"] = f"fotismos compare '{HOSTILE.replace(chr(39), '')}'"
    record["unrepresentable"] = [dict.fromkeys(record["unrepresentable"][0], HOSTILE)]
    record["versions"] = {HOSTILE: HOSTILE}
    record["plan"]["effects"][0]["rule"] = HOSTILE
    record["regions"][0]["effect"] = HOSTILE
    record["pairing"]["bsdfs"][0]["parameters"][HOSTILE] = {HOSTILE: [HOSTILE]}
    record["pairing"]["misses"][0]["what"] = HOSTILE
    html = page.render(
        [records.view(record, embedded=pictures, files={HOSTILE: "javascript:" + HOSTILE})],
        failures=[Failure(scene=HOSTILE, error=HOSTILE)],
    )
    shown = Page(html)
    scripts = Counter(attrs.get("type", "") for tag, attrs in shown.tags if tag == "script")
    assert scripts == {"": 1, "module": 1, "application/json": 1, "application/octet-stream": 1}
    assert not {"link", "iframe", "object", "base"} & {tag for tag, _ in shown.tags}
    for tag, attrs in shown.tags:
        assert not [name for name in attrs if name.startswith("on")], tag
        if "src" in attrs:
            assert attrs["src"].startswith("data:image/png;base64,")
        if "href" in attrs:
            assert attrs["href"].startswith(("#", "./"))
    assert HOSTILE in shown.text
    style = html[html.index("<style>") : html.index("</style>")]
    assert not re.search(r"url\(|@import", style)
    policies = [a["content"] for _, a in shown.tags if a.get("http-equiv")]
    policy = dict(part.split(None, 1) for part in policies[0].split(";"))
    assert policy["default-src"] == "'none'"
    assert all(source.startswith("'sha256-") for source in policy["script-src"].split())


def test_an_image_that_is_reduced_in_the_page_is_said_to_be(record, monkeypatch):
    def shown():
        embedded = embedding.embed(CHANNELS, np.ones((4, 6), bool))
        return Page(page.render([records.view(record, embedded=embedded)])).text

    assert "means over" not in shown()
    monkeypatch.setattr(embedding, "LONGEST", 3)
    assert "means over 2 × 2 pixels" in shown()


WORDS = (
    (words.number, {0.0: "0", 4.327: "4.33", 0.04871: "0.0487", 0.00025: "2.5 × 10⁻⁴",
                    -0.5: "−0.500", 1234.5: "1,234", 3.2e7: "3.2 × 10⁷", 9.999: "10.0", None: "–"}),
    (words.difference, {1.8e-6: "< 0.01", -1e-9: "> −0.01", 0: "0", 0.01: "0.0100", None: "–"}),
    (words.seconds, {0.0: "0 s", 2e-5: "20.0 µs", 0.0042: "4.20 ms", 75.0: "75.0 s", None: "–"}),
)  # fmt: skip


def test_values_have_three_digits_and_their_unit():
    for form, texts in WORDS:
        assert {value: form(value) for value in texts} == texts


def test_details_have_what_was_checked_and_every_metric():
    machine = Machine(processor=HOSTILE, cores=2, system="Linux")
    run = RunRecord(command="", stages={"page": 1.5}, failures=(), machine=machine, versions={})
    html = page.details(run=run)
    shown = Page(html)
    assert HOSTILE in shown.text
    assert HOSTILE not in html
    assert ("1.50 s", 1.5) in {(text, value) for value, text in shown.values}
    assert all(metric.definition in shown.text for metric in METRICS.values())
    assert "Where the time went" not in page.details()


def test_effects_and_methods_have_their_sentence_in_the_glossary_once():
    known = glossary.meanings()
    effects = {effect.label for effect in EFFECTS if effect.colour}
    assert effects | {method.name for method in BUILT_IN} <= set(known)
    names = [name for terms in glossary.GROUPS.values() for names in terms for name in names]
    assert len(names) == len({name.lower() for name in names})


def pictured(record, name, mean, level):
    """Return a view of a record with a name and mean, whose pictures have one grey level."""
    metrics = record["metrics"] | {"dE2000": record["metrics"]["dE2000"] | {"mean": mean}}
    flat = files.webp(Image.new("RGB", (8, 8), (level, level, level)))
    halves = dict.fromkeys(("heuristic", "reference", "dE2000"), flat)
    return records.view(record | {"scene": name, "metrics": metrics}, thumbnails=halves)


def test_the_worst_have_the_largest_mean_errors_and_do_not_look_alike(record):
    views = [
        pictured(record, name, mean, level)
        for name, mean, level in (
            ("second", 8.0, 120), ("twin", 8.5, 20), ("first", 9.0, 22), ("last", 1.0, 200),
            ("third", 3.0, 250),
        )
    ]  # fmt: skip
    html = page.render(views)
    cards = html[html.index('<ol class="worst">') : html.index("</ol>")]
    assert re.findall(r'data-scene="(\w+)"', cards) == ["first", "second", "third"]


def test_the_overview_has_the_runs_size_and_samples_and_the_details_how_it_was_made(record):
    view = records.view(record)
    width, height = record["resolution"]
    size = f"{width} × {height} pixels; {record['plan']['spp']} samples per pixel"
    assert size in " ".join(Page(page.render([view])).text.split())
    shown = " ".join(Page(page.details(records=[view.record])).text.split())
    assert size in shown
    assert f"{Machine.here().processor}, {Machine.here().cores} cores" in shown


def test_a_small_map_of_the_error_has_the_colours_of_the_pages():
    """Grey up to the usual threshold, then colours; the browser's tests have the same rule."""
    row = np.array([[0.0, 1.0, 2.0, 2.01, 11.0, 20.0, 500.0]])
    shown = np.array(files.difference_map(row, 2.0, 20.0))[0]
    table = bytes.fromhex(files.colour_table(files.ERROR_COLOURS))
    colours = np.frombuffer(table, np.uint8).reshape(256, 3)
    expected = [[0] * 3, [35] * 3, [70] * 3, colours[64], colours[160], colours[255], colours[255]]
    np.testing.assert_array_equal(shown, expected)
