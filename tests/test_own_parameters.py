"""Fits, studies and checks of heuristics of a user's own, through the parameters that they have."""

import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from comparisons.case import Request, open_case
from comparisons.compare import compare, prepare
from comparisons.fit.fit import FitOptions, fit
from comparisons.fit.own_parameters import OwnModel
from comparisons.options import Options
from comparisons.study import design, point, rendered
from heuristic.errors import InputError
from heuristic.heuristics import named
from tests import dask_cluster
from tests.test_user_heuristics import SHADERS

GAIN = """
import drjit as dr
from heuristic import Range

def shade(point, gain: Range(0, 4) = 1, tint: Range(-1, 1) = 0.25):
    cosines = [dr.maximum(dr.dot(point.normal, each.toward), 0) for each in point.lights]
    lit = sum(c * each.intensity for c, each in zip(cosines, point.lights))
    return gain * lit * point.material.base_color + 0.1 * dr.square(1 + tint) * point.ambient
"""


def ready(name, scene="fig-8-9"):
    case = open_case(scene, Request(heuristic=name, resolution=(16, 16), spp=16))
    return prepare(case.source, case.options)


# --- Fits ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("scene", ["fig-8-9", "cornell-box"])
def test_derivatives_are_those_of_the_image(rgb, written, scene):
    """Against differences of images, at another place than the default."""
    found = ready(written(GAIN), scene)
    heuristic = named("mine.py")
    model = OwnModel(found.heuristic, heuristic, [1, 2], np.ones((16, 16), bool))
    x, step = np.array([1.5, -0.5]), 0.05
    columns = model.columns(x)
    for place, column in enumerate(columns):
        shift = step * np.eye(2)[place]
        slope = (model.image(x + shift) - model.image(x - shift)) / (2 * step)
        assert abs(slope).max() > 0.01 or scene == "cornell-box"
        np.testing.assert_allclose(column, slope, atol=2e-5 * max(1, abs(slope).max()))


def test_a_gain_is_that_of_least_squares(rgb, written):
    """In linear RGB the best gain has a closed form: the image is proportional to it."""
    name = written(GAIN.replace(" + 0.1 * dr.square(1 + tint) * point.ambient", ""))
    source = open_case("fig-8-9").source
    options = Options(resolution=(24, 24), spp=32, heuristic=name)
    found = fit(source, options, FitOptions(loss="linear"))
    h, r = found.images.before, found.images.reference
    (nearest,) = found.record.fits
    gain, tint = nearest.own
    assert gain.fitted == pytest.approx(np.sum(h * r) / np.sum(h * h), rel=1e-3)
    assert gain.fitted != pytest.approx(1, abs=0.02)
    assert gain.interval[0] <= gain.fitted <= gain.interval[1]
    assert gain.bounds == (0, 4)
    assert nearest.parameter_error > 0
    assert (tint.fitted, tint.reason) == (None, "does not show in the image")


def test_a_planted_value_is_found_from_far_away(rgb, written):
    """The reference is diffuse, and so is the heuristic where its wrap is 0 and its gain 1."""
    name = written(
        "import drjit as dr\nfrom heuristic import Range\n"
        "def shade(point, wrap: Range(0, 1) = 0.9, gain: Range(0, 4) = 3):\n"
        "    value = 0\n"
        "    for each in point.lights:\n"
        "        cosine = (dr.dot(point.normal, each.toward) + wrap) / (1 + wrap)\n"
        "        value += each.intensity * dr.maximum(cosine, 0)\n"
        "    return gain * value * point.material.base_color\n"
    )
    options = Options(resolution=(24, 24), spp=32, heuristic=name)
    record = fit(open_case("lambert-sphere").source, options).record
    wrap, gain = record.nearest.own
    assert wrap.stopped_at == pytest.approx(0, abs=1e-3)
    assert gain.fitted == pytest.approx(1, abs=1e-3)
    assert record.nearest.departure["dE2000"].before > 10
    assert record.nearest.departure["dE2000"].after < 0.05


