"""What is declared outside the package is found everywhere without another line changed.

Each declaration is a toy of a few lines. A fixture declares it and takes it back.
"""

import csv
import json
import re
import tomllib
from dataclasses import replace
from io import StringIO
from pathlib import Path

import jsonschema
import numpy as np
import OpenEXR
import pytest
from scipy.ndimage import uniform_filter

from fotismos.comparisons.check.measured import Measured
from fotismos.comparisons.departure.metrics import METRICS, Metric, declare
from fotismos.comparisons.fit.fit import RenderedHalves
from fotismos.comparisons.ladder import methods
from fotismos.comparisons.pictures import Pictures
from fotismos.comparisons.records.check import HALVES
from fotismos.comparisons.records.cost import Method
from fotismos.comparisons.records.departure import DEFAULT_VIEWING
from fotismos.comparisons.study import dataset
from fotismos.heuristic.declared import Declared
from fotismos.heuristic.errors import InputError
from fotismos.heuristic.heuristics import HEURISTICS, Heuristic
from fotismos.reference.rendering.sums import Estimate
from tests.shared.programs import python
from tests.shared.schemas import schema
from tests.shared.small_scene import PLAIN

OWN = [name for name, metric in METRICS.items() if METRICS.is_builtin(metric)]


def blurred(test, reference, viewing):
    """Mean absolute difference of images blurred by boxes of 3 by 3: it knows neighbourhoods."""
    images = (uniform_filter(image, (3, 3, 1)) for image in (test, reference))
    return viewing.exposure * np.abs(np.subtract(*images)).mean(axis=-1)


BLURRED = Metric(
    name="blurred",
    label="Blurred <difference>",
    unit="1 is display white",
    definition="Mean absolute difference after a blur.",
    caution="It is a toy.",
    map_range=(0.0, 0.5),
    visible=(0.25,),
    rounding=0.125,
    function=blurred,
)


@pytest.fixture
def metric():
    """The toy, declared."""
    yield declare(BLURRED)
    METRICS.added.pop(BLURRED.name)


@pytest.fixture
def results(metric, run, scene_file, tmp_path):
    """The folder of a run that knows the toy."""
    run("compare", scene_file, "-o", tmp_path / "out", "--spp", 4, "--figures")
    return tmp_path / "out"


def layer(results, name):
    """Return a layer of the comparison's EXR file, its channels last."""
    path = str(results / "my-scene/comparison.exr")
    with OpenEXR.File(path, separate_channels=True) as file:
        pixels = {key: channel.pixels for key, channel in file.channels().items()}
    return np.stack([pixels[f"{name}.{c}"] for c in "RGBXYZ" if f"{name}.{c}" in pixels], axis=-1)


def test_the_packages_metric_of_the_documentation_is_found(tmp_path, monkeypatch):
    page = (Path(__file__).parents[2] / "docs/api.md").read_text(encoding="utf-8")
    code, project = (
        re.findall(rf"```{kind}\n(.*?)```", page, re.S)[0] for kind in ("python", "toml")
    )
    found = tomllib.loads(project)
    group, entries = next(iter(found["project"]["entry-points"].items()))
    (tmp_path / f"{found['tool']['setuptools']['py-modules'][0]}.py").write_text(code)
    installed = tmp_path / "absolute_metric-1.dist-info"
    installed.mkdir()
    (installed / "METADATA").write_text(f"Name: {found['project']['name']}\nVersion: 1\n")
    lines = "".join(f"{name} = {value}\n" for name, value in entries.items())
    (installed / "entry_points.txt").write_text(f"[{group}]\n{lines}")
    monkeypatch.syspath_prepend(tmp_path)
    metrics = Declared("metric", METRICS.group)
    image = np.zeros((2, 3, 3))
    assert metrics["absolute"](image + 0.25, image).mean() == 0.25


