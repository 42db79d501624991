"""The page grows while it is made: coarse pictures first, then scene by scene, then the rest."""

import json

import pytest

from comparisons.gallery import builtin
from comparisons.verification import Verification
from heuristic.errors import InputError, OutputError
from reports.commands import report
from reports.page.scene_view import SceneView
from reports.run import growing, output, single, tasks
from tests import records

NAMES = ("fig-8-5a", "fig-8-9")
WORDS = ("--resolution", "16x16", "--spp", "4", "--everything")


@pytest.fixture
def pages(monkeypatch):
    """What each writing of the page showed."""
    written, write = [], output.write_page

    def spy(folder, views, **shown):
        written.append((list(views), shown))
        write(folder, views, **shown)

    monkeypatch.setattr(output, "write_page", spy)
    return written


@pytest.fixture
def small_report(monkeypatch):
    """A report of two scenes without causes, whose page is written at every occasion."""
    monkeypatch.setattr(builtin, "SCENES", {name: builtin.SCENES[name] for name in NAMES})
    monkeypatch.setattr(single, "_explained", lambda case, progress, made, coarse: (made, None))
    monkeypatch.setattr(growing, "INTERVAL_S", 0.0)
    monkeypatch.setattr(growing, "SHARE", 1.0)
    monkeypatch.setattr(tasks, "hard_cases", lambda: None)


def view(name, is_coarse=False):
    return SceneView(record=records.record(scene=name), is_coarse=is_coarse)


@pytest.mark.guarantee(
    "runs",
    "A report's page appears with the first pictures, shows all scenes coarsely before "
    "refining any, and says how many are refined until it is finished.",
)
def test_a_report_grows_from_coarse_to_whole_to_hard_cases(run, small_report, pages, tmp_path):
    assert run("report", "-o", tmp_path / "out", *WORDS)[0] == 0
    coarse = [[v.is_coarse for v in views] for views, _ in pages]
    assert coarse[:4] == [[True], [True, True], [False, True], [False, False]]
    done = [shown["making"] and shown["making"].done for _, shown in pages]
    assert done == [0, 0, 1, 2, None]
    assert ["hard_cases" in shown for _, shown in pages] == [False] * 4 + [True]
    page = (tmp_path / "out/index.html").read_text(encoding="utf-8")
    assert "reload to see more" not in page
    assert "<b>Preview:</b>" not in page


def verified(name, *_):
    return Verification(
        scene=name, planned="direct", everything="path", resolution=(8, 8), significant=0,
        pixels=64, largest=0.0, heuristic_largest=0.0, planned_s=0.1, everything_s=0.2,
        planned_noise=0.1, everything_noise=0.1, gain=2.0, factors=(), planning_s=0.0, saved_s=0.1,
    )  # fmt: skip


def test_verifications_stand_beside_the_scenes_of_their_names(
    run, small_report, pages, tmp_path, monkeypatch
):
    monkeypatch.setattr(tasks, "verified", verified)
    assert run("report", "-o", tmp_path / "out", *WORDS[:-1])[0] == 0
    views, shown = pages[-1]
    assert [v.record.scene for v in views] == list(NAMES)
    assert [v.scene for v in shown["verifications"]] == list(NAMES)
    stages = json.loads((tmp_path / "out/run.json").read_text(encoding="utf-8"))["stages"]
    assert stages["verification and hard cases"] > 0.0


def test_a_verification_that_fails_leaves_the_scenes(run, small_report, tmp_path, monkeypatch):
    def fails(*_):
        raise InputError("it cannot be verified")

    monkeypatch.setattr(tasks, "verified", fails)
    code, _, told = run("report", "-o", tmp_path / "out", *WORDS[:-1])
    assert code == InputError.exit_code
    assert "it cannot be verified" in told
    text = (tmp_path / "out/index.html").read_text(encoding="utf-8")
    assert all(f'data-scene="{name}"' in text for name in NAMES)


def test_an_interrupted_report_keeps_its_page(run, small_report, tmp_path, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(tasks, "hard_cases", interrupted)
    assert run("report", "-o", tmp_path / "out", *WORDS)[0] == 130
    text = (tmp_path / "out/index.html").read_text(encoding="utf-8")
    assert "Interrupted: 2 of 2 scenes are refined" in text
    assert all(f'data-scene="{name}"' in text for name in NAMES)


def test_a_page_in_the_making_says_so(tmp_path):
    page = growing.Growing(tmp_path, ("a", "b"), seen=lambda _: None)
    page.coarse |= {name: view(name, is_coarse=True) for name in "ab"}
    page.views["a"] = view("a")
    page.offer()
    text = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert "In progress: 1 of 2 scenes are refined" in text
    assert text.count("<b>Preview:</b>") == 1
    page.write(making=page.making(is_interrupted=True))
    text = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert "Interrupted: 1 of 2 scenes are refined" in text
    assert "reload" not in text[: text.index("<main")]


def test_the_page_is_written_at_intervals_and_a_full_disk_ends_no_run(monkeypatch, tmp_path):
    now, written = [100.0], []

    def write(*_, **shown):
        written.append(shown["making"].done)
        now[0] += 2.0
        raise OutputError("the disk is full")

    monkeypatch.setattr(growing, "monotonic", lambda: now[0])
    monkeypatch.setattr(output, "write_page", write)
    page = growing.Growing(tmp_path, ("a", "b"), seen=lambda _: pytest.fail("not written"))
    page.offer()
    now[0] += 2.0 / growing.SHARE - 2.1
    page.offer()
    assert written == [0]
    now[0] += 0.2
    page.offer()
    assert written == [0, 0]


def test_a_page_is_opened_once_it_is_there(run, scene_file, tmp_path, monkeypatch):
    opened = []
    monkeypatch.setattr("webbrowser.open", lambda url: opened.append(url) or True)
    words = ("compare", scene_file, "-o", tmp_path / "out", "--spp", 4, "--no-why")
    assert run(*words)[0] == 0
    assert not opened
    assert run(*words, "--open")[0] == 0
    assert opened == [(tmp_path / "out/index.html").as_uri()]


def test_quick_takes_a_small_size_unless_another_is_given(run, small_report, pages, tmp_path):
    assert run("report", "--quick", "--spp", 4, "--everything", "-o", tmp_path / "out")[0] == 0
    (shown, _), _ = pages[-1]
    assert shown.record.resolution == report.QUICK["resolution"]
    assert shown.record.plan.spp == 4
    assert not any(one.is_coarse for views, _ in pages for one in views)