def test_the_fit_command_writes_and_prints_it(run, written, tmp_path):
    name = written(GAIN)
    words = ("fit", "fig-8-9", "--heuristic", name, "--resolution", "12x12", "--spp", 4)
    code, said, _ = run(*words, "-o", "out")
    assert code == 0
    assert f"{name} comes nearest" in said
    assert "gain" in said
    record = json.loads((tmp_path / "out/fit/fig-8-9/fit.json").read_text(encoding="utf-8"))
    assert [one["name"] for one in record["fits"][0]["own"]] == ["gain", "tint"]
    assert f"--heuristic {name}" in record["command"]


def test_a_heuristic_without_parameters_cannot_be_fitted(run, written):
    name = written("def shade(point): return point.ambient\n")
    code, _, said = run("fit", "fig-8-9", "--heuristic", name, "--resolution", "8x8", "--spp", 4)
    assert code == 2
    assert f"heuristic {name} has no parameters to fit" in " ".join(said.split())


# --- Studies -------------------------------------------------------------------------------------


def study(text, folder=Path()):
    head = "[[part]]\nscene = 'sphere'\nspp = 16\nresolution = [12, 12]\nheuristic = 'mine.py'\n"
    return design.parse(f"{head}[part.parameters]\n{text}", folder=folder)


def rows(wanted):
    return [
        row for part in wanted.parts for block in point.blocks(part) for row in point.rows(block)
    ]


def test_a_study_sweeps_declared_parameters(rgb, written):
    written((SHADERS / "wrapped.py").read_text(encoding="utf-8"))
    rendered._kept.cache_clear()
    wanted = study("heuristic.wrap = [0, 0.5, 1]\nalpha = [0.2, 0.6]")
    found = rows(wanted)
    assert sorted(row["heuristic.wrap"] for row in found) == [0, 0, 0.5, 0.5, 1, 1]
    assert all(row["error"] is None for row in found)
    identity = point.blocks(wanted.parts[0])[0].identity
    assert [kept.made for kept in rendered._kept("sphere", identity)] == [1, 1]
    # Each as a scene of its own has it, with that default in the file.
    for row in found:
        text = (SHADERS / "wrapped.py").read_text(encoding="utf-8")
        written(text.replace("= 0.5", f"= {row['heuristic.wrap']}"))
        rendered._kept.cache_clear()
        (alone,) = rows(study(f"alpha = {row['alpha']}"))
        assert row["heuristic"] == pytest.approx(alone["heuristic"], rel=1e-5)
        assert row["dE2000"] == pytest.approx(alone["dE2000"], rel=1e-4)
    assert len({row["dE2000"] for row in found}) == 6


def test_points_are_done_again_when_the_file_changes(rgb, written):
    keys = []
    for text in ("def shade(point): return 0.5\n", "def shade(point): return 0.25\n"):
        written(text)
        keys += [block.key for part in study("alpha = 0.2").parts for block in point.blocks(part)]
    assert len(set(keys)) == 2


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("heuristic.warp = 1", "parameter of mine.py:? 'warp' is not known .did you mean wrap"),
        ("heuristic.wrap = [0, 2]", "wrap = 2.0 is not allowed: give a value from 0 to 1"),
    ],
)
def test_a_study_refuses_parameters_that_are_not_declared(rgb, written, text, message):
    written((SHADERS / "wrapped.py").read_text(encoding="utf-8"))
    with pytest.raises(InputError, match=message):
        point.check(study(text).parts[0])


def test_a_study_without_an_image_is_of_phong_alone():
    with pytest.raises(InputError, match=r"the scene lobe is not rendered.*mine.py on sphere or"):
        design.parse(
            "[[part]]\nscene = 'lobe'\nheuristic = 'mine.py'\n[part.parameters]\nalpha = 0.2"
        )


def test_the_study_command_reads_the_file_beside_its_own(run, apart, written, tmp_path):
    (tmp_path / "inner").mkdir()
    written((SHADERS / "wrapped.py").read_text(encoding="utf-8"), "inner/mine.py")
    head = "[[part]]\nscene = 'sphere'\nspp = 8\nresolution = [8, 8]\nheuristic = 'mine.py'\n"
    written(f"{head}[part.parameters]\nheuristic.wrap = [0, 1]\n", "inner/s.toml")
    code, _, said = run("study", "inner/s.toml", "--processes", 1, "-o", "out")
    assert (code, said) == (0, "")
    table = pq.read_table(tmp_path / "out/study/s/s.parquet")
    assert table["error"].to_pylist() == [None, None]
    assert len(set(table["heuristic"].to_pylist())) == 2
    described = table.schema.field("heuristic.wrap").metadata[b"description"]
    assert described == b"parameter that the heuristic declares"