@pytest.mark.thorough
def test_a_metric_from_outside_is_in_every_output(results):
    record = json.loads((results / "my-scene/comparison.json").read_text(encoding="utf-8"))
    jsonschema.validate(record, schema("comparison"))
    found = record["metrics"]["blurred"]
    image = layer(results, "blurred")[..., 0]
    halves = [layer(results, half) for half in ("heuristic", "reference")]
    np.testing.assert_allclose(image, blurred(*halves, DEFAULT_VIEWING), rtol=1e-3, atol=1e-6)
    seen = layer(results, "N").any(axis=-1)
    assert found["mean"] == pytest.approx(image[seen].mean(dtype=float), rel=1e-3)
    (share,) = found["visible"]
    assert share["low"] - 0.01 <= (image[seen] > share["threshold"]).mean() <= share["high"] + 0.01
    assert 0 < found["noise_floor"] < found["mean"]
    assert found["after_exposure"]["mean"] <= found["mean"]
    assert (results / "my-scene/blurred.png").stat().st_size > 0
    rows = list(csv.DictReader(StringIO((results / "tables/metrics.csv").read_text("utf-8"))))
    assert [row["metric"] for row in rows] == [*METRICS]
    assert float(rows[-1]["mean"]) == pytest.approx(found["mean"], rel=1e-3)
    pages = [(results / f"{name}.html").read_text("utf-8") for name in ("details", "index")]
    for html in pages:
        assert "Blurred &lt;difference&gt;" in html
        assert "Blurred <difference>" not in html
    data = json.loads(re.search(r'id="page-data">(.*?)</script>', pages[1], re.S)[1])
    chosen = {"name": "blurred", "title": "Blurred <difference>", "kind": "metric", "top": 0.5}
    assert chosen in data["maps"]
    assert "blurred" in data["scenes"][0]["images"]["names"]


@pytest.mark.parametrize("name", ["heuristic", "no name"])
def test_a_name_that_is_taken_or_unfit_is_refused(name):
    with pytest.raises(InputError, match="name"):
        declare(replace(BLURRED, name=name))
    assert list(METRICS) == OWN


def test_a_metric_from_outside_is_computed_from_any_baseline(metric):
    images = np.random.default_rng(0).uniform(0.1, 0.9, (2, 4, 8, 8, 3)).astype(np.float32)
    kept = {name: Pictures.of(name, half) for name, half in zip(HALVES, images, strict=True)}
    counted = np.ones((8, 8), bool)
    found = Measured(halves=kept, counted=counted).metrics(kept)
    expected = blurred(*images.mean(axis=1), DEFAULT_VIEWING).mean()
    assert found["blurred"] == pytest.approx(expected, rel=1e-5)
    assert set(OWN) < set(found)


def test_a_metric_from_outside_is_in_fits_and_studies(metric):
    rng = np.random.default_rng(0)
    before, after, reference = rng.random((3, 8, 8, 3))
    counted = np.ones((8, 8), bool)
    exact = Estimate(reference, 0 * after, 0 * after, 2)
    found = RenderedHalves(before, reference, exact, counted, DEFAULT_VIEWING).departures(after)
    expected = blurred(after, reference, DEFAULT_VIEWING)
    assert found["blurred"].after == expected.mean()
    assert dataset.results()["blurred"][1] == "Blurred <difference>, mean"


TONE = Heuristic("flat-tone", lambda point: point.material.k_d, "Flat <tone>")
NO_SHADOWS = Method(name="no <shadows>", family="physical", without=("occlusion",), max_depth=2)


@pytest.mark.thorough
def test_a_method_and_a_heuristic_are_in_json_tables_page_and_chart(
    run, scene_file, tmp_path, monkeypatch
):
    """Nothing but their declarations names them in the product."""
    monkeypatch.setattr(methods.METHODS, "added", {})
    methods.declare(NO_SHADOWS)
    monkeypatch.setitem(HEURISTICS.added, TONE.name, TONE)
    scene_file.write_text(PLAIN, encoding="utf-8")
    words = ("--heuristic", "flat-tone", "--resolution", "12x12", "--spp", 4)
    assert run("cost", scene_file, "-o", tmp_path / "out", "--rounds", 2, *words)[0] == 0
    out = tmp_path / "out/cost"
    record = json.loads((out / "my-scene/cost.json").read_text(encoding="utf-8"))
    jsonschema.validate(record, schema("cost"))
    assert record["heuristic"] == "flat-tone"
    measured = {method["name"]: method for method in record["methods"]}
    assert measured["no <shadows>"]["family"] == "physical"
    assert {point["method"] for point in record["points"]} == set(measured)
    for name in ("my-scene/cost.svg", "my-scene/index.html"):
        text = (out / name).read_text(encoding="utf-8")
        assert "no &lt;shadows&gt;" in text
        assert "Phong kernel: Flat &lt;tone&gt;" in text


LIGHT_FOUND = """\
heuristic_trial is paired as directional
departure: 0.0
exact: True
trial is exported as directional
scene: lamp: direction = [0, 0, 0] is not allowed: give a vector of any length but 0.
lights is of type str: give a list of PointLight, DirectionalLight, SpotLight or TrialLight, empty \
for none.
"""


@pytest.mark.thorough
def test_a_kind_of_light_is_found_by_its_declaration_alone():
    """Registered, shaded, paired, planned, exported, checked and named: in a process of its own."""
    ended = python("-m", "tests.shared.trial_light_program")
    assert (ended.stdout, ended.returncode) == (LIGHT_FOUND, 0), ended.stderr
