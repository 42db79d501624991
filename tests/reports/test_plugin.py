"""The pytest plugin, in the suite of someone else: passing, failing, updating, skipping."""

import os
import subprocess
import sys

import numpy as np
import pytest

from fotismos.heuristic.errors import InputError
from fotismos.reports.ci import baselines
from fotismos.reports.ci.testing import Departure, Fotismos
from tests.shared import small_baselines
from tests.shared.outputs import write
from tests.shared.programs import ROOT, python
from tests.shared.small_scene import PLAIN, SCENE

SUITE = """
import pytest

SMALL = {"resolution": (16, 12), "spp": 32}

def plain():
    return {
        "type": "scene",
        "sensor": {"type": "perspective", "film": {"type": "hdrfilm", "width": 16, "height": 12}},
        "lamp": {"type": "point", "position": (0, 0, -3), "intensity": 9.0},
        "ball": {"type": "sphere", "center": (0, 0, 4), "bsdf": {"type": "diffuse"}},
    }

def test_a_close_scene(fotismos):
    departure = fotismos.departure("lambert-sphere", **SMALL)
    assert departure <= 0.1
    assert not departure > 0.1
    assert 0 <= float(departure) < 0.1

def test_a_far_scene(fotismos):
    assert fotismos.departure("scenes/scene.xml", spp=32) <= 0.5

def test_another_metric(fotismos):
    assert fotismos.departure(plain, metric="rmse") <= 1e-3

def test_unchanged(fotismos):
    assert fotismos.unchanged("scenes/scene.xml", spp=32)

def test_unchanged_in_python(fotismos):
    fotismos.unchanged(plain, spp=32)

def test_unchanged_dictionary(fotismos):
    fotismos.unchanged(plain(), name="named", spp=32)

@pytest.mark.fotismos_variant("llvm_ad_rgb", "llvm_ad_mono")
def test_variants(fotismos):
    import mitsuba as mi
    assert mi.variant() == fotismos.variant
    fotismos.unchanged("lambert-sphere", **SMALL)
"""


@pytest.fixture
def suite(tmp_path):
    """A folder with a suite; returns a function that runs it, with arguments and variables."""
    (tmp_path / "tests/scenes").mkdir(parents=True)
    (tmp_path / "tests/test_mine.py").write_text(SUITE)
    (tmp_path / "tests/scenes/scene.xml").write_text(SCENE)
    (tmp_path / "pytest.ini").write_text("[pytest]\naddopts = --strict-markers\n")

    def run(*arguments, **variables):
        words = [sys.executable, "-m", "pytest", "-p", "fotismos.reports.ci.plugin", "-W", "error"]
        # Without the colours and services of the run that this is part of.
        environment = {
            k: v for k, v in os.environ.items() if not k.startswith(("PYTEST", "GITHUB"))
        }
        environment |= {"PYTHONPATH": str(ROOT), "COLUMNS": "120"} | variables
        done = subprocess.run(
            [*words, *arguments], cwd=tmp_path, env=environment, capture_output=True, text=True
        )
        return done.returncode, done.stdout + done.stderr

    return run


@pytest.mark.thorough
def test_a_suite_fails_updates_and_passes(suite, tmp_path):
    code, printed = suite("-rf")
    assert code == 1
    assert "6 failed, 2 passed" in printed
    for words in (
        "assert dE2000 ", "<= 0.5", "scene: mean dE2000 ", "95 % interval: ", "noise alone: ",
        "scene.exr: there is no such baseline. `pytest --fotismos-update` writes it.",
    ):  # fmt: skip
        assert words in printed

    code, printed = suite("--fotismos-update", "-k", "unchanged or variants")
    assert (code, "5 passed" in printed) == (0, True), printed
    folder = tmp_path / "tests/baselines"
    variants = ["lambert-sphere-llvm_ad_mono", "lambert-sphere-llvm_ad_rgb"]
    names = sorted(path.stem for path in folder.iterdir())
    assert names == [*variants, "named", "plain", "scene"]

    small_baselines.change(folder / "plain.exr", by=lambda image: 2 * image)
    redder = SCENE.replace('value="0.2, 0.3, 0.5"', 'value="0.3, 0.3, 0.5"')
    (tmp_path / "tests/scenes/scene.xml").write_text(redder)
    code, printed = suite("-k", "unchanged or variants and rgb")
    assert "2 failed, 2 passed" in printed
    for words in ("scene.exr: ", "moved. `", "standard errors", "physical red", "page: "):
        assert words in printed


PICTURES = """
import numpy as np

RAMP = np.linspace(0.2, 0.8, 32 * 24 * 3).reshape(24, 32, 3)

def test_hall(fotismos):
    assert fotismos.significance == 0.001
    fotismos.picture("hall", RAMP * FACTOR)
"""

