"""The record's schema, and the page: its numbers are the record's and it loads nothing."""

import copy
import re
from collections import Counter
from html.parser import HTMLParser

import jsonschema
import numpy as np
import pytest

from comparisons.departure.metrics import METRICS, drawn
from comparisons.verification import Verification
from reference.records import Estimated
from reports.page import embedding, page, templating
from reports.run.results import Failure
from reports.terminal import words
from tests import records
from tests.schemas import schema

SCHEMA = schema("comparison")
HOSTILE = "../\"><script>alert('x')</script><img src=http://example.org/x onerror=alert(1)>"


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


class Page(HTMLParser):
    """Start tags with attributes, text, and the values of <data> elements with their text."""

    def __init__(self, html):
        super().__init__(convert_charrefs=True)
        self.tags, self.text, self.values, self.open = [], "", [], None
        self.feed(html)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag == "data":
            self.open = dict(attrs)["value"]

    def handle_data(self, data):
        self.text += data
        if self.open is not None:
            self.values.append((float(self.open), data))
            self.open = None


def numbers_in(node):
    if isinstance(node, dict):
        return [n for item in node.values() for n in numbers_in(item)]
    if isinstance(node, list | tuple):
        return [n for item in node for n in numbers_in(item)]
    return [node] if isinstance(node, int | float) and not isinstance(node, bool) else []


def test_the_schema_is_valid_and_accepts_a_record(record):
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    jsonschema.Draft202012Validator(SCHEMA).validate(record)


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("metrics", "dE2000", "mean"), -1.0),
        (("metrics", "dE2000", "mean"), None),
        (("significant", "fraction"), 1.5),
        (("resolution",), [512]),
        (("resolution",), [0, 4]),
        (("plan", "max_depth"), -2),
        (("time", "heuristic", "median_ms"), 4.2),
        (("surprise",), 1),
    ],
)
def test_the_schema_refuses(record, path, value):
    node = record
    for key in path[:-1]:
        node = node[key]
    node[path[-1]] = value
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.Draft202012Validator(SCHEMA).validate(record)


def test_no_required_key_may_be_missing(record):
    for key in SCHEMA["$defs"]["ComparisonRecord"]["required"]:
        partial = {k: v for k, v in record.items() if k != key}
        assert not jsonschema.Draft202012Validator(SCHEMA).is_valid(partial), key


def test_the_numbers_on_the_page_are_the_records(record, pictures):
    shown = Page(page.render([records.view(record, embedded=pictures)]))
    values = {value for value, _ in shown.values}
    keys = ("log2_luminance", "significant", "viewing", "pixels", "pairing", "time")
    parts = [record[key] for key in keys]
    for metric in record["metrics"].values():
        chosen = [each for each in metric["visible"] if each["threshold"] in (1, 2, 5)]
        shares = [[each[end] for end in ("value", "low", "high")] for each in chosen]
        parts.append(metric | {"visible": shares})
    parts += [(region["share"], region["mean_dE2000"]) for region in record["regions"]]
    # The level of the marks is printed, as "5 %", without a machine-readable value.
    missing = {n for n in numbers_in(parts) if n not in values} - {0.05}
    assert not missing
    assert ("4.33", 4.327) in {(text, value) for value, text in shown.values}
    assert ("63.2 %", 0.632) in {(text, value) for value, text in shown.values}
    assert ("2.79 s", 2.79) in {(text, value) for value, text in shown.values}
    for text in ("Seed 7", "unlimited depth", "256 samples per pixel", "k_d > 0", "mitsuba 3.9.1"):
        assert text in shown.text
    (unrepresentable,) = record["unrepresentable"]
    for text in (*unrepresentable.values(), *record["warnings"], record["command"]):
        assert text in shown.text


def test_two_scenes_keep_their_order_and_their_anchors(record, pictures):
    other = copy.deepcopy(record) | {"scene": "second"}
    shown = Page(page.render([records.view(record, embedded=pictures), records.view(other)]))
    ids = [attrs["id"] for _, attrs in shown.tags if "id" in attrs]
    assert len(ids) == len(set(ids))
    targets = [attrs["href"][1:] for _, attrs in shown.tags if "href" in attrs]
    scenes = [target for target in dict.fromkeys(targets) if "=" in target and "&" not in target]
    assert scenes == ["scene=fig-8-9", "scene=second"]
    assert set(scenes) < set(ids)


def test_the_page_loads_nothing_and_escapes_everything(record, pictures):
    for key in ("scene", "command", "variant"):
        record[key] = HOSTILE
    record["warnings"] = [HOSTILE]
    record["unrepresentable"] = [dict.fromkeys(record["unrepresentable"][0], HOSTILE)]
    record["versions"] = {HOSTILE: HOSTILE}
    record["plan"]["effects"][0]["rule"] = HOSTILE
    record["regions"][0]["effect"] = HOSTILE
    record["pairing"]["bsdfs"][0]["parameters"][HOSTILE] = {HOSTILE: [HOSTILE]}
    record["pairing"]["misses"][0]["what"] = HOSTILE
    html = page.render(
        [records.view(record, embedded=pictures, files={HOSTILE: "javascript:" + HOSTILE})],
        title=HOSTILE,
        failures=[Failure(scene=HOSTILE, error=HOSTILE)],
    )
    shown = Page(html)
    scripts = [attrs.get("type", "") for tag, attrs in shown.tags if tag == "script"]
    assert scripts.count("") == 1
    assert scripts.count("module") == 1
    assert set(scripts) == {
        "",
        "module",
        "application/json",
        "application/octet-stream",
    }
    assert not {"link", "iframe", "object", "base"} & {tag for tag, _ in shown.tags}
    for tag, attrs in shown.tags:
        assert not [name for name in attrs if name.startswith("on")], tag
        if "src" in attrs:
            assert attrs["src"].startswith("data:image/png;base64,")
        if "href" in attrs:
            assert attrs["href"] in ("#", "#main") or attrs["href"].startswith(("#scene=", "./"))
    assert HOSTILE in shown.text
    style = html[html.index("<style>") : html.index("</style>")]
    assert "url(" not in style
    assert "@import" not in style
    policies = [a["content"] for _, a in shown.tags if a.get("http-equiv")]
    policy = dict(part.split(None, 1) for part in policies[0].split(";"))
    assert policy["default-src"] == "'none'"
    assert all(source.startswith("'sha256-") for source in policy["script-src"].split())


