"""Scenes in which Mitsuba's integrators disagree: what the plan renders, and what is said of it."""

import mitsuba as mi
import numpy as np
import pytest

from fotismos.comparisons.compare import compare
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import prepare
from fotismos.reference.planning.facts import Facts
from fotismos.reference.planning.rules import LIGHT_BY_LIGHT
from fotismos.reference.records import RR_DEPTH
from fotismos.reference.scene.source import Source
from fotismos.reports import verdict
from tests.shared.misplanned import BLACK, DIFFUSE, TWO_SIDED, lamp, octahedron, scene
from tests.shared.parts import look_at, moved
from tests.shared.verification import planned, stock


def shining(to_world, **emitter):
    """A black rectangle that shines."""
    emitter = {"type": "area", "radiance": 4.0, **emitter}
    return {"type": "rectangle", "to_world": to_world, "bsdf": BLACK, "emitter": emitter}


def agree(one, other):
    (mean, error), (expected, noise) = one, other
    return bool(abs(mean - expected) < 0.001 * expected + 4 * np.hypot(error, noise))


# --- Mesh lamps ------------------------------------------------------------------------------


def lit_by_meshes(folder, face_normals):
    """Two octahedra that shine on a floor."""
    found = {"floor": {"type": "rectangle", "bsdf": DIFFUSE, "to_world": moved(0, 4)}}
    for number, x in enumerate((-1.2, 1.2)):
        found[f"lamp{number}"] = {
            "type": "ply",
            "filename": str(octahedron(folder / "lamp.ply")),
            "face_normals": face_normals,
            "to_world": moved((x, 0, 0.7)).rotate((1, 1, 0), 25).scale((0.3, 0.7, 0.2)),
            "emitter": {"type": "area", "radiance": 4.0},
            "bsdf": BLACK,
        }
    return scene((0, -5, 3), integrator="direct", **found)


@pytest.mark.guarantee(
    "plans", "Mesh lamps with smooth normals are left to the scene's own integrator."
)
@pytest.mark.parametrize("face_normals", [True, False])
def test_the_light_of_a_mesh_with_smooth_normals_is_stock_mitsubas(rgb, tmp_path, face_normals):
    described = lit_by_meshes(tmp_path, face_normals)
    ways = [
        described | {"integrator": {"type": "direct", "hide_emitters": True, way: 0}}
        for way in ("bsdf_samples", "emitter_samples")
    ]
    assert agree(*map(stock, ways)) is face_normals
    described["point"] = lamp((0, 0, 2.5), 2.0)
    made, found = planned(described)
    facts = Facts.of(made.pair, made.scene)
    assert LIGHT_BY_LIGHT.check(facts).applies is face_normals
    assert agree(found, stock(described))


# --- Hidden lamps ----------------------------------------------------------------------------


def behind_a_lamp(shape, integrator, near_clip=None):
    """A shape behind a large lamp, which is hidden, or behind the near clip plane."""
    return scene(
        integrator={"type": integrator, "hide_emitters": near_clip is None},
        lens={"near_clip": near_clip} if near_clip else {},
        body={"bsdf": DIFFUSE, **shape},
        lamp=shining(look_at((0, -2, 0)).scale(1.5)),
    )


@pytest.mark.guarantee("plans", "What the camera sees through a hidden lamp is lit right.")
@pytest.mark.parametrize(
    "plugin",
    [
        "disk",
        *(pytest.param(n, marks=pytest.mark.thorough) for n in ("sphere", "cylinder", "rectangle")),
    ],
)
def test_a_shape_seen_through_a_hidden_lamp_is_as_bright_as_without_looking_through(rgb, plugin):
    to_world = look_at((0, 0, 0), (0, -4, 0))
    shape = {"type": plugin, "to_world": to_world} if plugin in ("disk", "rectangle") else {}
    shape = shape or {"type": plugin}
    truth = stock(behind_a_lamp(shape, "path", near_clip=2.5))
    for integrator in ("path", "direct", "volpath"):
        described = behind_a_lamp(shape, integrator)
        made, found = planned(described)
        if integrator != "direct" or plugin != "cylinder":  # its inside is lit by itself
            assert agree(found, truth), (integrator, made.plan.integrator, found, truth)
        _, whole = planned(described, everything=True)
        assert agree(whole, found), (integrator, whole, found)