INI = """[pytest]
fotismos_baselines = references/pictures
fotismos_report = out
fotismos_significance = 0.001
"""


@pytest.mark.thorough
def test_an_ini_file_chooses_folders_and_significance(suite, tmp_path):
    (tmp_path / "tests/test_mine.py").write_text(PICTURES.replace("FACTOR", "1"))
    (tmp_path / "pytest.ini").write_text(INI)
    assert suite("--fotismos-update")[0] == 0
    names = sorted(path.name for path in (tmp_path / "references/pictures").iterdir())
    assert names == ["hall.exr"]
    assert not (tmp_path / "tests/baselines").exists()
    (tmp_path / "tests/test_mine.py").write_text(PICTURES.replace("FACTOR", "1.5"))
    code, printed = suite()
    page = tmp_path / "out/tests-test_mine.py-test_hall/hall/index.html"
    assert code == 1
    assert f"page: {page}" in printed
    assert "of the pixels differ by more than" in page.read_text()
    for word in ("1", "often"):
        (tmp_path / "pytest.ini").write_text(f"[pytest]\nfotismos_significance = {word}\n")
        code, printed = suite()
        assert code == pytest.ExitCode.USAGE_ERROR
        assert f"fotismos_significance = {word} is not allowed: give a number" in printed


@pytest.mark.thorough
def test_without_llvm_tests_are_skipped_with_the_reason(suite):
    code, printed = suite("-rs", DRJIT_LIBLLVM_PATH="/nowhere/libLLVM.so")
    assert code == 0
    assert "8 skipped" in printed
    assert "fotismos cannot render here. Dr.Jit cannot find an LLVM" in printed


def test_the_plugin_imports_nothing_heavy():
    heavy = "{'mitsuba', 'drjit', 'numpy'}"
    code = f"import fotismos.reports.ci.plugin, sys; print({heavy} & {{*sys.modules}})"
    assert python("-c", code).stdout.strip() == "set()"


# --- In this process ------------------------------------------------------------------------------

SMALL = {"spp": 32, "resolution": (8, 6)}


@pytest.fixture
def fixtures(rgb, tmp_path):
    """What a test gets without and with ``--fotismos-update``, in a folder with a scene."""
    (tmp_path / "scenes").mkdir()
    (tmp_path / "scenes/scene.xml").write_text(PLAIN)
    places = tmp_path / "baselines", tmp_path, lambda: tmp_path
    return Fotismos(*places), Fotismos(*places, update=True)


def test_options_other_than_the_baselines_fail_until_it_is_written_again(fixtures, tmp_path):
    checked, updated = fixtures
    path = tmp_path / "baselines/scene.exr"
    assert updated.unchanged("scenes/scene.xml", **SMALL)
    before = path.read_bytes()
    other = SMALL | {"spp": 48}
    with pytest.raises(AssertionError, match=r"differ: \{'spp': \(32, 48\)\}.*--fotismos-update"):
        checked.unchanged("scenes/scene.xml", **other)
    assert path.read_bytes() == before
    assert updated.unchanged("scenes/scene.xml", **other)
    assert baselines.read(path).baseline.options["spp"] == 48


@pytest.mark.thorough
def test_a_baseline_can_be_named_by_its_path(fixtures, tmp_path):
    checked, updated = fixtures
    updated.unchanged("scenes/scene.xml", **SMALL)
    assert checked.unchanged("baselines/scene.exr")
    small_baselines.change(tmp_path / "baselines/scene.exr")
    with pytest.raises(AssertionError, match=r"scene.exr: \d+ of \d+ moved\. `.*`: red -"):
        checked.unchanged("baselines/scene.exr")
    with pytest.raises(AssertionError, match="there is no such baseline"):
        checked.unchanged(tmp_path / "baselines/none.exr")
    old = tmp_path / "baselines/old.json"
    old.write_text('{"record_version": 4, "scene": "fig-8-9", "options": {}, "passes": 16}')
    with pytest.raises(AssertionError, match=r"is of fotismos 0\.4.*--fotismos-update"):
        checked.unchanged(old)


def test_what_cannot_be_measured_is_refused(fixtures):
    checked, _ = fixtures
    with pytest.raises(InputError, match=r"metric 'dE2001'.*dE2000"):
        checked.departure("scenes/scene.xml", metric="dE2001", **SMALL)
    with pytest.raises(InputError, match="a dictionary needs a name"):
        checked.unchanged({"type": "scene"})


def test_a_departure_is_a_number_that_explains_itself():
    about = {"scene": "a", "metric": "dE2000", "interval": (0.9, 2.5), "noise_floor": 0.125}
    close, far = (Departure(value, **about) for value in (1.0, 2.0))
    assert close == 1 != far
    assert close < far <= 2
    assert repr(far) == "dE2000 2"
    assert far.fotismos_explanation() == [
        "a: mean dE2000 2", "95 % interval: 0.9 to 2.5; noise alone: 0.125",
    ]  # fmt: skip
    ratio = Departure(2.0, **about | {"interval": None})
    assert ratio.fotismos_explanation() == ["a: mean dE2000 2"]


