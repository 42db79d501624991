"""The page of a check that failed, and what it says: objects and causes."""

import json
import re
from types import SimpleNamespace

import mitsuba as mi
import numpy as np
import pytest

from comparisons.check.check import Check
from comparisons.check.measurement import measurement
from comparisons.check.moved import differences, moved
from comparisons.check.suspects import causes
from comparisons.departure.objects import shares
from comparisons.departure.spaces import DEFAULT_VIEWING
from reference.rendering.gbuffer import Owners, gbuffer, image_size
from tests.small_baselines import change

pytestmark = pytest.mark.usefixtures("no_service")


def check_of(heuristic=lambda image: image, reference=lambda image: image):
    """Return a check of halves that were changed by functions of images (16, 16, 3)."""
    rng = np.random.default_rng(0)
    before = rng.uniform(0.3, 0.7, (2, 16, 16, 3)) + 1e-4 * rng.normal(size=(4, 2, 16, 16, 3))
    after = np.stack(
        [[heuristic(one[0].copy()), reference(one[1].copy())] for one in before]
    ) + 1e-4 * rng.normal(size=before.shape)
    sides = [
        measurement(each, np.ones((16, 16), bool), DEFAULT_VIEWING) for each in (before, after)
    ]
    moves = differences(*sides)
    pictures = SimpleNamespace(heuristic=after.mean(axis=0)[0], reference=after.mean(axis=0)[1])
    return Check(*sides, moves, tuple(moved(moves)), 0.01, pictures)


def redder(image):
    image[4:8, 8:12, 0] *= 1.5
    return image


def test_causes_name_the_half_the_place_and_the_colour():
    said = " ".join(causes(check_of(reference=redder)))
    assert "Only the reference moved" in said
    assert "in 1 of 16 blocks, most in row 2, column 3." in said
    assert "Only red moved in the reference" in said


def test_a_factor_everywhere_is_a_level():
    said = " ".join(causes(check_of(heuristic=lambda image: 1.3 * image)))
    assert "Only the textbook half moved" in said
    assert "1.3 times the light everywhere" in said
    assert "look at a colour" not in said


def test_what_both_halves_share_is_suspected_where_both_moved():
    said = causes(check_of(redder, redder))
    assert said[0].startswith("Both halves moved: look at what they share")


def test_objects_are_told_by_pixels_or_else_by_blocks():
    found = check_of(reference=redder)
    places = np.zeros((16, 16), int)
    places[4:8, 8:10] = 1  # half of the block that moved
    found = Check(**vars(found) | {"seen": Owners(places, ("wall", "lamp"))})
    assert found.objects("reference") == pytest.approx({"wall": 0.5, "lamp": 0.5}, abs=0.01)
    before = found.pictures.reference.copy()
    before[places == 1] -= 0.1
    assert found.objects("reference", before) == pytest.approx({"lamp": 1.0})


def test_a_change_of_nothing_is_carried_by_nothing():
    assert shares(np.zeros((2, 2)), Owners(np.zeros((2, 2), int), ("a",))) == {}


def test_what_sees_no_shape_carries_nothing():
    owners = Owners(np.array([[0, 1], [1, -1]]), ("wall", "lamp"))
    change = np.array([[1.0, 2.0], [1.0, 9.0]])
    assert shares(change, owners) == pytest.approx({"lamp": 0.75, "wall": 0.25})


def test_each_pixel_knows_its_shape(rgb):
    scene = mi.load_dict(
        {
            "type": "scene",
            "sensor": {
                "type": "perspective",
                "to_world": mi.ScalarTransform4f().look_at([0, 0, 5], [0, 0, 0], [0, 1, 0]),
                "film": {"type": "hdrfilm", "width": 9, "height": 9},
            },
            "ball": {"type": "sphere", "center": [-1, 0, 0], "radius": 0.5},
            "plate": {
                "type": "rectangle",
                "to_world": mi.ScalarTransform4f().translate([1, 0, 0]).scale(0.5),
            },
        }
    )
    found = gbuffer(scene, *image_size(scene)).shape
    row = [found.names[place] if place >= 0 else "" for place in found.places[4]]
    assert set(row[:4]) - {""} == {"ball"}
    assert set(row[5:]) - {""} == {"plate"}
    assert (found.places[0] == -1).all()


@pytest.mark.guarantee(
    "checks", "A failure writes one page: before, now, where, on which object, and why."
)
def test_a_failure_writes_a_page_which_a_pass_takes_away(run, baselines_folder, tmp_path):
    out, summary = tmp_path / "out", tmp_path / "s.md"
    change(baselines_folder / "fig-8-6b.json")
    words = ("check", baselines_folder, "-o", out)
    code, printed, _ = run(*words, "--summary", summary)
    page = out / "check/index.html"
    assert (code, f"page: {page}" in printed) == (1, True)
    html = page.read_text(encoding="utf-8")
    for part in ("1 of 2 scenes moved", "Only the reference moved", "row 2, column 3", "sphere"):
        assert part in html, part
    accepting = re.search("If this change is intended: <code>(.*?)</code>", html)[1]
    assert accepting.endswith(" --update")
    assert str(baselines_folder) in accepting
    assert html.count("<figure>") == 5
    assert "Textbook half: Now" not in html
    assert "<script" not in html
    linked = re.findall(r'href="([^"#]+)"', html)
    assert linked == ["fig-8-6b/check.json"]
    assert (page.parent / linked[0]).is_file()
    assert f"`{page}`" in summary.read_text(encoding="utf-8")
    record = json.loads((out / "check/fig-8-6b/check.json").read_text(encoding="utf-8"))
    assert record["objects"]["reference"]["sphere"] > 0.9
    assert record["causes"][0].startswith("Only the reference moved")
    change(baselines_folder / "fig-8-6b.json", factor=1 / 1.5)
    assert run(*words)[0] == 0
    assert not page.exists()


def test_a_summary_that_the_user_names_is_written_once(
    run, baselines_folder, tmp_path, monkeypatch
):
    summary = tmp_path / "s.md"
    monkeypatch.setenv("GITHUB_ACTIONS", "true")
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(summary))
    run("check", baselines_folder / "fig-8-6a.json", "-o", tmp_path / "out", "--summary", summary)
    assert summary.read_text(encoding="utf-8").count("### fotismos check") == 1


def test_a_summary_that_cannot_be_written_is_a_message(run, baselines_folder, tmp_path):
    (tmp_path / "file").write_text("")
    words = ("check", baselines_folder / "fig-8-6a.json", "-o", tmp_path / "out")
    code, _, messages = run(*words, "--summary", tmp_path / "file/s.md")
    assert (code, "Name a file that can be written to" in messages) == (2, True)


def test_a_baseline_from_before_a_metric_is_checked_without_it(run, baselines_folder, tmp_path):
    path = baselines_folder / "fig-8-6a.json"
    data = json.loads(path.read_text(encoding="utf-8"))
    for name in ("ldr_flip", "hdr_flip"):
        del data["metrics"][name]
    path.write_text(json.dumps(data), encoding="utf-8")
    code, printed, _ = run("check", path, "--json", "-o", tmp_path / "out")
    (found,) = json.loads(printed)["checks"]
    assert (code, set(found["metrics"])) == (0, set(data["metrics"]))
