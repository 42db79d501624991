"""The rules of pruning: each is refused where a premise does not hold, and the images show why."""

import numpy as np
import pytest

from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import prepare
from fotismos.reference.planning.facts import Facts
from fotismos.reference.planning.rules import (
    CONVEX,
    FEW,
    LIGHT_BY_LIGHT,
    MOST_SHAPES,
    NO_MEDIUM,
    NO_SECOND_REFLECTION,
    NO_SHADOWS,
    OPAQUE,
    SEEN_FROM_OUTSIDE,
    STILL,
    TABULATED_ENVIRONMENT,
)
from fotismos.reference.scene.source import Source
from tests.shared.misplanned import (
    BLACK,
    DIFFUSE,
    SCENES,
    TWO_SIDED,
    lamp,
    scene,
    sphere,
    tube,
)
from tests.shared.parts import moved
from tests.shared.verification import planned, stock

SPP = 256


@pytest.mark.guarantee("plans", "A rule is rejected if a premise is not known to hold.")
@pytest.mark.parametrize("name", SCENES)
def test_the_plan_of_a_scene_that_was_planned_wrongly_is_right(rgb, name):
    _, (found, error) = planned(SCENES[name](), SPP)
    expected, noise = stock(SCENES[name](), SPP)
    assert abs(found - expected) < 0.002 * expected + 5 * np.hypot(error, noise) + 1e-6


PRINCIPLED = {"type": "principled", "base_color": 0.5}


def test_principled_only_reflects_unless_it_says_otherwise(rgb):
    light, none = lamp((0, -3, 3)), {"spec_trans": 0.0, "metallic": 1.0, "base_color": 0.0}
    for more in ({}, none):
        for bsdf in (PRINCIPLED | more, {"type": "twosided", "bsdf": PRINCIPLED | more}):
            (found,) = facts_of(scene(one=sphere(bsdf), light=light)).shapes
            assert (found.opaque, found.outer, found.inner) == (True, True, "bsdf" in bsdf)
    for clear in (0.2, {"type": "checkerboard"}):
        (found,) = facts_of(
            scene(one=sphere(PRINCIPLED | {"spec_trans": clear}), light=light)
        ).shapes
        assert (found.opaque, found.outer, found.inner) == (False, True, True)


def facts_of(description):
    ready = prepare(Source("premises", description))
    return Facts.of(ready.pair, ready.scene)


def test_a_scene_for_which_all_premises_hold_is_pruned(rgb):
    facts = facts_of(scene(ball=sphere(), sky={"type": "constant"}))
    for rule in (NO_SHADOWS, NO_SECOND_REFLECTION, TABULATED_ENVIRONMENT):
        assert rule.check(facts).applies


GLASS = {"type": "dielectric"}
MASKED = {"type": "mask", "opacity": 0.5, "bsdf": DIFFUSE}
BLENDED = {"type": "blendbsdf", "weight": 0.5, "one": DIFFUSE, "two": DIFFUSE}
FOG = {"type": "homogeneous", "albedo": 0.5, "sigma_t": 0.1}


def test_a_premise_that_fails_is_named(rgb):
    beside = {"viewer": (2.5, 0, 0), "target": (2.5, 1, 0)}
    hollow, near = sphere(bsdf=TWO_SIDED), {"near_clip": 4.0}
    for premise, parts in (
        (NO_MEDIUM, {"ball": sphere(bsdf={"type": "null"}, interior=FOG)}),
        (OPAQUE, {"ball": sphere(bsdf=GLASS)}),
        (OPAQUE, {"ball": sphere(bsdf=MASKED)}),
        (OPAQUE, {"ball": sphere(bsdf=BLENDED)}),
        (FEW, {f"ball {i}": sphere() for i in range(MOST_SHAPES + 1)}),
        (STILL, {"ball": sphere(), "lens": {"shutter_open": 0.0, "shutter_close": 1.0}}),
        (CONVEX, {"tube": {"type": "cylinder", "bsdf": DIFFUSE}}),
        (CONVEX, {"box": {"type": "cube", "flip_normals": True, "bsdf": DIFFUSE}}),
        (CONVEX, {"box": {"type": "cube", "bsdf": TWO_SIDED}}),
        (SEEN_FROM_OUTSIDE, {"ball": hollow, "lens": near}),
        (SEEN_FROM_OUTSIDE, {"ball": sphere(flip_normals=True), "lens": near}),
        (
            SEEN_FROM_OUTSIDE,
            {
                "ball": hollow,
                "lens": {"type": "thinlens", "focus_distance": 5.0, "aperture_radius": 3.0},
                **beside,
            },
        ),
        (SEEN_FROM_OUTSIDE, {"ball": hollow, "lens": {"type": "radiancemeter"}}),
    ):
        facts = facts_of(scene(light=lamp((0, -3, 3)), **parts))
        for rule in (NO_SHADOWS, NO_SECOND_REFLECTION):
            result = rule.check(facts)
            assert (result.premise, result.applies) == (premise.sentence, False), parts
            assert result.evidence