@pytest.mark.guarantee("checks", "A baseline's name leads to no other folder.")
def test_a_baseline_stays_in_its_folder(fixtures, tmp_path):
    _, updated = fixtures
    for name in ("../../../esc", "/absolute/esc", "..", "a/b", "a\nb"):
        with pytest.raises(InputError, match="a file gets that name"):
            updated.unchanged("scenes/scene.xml", name=name, **SMALL)
    assert [path.name for path in tmp_path.iterdir()] == ["scenes"]


# --- Pictures ---------------------------------------------------------------------------------

RAMP = np.linspace(0.2, 0.8, 32 * 24 * 3).reshape(24, 32, 3)


@pytest.mark.guarantee(
    "checks", "In a test, a picture passes by a tolerance or by its noise, and fails with a map."
)
def test_a_picture_is_as_its_baseline_or_fails_with_a_map(fixtures, tmp_path):
    plain, updated = fixtures
    with pytest.raises(AssertionError, match=r"hall\.exr: there is no such baseline"):
        plain.picture("hall", RAMP)
    assert updated.picture("hall", RAMP)
    wrong = RAMP.copy()
    wrong[:2] *= 1.5  # a twelfth of the pixels
    assert plain.picture("hall", RAMP * 1.002)
    assert plain.picture("hall", wrong, max_visible=0.1)
    assert plain.picture("hall", wrong, max_visible="9%")
    with pytest.raises(AssertionError, match=r"at most 8\.00 % may"):
        plain.picture("hall", wrong, max_visible="8 %")
    for share in (5, "500%", "a lot", -0.1):  # 5 would pass whatever differs
        with pytest.raises(InputError, match=r"is not a share of the pixels: .* '5%'"):
            plain.picture("hall", wrong, max_visible=share)
    with pytest.raises(InputError, match=r"array of uint8 is not linear light"):
        plain.same((255 * RAMP).astype(np.uint8), RAMP)
    with pytest.raises(
        AssertionError, match=r"8\.33 % .*of the pixels differ .* at most 5\.00 % may"
    ):
        plain.picture("hall", wrong)
    shown = {path.name for path in (tmp_path / "hall").glob("[!.]*")}
    panels = {"picture-before.png", "picture-now.png", "picture-dE2000.png"}
    assert shown == {*panels, "index.html", "check.json"}
    page = (tmp_path / "hall/index.html").read_text()
    for words in ("of the pixels differ", "pytest --fotismos-update"):
        assert words in page
    with pytest.raises(AssertionError, match=r"light \+0\.2 %.*moved by a constant factor"):
        plain.picture("hall", RAMP * 1.002, within=None)
    assert updated.picture("hall", wrong)
    assert plain.picture("hall", wrong)
    assert updated.picture("hall", RAMP[:8])
    assert plain.picture("hall", RAMP[:8])


def test_repeats_of_a_picture_may_differ_by_their_noise(fixtures):
    plain, updated = fixtures
    rng = np.random.default_rng(3)

    def repeats(factor):
        return [RAMP * factor + 0.02 * rng.normal(size=RAMP.shape) for _ in range(8)]

    assert updated.picture("noisy", repeats(1.0), within=None)
    assert plain.picture("noisy", repeats(1.0), within=None)
    with pytest.raises(AssertionError, match="means moved"):
        plain.picture("noisy", repeats(1.05), within=None)


def test_two_pictures_are_the_same_or_fail(fixtures, tmp_path):
    plain, _ = fixtures
    write(tmp_path / "reference.exr", RAMP)
    assert plain.same(RAMP, "reference.exr")
    assert plain.same([RAMP, RAMP * 1.01], RAMP)
    with pytest.raises(AssertionError, match=r"100 % of the pixels differ .*\n.*pictures: "):
        plain.same(RAMP * 2, "reference.exr")
    assert (tmp_path / "same/picture-dE2000.png").is_file()


def test_what_is_no_picture_is_refused_in_a_test(fixtures, tmp_path):
    plain, updated = fixtures
    assert updated.picture("hall", RAMP)
    with pytest.raises(InputError, match="pictures of 32x3, 32x24"):
        plain.picture("hall", RAMP[:3])
    with pytest.raises(InputError, match=r"gone\.exr: there is no such file"):
        plain.picture("hall", "gone.exr")
    with pytest.raises(InputError, match=r"2\.1 is not a threshold"):
        plain.same(RAMP, RAMP, within=2.1)
    with pytest.raises(InputError, match="a file gets that name"):
        updated.picture("../../esc", RAMP)