def seen_through_a_ball(max_depth=-1, flip_normals=True, body="cylinder", aside=0.0):
    """A shape behind a hidden ball that shines, to one side or inwards."""
    ball = {"type": "sphere", "to_world": moved((aside, 0.2, 1.3), 1.59), "bsdf": BLACK}
    emitter = {"type": "area", "radiance": 10.0}
    return scene(
        integrator={"type": "path", "hide_emitters": True, "max_depth": max_depth},
        ball=ball | {"flip_normals": flip_normals, "emitter": emitter},
        body={"type": body, "to_world": moved((0, 4, 0), 0.8), "bsdf": DIFFUSE},
        floor={"type": "rectangle", "to_world": moved((0, 0, -1), 4), "bsdf": TWO_SIDED},
        point=lamp((0, -3, 2.0)),
    )


@pytest.mark.thorough
@pytest.mark.guarantee(
    "plans", "What is seen through both sides of a hidden lamp is warned of first."
)
def test_a_shape_seen_through_both_sides_of_a_hidden_lamp_is_warned_of(rgb):
    """Mitsuba's volpath lights it as if it were inside."""
    for flip_normals in (True, False):
        source = Source("a test", seen_through_a_ball(flip_normals=flip_normals, body="sphere"))
        ready = prepare(source)
        assert ready.plan.integrator == "volpath"
        assert "through both sides of a hidden lamp" in ready.doubt()
        assert "integrator" in {entry.what for entry in ready.overridden}
    record = compare(source, Options(spp=4, resolution=(16, 16))).record
    assert verdict.headline([record]).startswith("a test: The reference is wrong at")
    for described in (
        seen_through_a_ball(max_depth=2, body="sphere", flip_normals=False),
        seen_through_a_ball(body="cube"),
        seen_through_a_ball(body="sphere", aside=9.0),
    ):
        ready = prepare(Source("a test", described))
        assert ready.doubt() == ""
        is_override = "integrator" in {entry.what for entry in ready.overridden}
        assert is_override is (ready.plan.integrator == "volpath")


CORNERS = ((-0.3, -0.3, 3), (-0.3, 0.3, 3), (0.3, 0.3, 3), (0.3, -0.3, 3))
"""Of a square that faces down."""


@pytest.mark.thorough
@pytest.mark.parametrize(("degrees", "is_right"), [(0, True), (0.3, True), (5, False), (50, False)])
def test_the_verdict_waits_where_a_lamps_normals_are_tilted(rgb, tmp_path, degrees, is_right):
    """Mitsuba samples it by them. Samples of the BSDF alone, and the spot, are as without tilt."""
    tilt = np.deg2rad(degrees)
    rows = [f"v {x} {y} {z}" for x, y, z in CORNERS]
    rows.append(f"vn {np.sin(tilt):.6f} 0 {-np.cos(tilt):.6f}")
    rows += ["f 1//1 2//1 3//1", "f 1//1 3//1 4//1"]
    (tmp_path / "lamp.obj").write_text("\n".join(rows), encoding="utf-8")
    shape = {"type": "obj", "filename": str(tmp_path / "lamp.obj"), "bsdf": BLACK}
    described = scene(
        (0, -6, 1.5),
        integrator={"type": "path", "max_depth": 2},
        size=16,
        lamp=shape | {"emitter": {"type": "area", "radiance": 10.0}},
        floor={"type": "rectangle", "to_world": moved((0, 0, 0), 2), "bsdf": DIFFUSE},
    )
    source = Source("a test", described)
    ready = prepare(source, Options(spp=64))
    (spot,) = ready.pair.heuristic.nodes(mi.ObjectType.Emitter)
    aim = np.ravel(ready.pair.heuristic.props(spot)["direction"])
    np.testing.assert_allclose(aim, (0, 0, -1), atol=1e-6)
    by_rays = {"type": "direct", "emitter_samples": 0, "bsdf_samples": 4}
    truth = mi.render(mi.load_dict(described), integrator=mi.load_dict(by_rays), spp=4096)
    found = np.array(ready.reference.render(0)).mean()
    assert (found == pytest.approx(np.array(truth).mean(), rel=0.02)) or not is_right
    record = compare(source, Options(spp=16)).record
    assert (record.caution == "") is is_right
    if not is_right:
        assert "the normals of the lamp lamp are tilted from its surface" in record.caution
        assert verdict.decision(record) == "undecided"
        assert verdict.headline([record]).startswith("a test: The reference is wrong")