def test_a_table_over_cosines_is_for_one_isotropic_material(rgb):
    sky, sides = {"type": "constant"}, {"type": "twosided", "front": DIFFUSE}
    sides["back"] = {"type": "roughplastic"}
    for bsdf, applies in (
        ({"type": "roughconductor", "alpha": 0.3}, True),
        ({"type": "roughconductor", "alpha_u": 0.1, "alpha_v": 0.5}, False),
        ({"type": "diffuse", "reflectance": {"type": "checkerboard"}}, False),
    ):
        facts = facts_of(scene(ball=sphere(bsdf=bsdf), sky=sky))
        assert TABULATED_ENVIRONMENT.check(facts).applies is applies
    facts = facts_of(scene(plate={"type": "rectangle", "bsdf": sides}, sky=sky))
    assert not TABULATED_ENVIRONMENT.check(facts).applies


TUBES = {
    "round": ((0.5, 0.5, 0.9), True),
    "mirrored": ((0.5, 0.5, -0.5), False),
    "an ellipse": ((0.7, 0.3, 0.5), False),
}


@pytest.mark.parametrize("name", TUBES)
def test_a_cylinder_that_shines_is_sampled_where_rays_hit_it_if_the_plan_says_so(rgb, name):
    """By Mitsuba's own estimates: from samples of the lamp alone, and from its hits alone."""
    scale, is_right = TUBES[name]
    lit = tube(scale)
    assert LIGHT_BY_LIGHT.check(facts_of(lit)).applies is is_right
    (one, error), (other, noise) = (
        stock(lit | {"integrator": {"type": "direct", "hide_emitters": True, way: 0}}, SPP)
        for way in ("bsdf_samples", "emitter_samples")
    )
    assert (abs(one - other) < 0.02 * one + 5 * np.hypot(error, noise)) is np.bool_(is_right)


def test_a_lamp_whose_samples_are_not_its_hits_is_warned_of(rgb):
    ready = prepare(Source("tube", SCENES["a mirrored cylinder that shines"]()))
    (said,) = (line for line in ready.warnings() if "weights" in line)
    assert said.startswith("tube: samples of it may not be what rays hit")
    again = prepare(Source("sky", SCENES["an anisotropic sphere"]()))
    assert not any("weights" in line for line in again.warnings())


@pytest.mark.parametrize("integrator", ["direct", "path", "volpath"])
def test_a_mask_reflects_its_share_whatever_the_scene_asks_for(rgb, integrator):
    """Half opaque, it reflects half of the light; `path` loses what rays gather that pass twice."""
    masked = {"type": "mask", "opacity": 0.5, "bsdf": DIFFUSE}
    sun = {"type": "directional", "direction": (0.3, 1, -0.2), "irradiance": 1.0}
    images = {}
    for bsdf in (DIFFUSE, masked):
        source = Source("mask", scene(integrator=integrator, ball=sphere(bsdf), sun=sun))
        ready = prepare(source, Options(spp=SPP))
        images[bsdf["type"]] = np.array(ready.reference.render(1)).mean()
    assert images["mask"] == pytest.approx(0.5 * images["diffuse"], rel=0.01)


@pytest.mark.parametrize("opacity", [0.0, 0.3])
@pytest.mark.parametrize("integrator", ["direct", "path"])
def test_masks_let_through_their_share_of_light_and_hide_no_lamp_that_is_hidden(
    rgb, opacity, integrator
):
    """A floor receives its share of light from behind a mask, also where a lamp is hidden."""
    mask = {"type": "mask", "opacity": opacity, "bsdf": BLACK}
    plates = {
        "floor": {"type": "rectangle", "to_world": moved((0, 0, 0), 4), "bsdf": DIFFUSE},
        "mask": {"type": "rectangle", "to_world": moved((0, 0, 2), 4), "bsdf": mask},
        "ball": sphere(BLACK) | {"to_world": moved((0, 0, 1), 0.2)},
        "point": {"type": "point", "position": (0, 0, 3), "intensity": 9.0},
    }
    plates["ball"]["emitter"] = {"type": "area", "radiance": 1e-6}
    found = []
    for name in ("mask", "none"):
        shown = {key: value for key, value in plates.items() if key != "mask" or name == "mask"}
        own = {"type": integrator, "hide_emitters": True}
        described = scene((0, 0, 1.5), integrator=own, size=8, **shown)
        ready = prepare(Source("mask", described), Options(spp=SPP))
        found.append(np.array(ready.reference.render(1)).mean())
    assert found[0] == pytest.approx((1 - opacity) * found[1], rel=0.01)
