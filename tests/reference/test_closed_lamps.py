"""Lamps whose light leaves through their own shape, or stays in it: balls, boxes, domes."""

import mitsuba as mi
import numpy as np
import pytest

from fotismos.comparisons.compare import compare
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import pair_for
from fotismos.comparisons.steps import steps
from fotismos.reference.scene.source import Source
from tests.shared.parts import camera, mesh_of, moved, rgb_of

WHITE = {"type": "diffuse", "reflectance": 0.6}
LAMPS = {
    "ball": {"type": "sphere"},
    "box": {"type": "cube"},
    "tube": {"type": "cylinder", "p0": (0, 0, -1)},
}


def room(kind):
    """A floor, a small ball on it, and a lamp above that is closed or nearly."""
    lamp = LAMPS[kind] | {"to_world": moved((1.5, 0, 3), 0.4)}
    return {
        "type": "scene",
        "sensor": camera((0, -6, 4), size=(48, 36)),
        "floor": {"type": "rectangle", "to_world": moved(0, 4), "bsdf": WHITE},
        "ball": {"type": "sphere", "center": (-1, 0, 0.5), "radius": 0.5, "bsdf": WHITE},
        "lamp": lamp | {"bsdf": WHITE, "emitter": {"type": "area", "radiance": 20.0}},
    }


@pytest.mark.parametrize("kind", LAMPS)
def test_a_lamp_casts_no_shadow_on_what_it_lights(rgb, kind):
    pair = pair_for(Source("lamp", room(kind)), Options())
    scene = pair.heuristic.instantiate()
    floor = {"spp": 16, "seed": 1}
    bare, shadowed, mapped, traced = (
        np.array(mi.render(scene, integrator=mi.load_dict(each), **floor))
        for each in (
            {"type": "heuristic"},
            {"type": "heuristic", "occlusion": True},
            {"type": "heuristic", "model": "shadow-map"},
            {"type": "direct"},
        )
    )
    lit = bare.mean(axis=2) > 0.01
    kept = [np.mean(each.mean(axis=2)[lit] > 0.01) for each in (shadowed, mapped, traced)]
    # The ball's shadow, and the part of the ball that it shades itself.
    assert min(kept) > 0.85
    assert max(kept) < 1


@pytest.mark.thorough
@pytest.mark.parametrize("kind", ["ball", "box"])
def test_shadows_are_not_blamed_for_the_lamp(rgb, kind):
    small = Options(resolution=(48, 36), spp=16)
    found = compare(Source("lamp", room(kind)), small, then=steps(why=True)).record.why
    errors = {each.effects: each.error for each in found.hybrids}
    assert errors["occlusion",] < 1.5 * errors[()]
    removed = {one.effect: one.removes.value for one in found.effects}
    assert removed["occlusion"] > -1
    assert abs(removed["extended lights"]) < 3


INWARDS = {"flip_normals": True}
BALL = {"type": "sphere", "radius": 0.5, "bsdf": {"type": "diffuse", "reflectance": 0.5}}
FLOOR = {"type": "rectangle", "to_world": moved(0, 2), "bsdf": BALL["bsdf"]}
REGULAR = {"type": "regular", "wavelength_min": 360.0, "wavelength_max": 830.0}


def around(thing, *lamps, **more):
    """A thing that is seen from nearby, and lamps that reflect nothing."""
    black = {"type": "diffuse", "reflectance": 0.0}
    shining = {f"lamp {number}": {"bsdf": black, **lamp} for number, lamp in enumerate(lamps)}
    view = camera((0, -3, 0.8), size=24, fov=10.0)
    return {"type": "scene", "sensor": view, "thing": thing, **shining, **more}


def shell(folder, start, end, radius=6.0):
    """A part of a sphere about the origin, from angle to angle off +z, that shines inwards."""
    theta, phi = np.radians(np.linspace(start, end, 13)), np.linspace(0, 2 * np.pi, 33)
    theta, phi = (each.ravel() for each in np.meshgrid(theta, phi, indexing="ij"))
    sine = np.sin(theta)
    points = radius * np.stack([sine * np.cos(phi), sine * np.sin(phi), np.cos(theta)], axis=1)
    corners = (33 * row + column for row in range(12) for column in range(32))
    faces = [face for a in corners for face in ((a, a + 34, a + 33), (a, a + 1, a + 34))]
    path = folder / f"{start}-{end}.ply"
    mesh_of(points, faces=faces).write_ply(str(path))
    return {"type": "ply", "filename": str(path), "face_normals": True}


def area(radiance=2.0):
    return {"emitter": {"type": "area", "radiance": radiance}}


def both(scene, spp=256):
    """The pair of a scene, and the mean colour of its textbook half and of direct light."""
    found = pair_for(Source("around", scene), Options())
    direct = mi.load_dict({"type": "direct", "bsdf_samples": 1, "emitter_samples": 1})
    textbook = np.array(mi.render(found.heuristic.instantiate(), spp=4, seed=0))
    right = np.array(mi.render(found.physical.instantiate(), integrator=direct, spp=spp, seed=0))
    return found, textbook, right