# --- Checks --------------------------------------------------------------------------------------


def test_a_baseline_names_the_file_from_its_own_folder(run, written, tmp_path, no_service):
    name = written((SHADERS / "wrapped.py").read_text(encoding="utf-8"))
    words = ("--scene", "fig-8-9", "--heuristic", f"{name}:shade", "--resolution", "12x12")
    assert run("check", "kept/w.json", "--update", *words)[0] == 0
    kept = json.loads((tmp_path / "kept/w.json").read_text(encoding="utf-8"))
    assert kept["options"]["heuristic"] == "../mine.py:shade"
    assert run("check", "kept")[0] == 0
    code, said, _ = run("check", "kept/w.json", "--update", "--heuristic", f"{name}:shade")
    assert (code, "0 of 1 baselines written" in said) == (0, True)
    written((SHADERS / "wrapped.py").read_text(encoding="utf-8").replace("= 0.5", "= 0.55"))
    code, said, _ = run("check", "kept")
    assert (code, "1 of 1 moved" in said) == (1, True)
    (tmp_path / "mine.py").unlink()
    code, _, said = run("check", "kept")
    assert (code, "mine.py: there is no such file" in said) == (2, True)


def test_a_test_suite_measures_a_shader(written, tmp_path, rgb):
    from reports.ci.testing import Fotismos

    name = written((SHADERS / "phong.py").read_text(encoding="utf-8"))
    fotismos = Fotismos(tmp_path / "baselines", lambda: tmp_path, update=True)
    mine, ours = (
        fotismos.departure("fig-8-9", resolution=(16, 16), spp=32, **more)
        for more in ({"heuristic": name}, {})
    )
    assert mine.value == pytest.approx(ours.value, abs=1e-3)
    assert fotismos.unchanged("fig-8-9", heuristic=name, resolution=(12, 12), spp=32)
    again = Fotismos(tmp_path / "baselines", lambda: tmp_path)
    assert again.unchanged("fig-8-9", heuristic=name, resolution=(12, 12), spp=32)


# --- Clusters ------------------------------------------------------------------------------------


def test_a_worker_of_a_cluster_reads_the_file_too(run, apart, written, tmp_path):
    name = written((SHADERS / "wrapped.py").read_text(encoding="utf-8"))
    words = ("compare", "fig-8-9", "--heuristic", name, "--resolution", "12x12", "--spp", 8, "-q")
    found = []
    with dask_cluster.running() as address:
        for out, more in (("here", ()), ("there", ("--scheduler", address))):
            code, _, said = run(*words, "-o", out, *more)
            assert (code, said) == (0, "")
            (path,) = (tmp_path / out).glob("*/comparison.json")
            found.append(json.loads(path.read_text(encoding="utf-8"))["metrics"])
        # The worker lives on, and reads what changed.
        written((SHADERS / "wrapped.py").read_text(encoding="utf-8").replace("= 0.5", "= 0.9"))
        assert run(*words, "-o", "there", "--scheduler", address)[0] == 0
        (path,) = (tmp_path / "there").glob("*/comparison.json")
        found.append(json.loads(path.read_text(encoding="utf-8"))["metrics"])
    assert found[0] == found[1] != found[2]


def test_departure_of_a_comparison_is_that_of_its_shader(rgb, written):
    """A shader that returns the reference's own closed form leaves nothing."""
    name = written(
        "import drjit as dr\ndef shade(point):\n"
        "    lit = [each.intensity * dr.maximum(dr.dot(point.normal, each.toward), 0)\n"
        "           for each in point.lights]\n"
        "    return sum(lit) * point.material.base_color\n"
    )
    case = open_case("lambert-sphere", Request(heuristic=name, resolution=(24, 24), spp=32))
    assert compare(case.source, case.options).record.metrics["dE2000"].mean < 1e-3
