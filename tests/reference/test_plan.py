"""Planning: what is left out is not there, and a plan simulates what is asked for."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from fotismos.comparisons.gallery.builtin import SCENES
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import prepare
from fotismos.reference.pairing.probe import AlbedoTable
from fotismos.reference.planning.effects import EFFECTS, INTERREFLECTION, OCCLUSION
from fotismos.reference.planning.facts import Facts
from fotismos.reference.planning.plan import wants_spectra
from fotismos.reference.scene.source import Source
from tests.shared import misplanned
from tests.shared.misplanned import BLACK, DIFFUSE, TWO_SIDED, octahedron
from tests.shared.parts import look_at, moved, rgb_of
from tests.shared.verification import kernel_difference, verify

WHITE = DIFFUSE
VIEWER = (0, -6, 3)


def scene(viewer=VIEWER, target=(0, 0, 0), **parts):
    return misplanned.scene(viewer, target, size=24, **parts)


def ball(center=(0, 0, 0), radius=1.0, bsdf=WHITE, **more):
    return {"type": "sphere", "center": center, "radius": radius, "bsdf": bsdf, **more}


def floor(height=-1.0, bsdf=WHITE):
    return {"type": "rectangle", "to_world": moved((0, 0, height), 5), "bsdf": bsdf}


def lamp(position, intensity=40.0):
    return misplanned.lamp(position, intensity)


def mesh(path, bsdf=WHITE, **form):
    return {"type": "ply", "face_normals": True, "filename": str(octahedron(path, **form))} | {
        "bsdf": bsdf
    }


def test_neither_a_speck_nor_what_shines_from_black_surroundings_is_pruned(rgb):
    """An occluder smaller than a pixel, and a coloured wall in a black room."""
    speck = scene(floor=floor(0.0), dust=ball((0, 0, 2.999), 0.0005), light=lamp((0, 0, 3)))
    assert prepare(Source("a speck", speck)).plan.calls_for(OCCLUSION)
    wall = {"type": "rectangle", "bsdf": WHITE}
    wall["to_world"] = look_at((-2, 0, 0)).scale(3)
    parts = {"ball": ball((0.8, 0, 0), 0.7), "floor": floor(-2.0, BLACK), "wall": wall}
    room = scene((0, -3.9, 0), **parts, light=lamp((-1, -1, 1.5)))
    assert prepare(Source("a room", room)).plan.calls_for(INTERREFLECTION)


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=() if name in ("fig-8-9", "fig-6-14") else pytest.mark.thorough)
        for name in SCENES
        if name != "narrow-band-lamp"
    ],
)
def test_every_built_in_scene_is_the_same_with_and_without_pruning(rgb, name):
    mi.set_variant(SCENES[name].variant)
    source, options = SCENES[name].source(), Options(resolution=(48, 48))
    assert verify(source, options).significant == 0
    assert kernel_difference(source, options) < 1e-6


def facts(parts):
    ready = prepare(Source("facts", scene(**parts, light=lamp((0, 0, 5)))))
    return Facts.of(ready.pair, ready.scene).by_name


def test_which_shapes_are_convex(rgb, tmp_path):
    """Not one with a dent of a thousandth."""
    found = facts(
        {
            "ball": ball(),
            "floor": floor(),
            "cube": {"type": "cube", "bsdf": WHITE},
            "tip": mesh(tmp_path / "tip.ply", height=2.0),
            "dent": mesh(tmp_path / "dent.ply", height=-1e-3),
            "bowl": mesh(tmp_path / "bowl.ply", faces=4, bsdf=TWO_SIDED),
            "tube": {"type": "cylinder", "bsdf": WHITE},
        }
    )
    assert {name for name, shape in found.items() if shape.is_convex} == {
        "ball", "floor", "cube", "tip"
    }  # fmt: skip
    assert found["floor"].plane is not None


def test_a_figure_is_planned_without_random_numbers(rgb):
    plan = prepare(SCENES["fig-8-9"].source()).plan
    assert (plan.integrator, plan.max_depth, plan.shadows) == ("direct_all", 2, False)
    assert plan.tabulated_environment
    assert plan.kernel_terms == ("k_a", "k_d", "k_s")
    assert [decision.name for decision in plan.effects] == [effect.label for effect in EFFECTS]


def test_several_points_among_diffuse_surfaces_are_exact_and_the_rest_is_sampled(rgb):
    parts = {"ball": ball(), "floor": floor(), "one": lamp((-3, -2, 4)), "two": lamp((3, -3, 3))}
    source = Source("split", scene(**parts))
    plan = prepare(source).plan
    assert (plan.integrator, plan.max_depth) == ("direct_all", -1)
    result = verify(source, Options(spp=256))
    assert result.significant == 0
    assert result.noise < 0.7
    glossy = parts | {"ball": ball(bsdf={"type": "roughplastic"})}
    assert prepare(Source("glossy", scene(**glossy))).plan.integrator == "path"


@pytest.mark.parametrize(
    ("spectrum", "wanted"),
    [
        (rgb_of(1, 0.5, 0.2), False),
        (0.5, False),
        ({"type": "d65"}, False),
        ({"type": "spectrum", "value": [(400, 0.1), (700, 0.9)]}, True),
        ({"type": "blackbody", "temperature": 3000.0}, True),
    ],
)
def test_spectra_are_called_for_where_three_numbers_are_too_few(rgb, spectrum, wanted):
    light = {"type": "point", "intensity": spectrum}
    assert wants_spectra(Source("spectra", scene(object=ball(), light=light)).parse()) is wanted


def test_the_scenes_own_depth_is_kept(rgb):
    parts = {"one": ball(), "floor": floor(), "light": lamp((0, -3, 4))}
    description = scene(**parts) | {"integrator": {"type": "path", "max_depth": 3}}
    for everything in (False, True):
        plan = prepare(Source("depth", description), Options(everything=everything)).plan
        assert plan.max_depth == 3
    direct = description | {"integrator": {"type": "path", "max_depth": 2}}
    assert prepare(Source("depth", direct)).plan.integrator == "direct_all"


def test_a_plan_simulates_what_is_asked_for_and_nothing_else(rgb):
    parts = {"ball": ball(bsdf={"type": "roughplastic"}), "floor": floor(), "lamp": lamp((0, 0, 4))}
    plan = prepare(Source("parts", scene(**parts))).plan
    assert plan.integrator == "path"
    everything = set(EFFECTS)
    assert plan.simulating(everything) is plan

    lit_once = plan.simulating(everything - {INTERREFLECTION})
    assert (lit_once.integrator, lit_once.max_depth) == ("direct_all", 2)
    assert (lit_once.shadows, lit_once.bsdf_samples) == (True, 1)
    assert plan.simulating(everything, max_depth=2) == lit_once

    unshadowed = plan.simulating(everything - {OCCLUSION})
    assert (unshadowed.integrator, unshadowed.max_depth) == ("direct_all", -1)
    assert (unshadowed.shadows, unshadowed.bsdf_samples) == (False, 0)

    neither = plan.simulating(everything - {OCCLUSION}, max_depth=2)
    assert neither == plan.simulating(everything - {OCCLUSION, INTERREFLECTION})
    assert (neither.max_depth, neither.shadows) == (2, False)

    shallow = plan.simulating(everything, max_depth=3)
    assert (shallow.integrator, shallow.max_depth) == ("path", 3)
    assert plan.simulating(everything - {OCCLUSION}, max_depth=3).integrator == "direct_all"


def test_the_table_of_the_environment_agrees_with_sampling(rgb):
    """The albedo over view angles against plain Monte Carlo of another size and generator."""
    bsdf = mi.load_dict({"type": "roughplastic", "alpha": 0.3, "int_ior": 2.0})
    table = AlbedoTable(bsdf)
    for mu in (1.0, 0.6, 0.2, 0.05):
        count = 1_000_000
        si = dr.zeros(mi.SurfaceInteraction3f, count)
        si.wi = mi.Vector3f((1 - mu**2) ** 0.5, 0, mu)
        rng = mi.PCG32(count)
        point = mi.Point2f(rng.next_float32(), rng.next_float32())
        weight = np.array(bsdf.sample(mi.BSDFContext(), si, rng.next_float32(), point)[1][0], float)
        error = weight.std() / count**0.5
        assert abs(np.array(table.at(mi.Float(mu)))[0, 0] - weight.mean()) < 5 * error + 2e-4


def test_an_effect_in_which_the_halves_differ_has_its_own_colour_and_its_sentence():
    differing = [effect for effect in EFFECTS if effect.colour]
    assert len({effect.colour for effect in differing}) == len(differing) > 0
    assert [bool(effect.meaning) for effect in EFFECTS] == [bool(e.colour) for e in EFFECTS]
