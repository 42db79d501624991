"""Rungs from outside the package: found on the ladder, in the study, and in its tables."""

import re
from importlib.metadata import EntryPoint

import pytest

from comparisons.compare import prepare
from comparisons.cost import rungs
from comparisons.cost.cost import cost
from comparisons.cost.methods import Methods
from comparisons.cost.rungs import RUNGS, Kernel, Physical, Rung, declare
from comparisons.gallery.builtin import SCENES
from comparisons.options import Options
from heuristic import declared
from heuristic.errors import InputError
from reference.effects.light_forms import EXTENDED
from reference.effects.obstacles import INTERREFLECTION, OCCLUSION
from reference.scene.source import Source
from reports.terminal import cost_tables, tables
from tests.small_scene import PLAIN, SCENE
from tests.test_cost import TINY

TOY = Rung("path 2 without shadows", "physical", Physical(frozenset({OCCLUSION}), max_depth=2))


@pytest.fixture(autouse=True)
def only_here(monkeypatch):
    """Forget afterwards what a test declares."""
    monkeypatch.setattr(RUNGS, "_others", {})
    monkeypatch.setattr(RUNGS, "_loaded", False)


def named(name):
    source = SCENES[name].source()
    chosen = Options(resolution=(12, 12))
    return [rung.names for rung in Methods(source, chosen, prepare(source, chosen), (3,)).rungs]


def test_a_declared_rung_is_in_the_study_and_its_tables(rgb, scene_file):
    declare(TOY)
    scene_file.write_text(PLAIN, encoding="utf-8")
    study = cost(Source("plain", scene_file), Options(resolution=(12, 12)), TINY)
    points = {point.rung: point for point in study.record.points}
    assert TOY.name in points
    # Light that passes through the ball is brighter than with shadows.
    (direct,) = (rung.name for rung in study.record.rungs if "direct" in rung.names)
    assert study.rungs[TOY.name].mean() > 1.02 * study.rungs[direct].mean()
    assert any(TOY.name in line for line in cost_tables.lines(study.record))
    _, *rows = tables.methods(study.record)
    assert any(TOY.name in map(str, row) for row in rows)


def test_a_declared_rung_stands_before_the_full_plan(rgb):
    declare(TOY)
    assert named("plastic-spheres")[-2:] == [(TOY.name,), ("full plan",)]


def test_a_declared_rung_that_the_scene_cannot_tell_apart_is_merged(rgb):
    """Nothing shadows the one ball of the figure."""
    declare(TOY)
    assert named("fig-8-9")[-1] == ("direct", "path 3", TOY.name, "full plan")


STAND_IN = Rung(
    "half lit", "kernel", Kernel(heuristic="mean-ambient"), frozenset({INTERREFLECTION})
)


def left_out(name, rung):
    declare(rung)
    source = SCENES[name].source()
    chosen = Options(resolution=(12, 12))
    return Methods(source, chosen, prepare(source, chosen), (3,)).left_out


def test_a_stand_in_is_left_out_with_the_reason_where_there_is_nothing_to_stand_in_for(rgb):
    reason = left_out("fig-8-9", STAND_IN)[STAND_IN.name]
    assert reason == "it stands in for interreflection, which the scene does not have"
    assert STAND_IN.name not in left_out("cornell-box", STAND_IN)
    assert (STAND_IN.name,) in named("cornell-box")


def test_a_rung_whose_heuristic_refuses_the_scene_is_left_out_with_the_reason(rgb):
    method = Kernel(heuristic="harmonics-ambient")
    found = left_out("cornell-box", Rung("nine terms", "kernel", method))
    assert found["nine terms"] == "it has no environment"


def named_depths(source, chosen):
    return Methods(source, chosen, prepare(source, chosen), (3, 4)).left_out


def test_meshes_and_depths_that_a_scene_does_not_have_are_named(rgb, tmp_path):
    path = tmp_path / "parallel.xml"
    path.write_text(SCENE.replace("perspective", "orthographic"), encoding="utf-8")
    source = Source("parallel", path)
    chosen = Options(resolution=(12, 12))
    found = Methods(source, chosen, prepare(source, chosen), (3,)).left_out
    assert "has no single viewpoint" in found["Gouraud kernel"]
    assert "so no depth image" in found["ambient occlusion, depth image"]
    assert "path 4" not in found
    assert named_depths(source, chosen)["path 4"] == "the scene's own paths end at depth 3"


def test_a_study_records_what_it_left_out_and_what_was_prepared(rgb):
    record = cost(SCENES["cornell-box"].source(), Options(resolution=(12, 12)), TINY).record
    (nine,) = (method for method in record.left_out if method.name == "spherical harmonics")
    assert nine.reason == "it stands in for environment, which the scene does not have"
    lines = "\n".join(cost_tables.lines(record))
    assert f"left out: {nine.name}: {nine.reason}" in lines
    prepared = {point.rung: point.prepare_s for point in record.points}
    assert prepared["constant ambient"] > 0
    assert prepared["Phong kernel"] == prepared["direct"] == 0
    assert re.search(r"constant ambient .*s \([\d.]+ m?s\)", lines)


def test_declaring_a_name_again_replaces_the_rung():
    declare(TOY)
    again = Rung(TOY.name, "kernel", Kernel(shadows=True))
    declare(again)
    assert rungs.rungs()[-2] == again
    assert rungs.rungs()[-2:] == (again, rungs.FULL_PLAN)


def test_the_packages_own_names_are_refused():
    with pytest.raises(InputError, match=r"'direct' is already declared .* give another"):
        declare(Rung("direct", "physical", Physical()))


def test_what_no_integrator_leaves_out_is_refused():
    with pytest.raises(InputError, match=r"without extended lights .* occlusion, microfacets"):
        Physical(frozenset({EXTENDED}))


def test_an_installed_package_can_name_a_rung(monkeypatch):
    entry = EntryPoint("toy", "tests.test_declared_rungs:TOY", RUNGS.group)
    monkeypatch.setattr(
        declared, "entry_points", lambda group: [entry] if group == entry.group else []
    )
    assert rungs.rungs()[-2] == TOY


def test_an_entry_point_that_cannot_be_loaded_says_which(monkeypatch):
    entry = EntryPoint("toy", "tests.test_declared_rungs:MISSING", RUNGS.group)
    monkeypatch.setattr(declared, "entry_points", lambda group: [entry])
    with pytest.raises(InputError, match=r"rung toy: .*MISSING of fotismos\.rungs cannot"):
        rungs.rungs()