def case_of(folder, name):
    T = mi.ScalarTransform4f
    pixels = np.indices((16, 16)).sum(axis=0)[..., None] % 2 * np.float32((4, 2, 1))
    checked = {"type": "bitmap", "raw": True, "bitmap": mi.Bitmap(pixels.astype(np.float32))}
    ball = {"type": "sphere", "radius": 6.0} | INWARDS
    box = {"type": "cube", "to_world": moved(0, 6)} | INWARDS
    tube = {"type": "cylinder", "p0": (0, 0, -90), "p1": (0, 0, 90), "radius": 6.0} | INWARDS
    return {
        "ball": (BALL, ball | area()),
        "box": (BALL, box | area()),
        "floor in a box": (FLOOR, box | area()),
        "tube": (BALL, tube | area()),
        "dome over a floor": (FLOOR, shell(folder, 0, 90) | area()),
        "two domes": (BALL, shell(folder, 0, 90) | area(), shell(folder, 90, 180) | area()),
        "off centre": (BALL, ball | {"center": (1, 2, -1)} | area()),
        "long box": (BALL, box | {"to_world": T().scale((7, 5, 9))} | area()),
        "mirrored, coloured": (
            BALL, {"type": "sphere", "to_world": T().scale((-6, 6, 6))} | area(rgb_of(3, 2, 1))),
        "checked": (BALL, ball | area(checked)),
        "one that shines outwards": (BALL, ball | {"flip_normals": False} | area()),
        "one beside": (BALL, ball | {"radius": 0.7, "center": (0.9, -0.8, 1)} | area()),
    }[name]  # fmt: skip


EXACT = "ball", "box", "floor in a box", "dome over a floor", "off centre", "long box"
NEAR = "tube", "two domes", "checked"
NOTHING = "one that shines outwards", "one beside"


@pytest.mark.parametrize("name", [*EXACT, "mirrored, coloured", *NEAR, *NOTHING])
def test_a_lamp_around_the_scene_is_ambient_light(rgb, tmp_path, name):
    """A white surface that sees the radiance L all over its hemisphere sends L itself."""
    thing, *lamps = case_of(tmp_path, name)
    found, textbook, right = both(around(thing, *lamps))
    records = [light for light in found.pairing.emitters if light.given == "area"]
    assert {light.derived for light in records} == {"ambient"}
    assert bool(found.unrepresentable) is (name in NEAR)
    expected = {"mirrored, coloured": (1.5, 1, 0.5), "checked": (1, 0.5, 0.25)}.get(name, 1.0)
    expected = 0.0 if name in NOTHING else np.broadcast_to(expected, 3)
    np.testing.assert_allclose(textbook - expected, 0, atol=0.02 if name in NEAR else 1e-6)
    np.testing.assert_allclose(right.mean(axis=(0, 1)) - expected, 0, atol=0.02)


@pytest.mark.parametrize(
    ("scale", "derived"), [(1.0, "ambient"), (0.2, "heuristic_spot"), (0.05, "heuristic_spot")]
)
def test_a_half_open_lamp_becomes_what_is_nearer_and_names_the_loss(rgb, tmp_path, scale, derived):
    dish = shell(tmp_path, 0, 40) | {"to_world": moved((0, 0, 6 - 6 * scale), scale)} | area()
    found, textbook, right = both(around(FLOOR, dish))
    (record,) = found.pairing.emitters
    assert record.derived == derived
    (lost,) = found.unrepresentable
    assert lost.name == "lamp 0"
    assert textbook.mean() == pytest.approx(right.mean(), rel=0.12)


def test_light_of_lamps_around_the_scene_adds_to_other_ambient_light(rgb, tmp_path):
    sky = {"type": "constant", "radiance": rgb_of(1, 2, 3)}
    lamp = {"type": "sphere", "radius": 6.0} | INWARDS | area()
    _, textbook, _ = both(around(BALL, lamp, sky=sky), spp=1)
    np.testing.assert_allclose(textbook - 0.5 * np.array((3, 4, 5)), 0, atol=1e-6)
    given = around(BALL, lamp) | {"integrator": {"type": "heuristic", "ambient": 0.5}}
    _, textbook, _ = both(given, spp=1)
    np.testing.assert_allclose(textbook, 1.25, atol=1e-6)


def test_spectra_of_lamps_around_the_scene_add_to_daylight(spectral):
    """Plain numbers are daylight in emitters: beside a tabulated spectrum, too."""
    ball = {"type": "sphere", "radius": 6.0} | INWARDS
    even = area(REGULAR | {"values": "1, 3, 2"})
    images = [
        both(around(BALL, *lamps), spp=1)[1]
        for lamps in ([ball | even], [ball | area()], [ball | even, ball | area()])
    ]
    means = [image.mean(axis=(0, 1)) for image in images]
    np.testing.assert_allclose(means[2], means[0] + means[1], rtol=0.02)


@pytest.mark.thorough
@pytest.mark.parametrize("hide", [False, True])
def test_what_a_lamp_around_the_scene_changes_is_called_environment(rgb, tmp_path, hide):
    scene = around(
        BALL, shell(tmp_path, 0, 90) | area(), sky={"type": "constant", "radiance": 0.5},
        integrator={"type": "path", "max_depth": 2, "hide_emitters": hide},
    )  # fmt: skip
    small = Options(resolution=(16, 16), spp=64)
    found = compare(Source("dome", scene), small, then=steps(True)).record.why
    assert {each.effect for each in found.effects} == {"occlusion", "environment"}
    errors = [each.error for each in found.hybrids]
    assert abs(errors[-1]) < 0.2 < 1 < errors[0]