def test_pictures_have_texts_and_maps_their_ranges(record, pictures):
    shown = Page(page.render([records.view(record, embedded=pictures)]))
    drawings = [attrs for tag, attrs in shown.tags if "data-picture" in attrs]
    assert len({attrs["data-picture"] for attrs in drawings}) == len(drawings) == 4 + len(drawn())
    assert all(len(attrs["aria-label"]) > 15 for attrs in drawings)
    for metric_ in METRICS.values():
        assert metric_.definition in shown.text
        assert metric_.caution in shown.text
        assert not metric_.drawn or f"≥ {metric_.map_range[1]:g}" in shown.text
    assert "not counted" in shown.text


def test_an_image_that_is_reduced_in_the_page_is_said_to_be(record, pictures, monkeypatch):
    def shown():
        embedded = embedding.embed(CHANNELS, np.ones((4, 6), bool))
        return Page(page.render([records.view(record, embedded=embedded)])).text

    assert "means over" not in shown()
    monkeypatch.setattr(embedding, "LONGEST", 3)
    assert "means over 2 × 2 pixels" in shown()


def test_nothing_but_noise_is_said_where_a_departure_would_have_shown(record, pictures):
    def shown(**interval):
        record["metrics"]["dE2000"].update(interval)
        return Page(page.render([records.view(record)])).text

    assert "about noise" not in shown()
    said = shown(debiased=0.1, low=0.0, high=0.4)
    assert "about noise" in said
    assert "nothing but noise. A mean above 0.400 would have shown" in " ".join(said.split())
    said = shown(debiased=0.1, low=0.0, high=4.0)
    assert "about noise" not in said
    assert "noise may hide a mean of up to 4.00" in " ".join(said.split())


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (4.327, "4.33"),
        (0.04871, "0.0487"),
        (0.00025, "2.5 × 10⁻⁴"),
        (-0.5, "−0.500"),
        (1234.5, "1,234"),
        (3.2e7, "3.2 × 10⁷"),
        (9.999, "10.0"),
        (None, "–"),
    ],
)
def test_numbers_are_printed_to_three_digits(value, text):
    assert words.number(value) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (1.8e-6, "< 0.01"),
        (-1e-9, "> −0.01"),
        (0, "0"),
        (0.01, "0.0100"),
        (2.5, "2.50"),
        (None, "–"),
    ],
)
def test_no_colour_difference_is_printed_below_a_hundredth(value, text):
    assert words.difference(value) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0, "0 s"), (2e-5, "20.0 µs"), (0.0042, "4.20 ms"), (75.0, "75.0 s"), (None, "–")],
)
def test_times_have_their_unit(value, text):
    assert words.seconds(value) == text


def test_the_package_holds_its_templates():
    folder = templating.TEMPLATES
    styles = [f"styles/{name}.css" for name in page.STYLES]
    scripts = [f"viewer/{name}.js" for name in page.SCRIPTS]
    for name in ("page.html.j2", "scene.html.j2", "macros.html.j2", *styles, *scripts):
        assert (folder / name).is_file()
    assert {path.stem for path in (folder / "viewer").iterdir()} == set(page.SCRIPTS)
    assert {path.stem for path in (folder / "styles").iterdir()} == set(page.STYLES)


def test_scripts_declare_each_name_once():
    """They are joined into one module, where a second declaration is a syntax error."""
    declared = re.compile(r"^(?:async )?(?:function|class|const|let) (\w+)", re.MULTILINE)
    sources = (
        (templating.TEMPLATES / "viewer" / f"{name}.js").read_text() for name in page.SCRIPTS
    )
    found = Counter(name for source in sources for name in declared.findall(source))
    assert len(found) > 50
    assert [name for name, count in found.items() if count > 1] == []


def test_verifications_are_printed(record, pictures):
    numbers = {
        "significant": 3, "pixels": 1436, "planned_s": 0.0032, "planned_noise": 0.5,
        "everything_s": 0.25, "everything_noise": 0.125, "planning_s": 0.002,
        "heuristic_largest": 0.0, "resolution": (96, 80), "largest": 0.5, "saved_s": 1.0,
    }  # fmt: skip
    numbers["gain"] = Estimated(value=91.5, low=80.0, high=100.0)
    verification = Verification(scene=HOSTILE, planned="direct_all", everything="path", **numbers)
    view = records.view(record, embedded=pictures)
    html = page.render([view], verifications=[verification])
    assert "3 of 1436" in html
    assert "91.5 ×" in html
    assert "96 × 80 pixels" in html
    assert HOSTILE not in html
    assert "A quick report verifies" not in html
    assert "verifies only 1 of its 2 scenes" in page.render(
        [view] * 2, verifications=[verification]
    )
    assert "Pruning" not in page.render([view])