# --- Settings of the scene's own integrator --------------------------------------------------


def mirrored(integrator, sampling_weight=1.0):
    """A mirror that shows a lamp, on a floor."""
    mirror, below = look_at((0, 1, 0), (0, -4, 0)), moved((0, 0, -1), 4)
    above = look_at((0, -2, 1.5), (0, 1, 0), (0, 1, 0)).scale(0.7)
    return scene(
        integrator=integrator,
        mirror={"type": "rectangle", "to_world": mirror, "bsdf": {"type": "conductor"}},
        lamp=shining(above, sampling_weight=sampling_weight),
        point=lamp((0, -3, 0)),
        floor={"type": "rectangle", "to_world": below, "bsdf": DIFFUSE},
    )


def overridden(description):
    ready = prepare(Source("a test", description))
    return {entry.what: (entry.given, entry.used) for entry in ready.overridden}


@pytest.mark.guarantee("plans", "Integrator settings that a plan does not use are named.")
def test_samples_of_direct_and_weights_that_change_the_light_are_named(rgb):
    given = {"type": "direct", "bsdf_samples": 0, "emitter_samples": 4}
    found = overridden(mirrored(given))
    assert (found["bsdf_samples"][0], found["emitter_samples"][0]) == ("0", "4")
    assert overridden(mirrored({"type": "direct"})) == {}
    assert overridden(mirrored({"type": "direct", "shading_samples": 1})) == {}
    found = overridden(mirrored({"type": "path"}, sampling_weight=0.0))
    assert found["sampling_weight of lamp"] == ("0", "1")


@pytest.mark.parametrize(
    ("sampler", "asked", "rendered"),
    [
        ("independent", 100, 100),
        ("ldsampler", 100, 256),
        ("orthogonal", 10, 25),
        ("stratified", 5, 9),
        ("multijitter", 5, 6),
    ],
)
def test_the_record_has_the_samples_asked_for_those_of_mitsuba_and_of_the_plan(
    rgb, sampler, asked, rendered
):
    given = scene(ball={"type": "sphere"}, lamp=lamp((0, -3, 0)))
    given["sensor"]["sampler"] = {"type": sampler, "sample_count": asked}
    count, used = overridden(given)["sampler"]
    assert count.startswith(f"{sampler}, {asked} samples per pixel")
    stock = mi.load_dict(given["sensor"]["sampler"]).sample_count()
    assert stock == rendered
    assert ("of which Mitsuba makes" in count) == (asked != rendered)
    assert asked == rendered or count.endswith(f" {rendered}")
    assert used.startswith("rotated_multijitter, ")


def test_the_depth_of_russian_roulette_is_the_one_used(rgb):
    """`direct_all` ends paths by its own depth, whatever the scene names."""
    lamps = {"lamp": lamp((0, -3, 0)), "second": lamp((0, -3, 2))}
    floor = {"type": "rectangle", "to_world": moved((0, 0, -1), 4), "bsdf": DIFFUSE}
    wall = {"type": "rectangle", "to_world": look_at((0, 1, 0), (0, -4, 0)), "bsdf": DIFFUSE}
    for given, entry in ((5, ("5", str(RR_DEPTH))), (RR_DEPTH, None)):
        integrator = {"type": "path", "rr_depth": given}
        described = scene(integrator=integrator, floor=floor, wall=wall, **lamps)
        plan = prepare(Source("a test", described)).plan
        assert (plan.integrator, plan.rr_depth) == ("direct_all", RR_DEPTH)
        assert overridden(described).get("rr_depth") == entry


@pytest.mark.thorough
@pytest.mark.parametrize("integrator", ["path", "direct"])
def test_a_light_without_a_weight_shines_like_any_other(rgb, integrator):
    _, found = planned(mirrored({"type": integrator}, sampling_weight=0.0))
    assert agree(found, stock(mirrored({"type": integrator})))
