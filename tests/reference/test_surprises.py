"""What stock Mitsuba does that good guesses miss: rows of docs/surprises.md."""

import math

import mitsuba as mi
import numpy as np
import pytest

FACING = {"type": "directional", "direction": [0, 0, -1], "irradiance": math.pi}
WHITE = {"type": "diffuse", "reflectance": 1.0}


def camera(**more):
    film = {"type": "hdrfilm", "width": 1, "height": 1, "rfilter": {"type": "box"}}
    view = mi.ScalarTransform4f().look_at([0, 0, 5], [0, 0, 0], [0, 1, 0])
    return {"type": "perspective", "fov": 1.0, "to_world": view, "film": film, **more}


def seen(spp=16, **parts):
    """The value of the single pixel, in red."""
    scene = {"type": "scene", "integrator": {"type": "path"}, "sensor": camera(), **parts}
    return np.array(mi.render(mi.load_dict(scene), spp=spp)).ravel()[0]


@pytest.mark.parametrize("wrapper", ["normalmap", "bumpmap"])
def test_mapped_normals_are_darker_than_their_cosine_by_default(rgb, wrapper):
    """A tilt of 60 degrees, lit along the mapped normal's mean of both: 0.867 for 0.993."""
    tilt = math.radians(60)
    if wrapper == "normalmap":
        code = [0.5 + 0.5 * math.sin(tilt), 0.5, 0.5 + 0.5 * math.cos(tilt)]
        texture = np.tile(np.float32(code), (4, 4, 1))
        key = "normalmap"
    else:
        # The rectangle is 2 wide, and u runs from 0 to 1.
        slope = -2 * math.tan(tilt)
        texture = (slope * (np.arange(64, dtype=np.float32) + 0.5) / 64)[None, :, None]
        texture = np.tile(texture, (4, 1, 1))
        key = "arbitrary"
    wall = {"type": wrapper, "nested": WHITE}
    wall[key] = {"type": "bitmap", "raw": True, "bitmap": mi.Bitmap(texture)}
    toward = np.array([math.sin(math.radians(53)), 0, math.cos(math.radians(53))])
    light = FACING | {"direction": (-toward).tolist()}
    values = [
        seen(wall={"type": "rectangle", "bsdf": wall | more}, light=light)
        for more in ({"use_shadowing_function": False}, {})
    ]
    assert values[0] == pytest.approx(math.cos(math.radians(7)), abs=5e-3)
    assert values[1] == pytest.approx(0.867, abs=8e-3)


def test_a_dictionary_shares_equal_materials_and_merges_their_meshes(rgb):
    def cube(place):
        return {"type": "cube", "to_world": mi.ScalarTransform4f().translate(place), "bsdf": WHITE}

    content = {"type": "scene", "left": cube([-3, 0, 0]), "right": cube([3, 0, 0])}
    names = {
        optimize: [shape.id() for shape in mi.load_dict(content, optimize=optimize).shapes()]
        for optimize in (True, False)
    }
    assert sorted(names[False]) == ["left", "right"]
    assert len(names[True]) == 1
    assert not {"left", "right"} & set(names[True])


def test_depth_begins_at_the_near_plane(rgb):
    wall = {"type": "rectangle"}
    depths = [
        seen(integrator={"type": "depth"}, sensor=camera(near_clip=near), wall=wall)
        for near in (0.01, 2.0)
    ]
    np.testing.assert_allclose(depths, [5 - 0.01, 5 - 2.0], rtol=1e-3)


def test_a_spot_falls_off_linearly_with_the_angle(rgb):
    """From three quarters of the cone, by default."""
    values = [
        seen(
            light={
                "type": "spot",
                "cutoff_angle": 20.0,
                "to_world": mi.ScalarTransform4f()
                .translate([0, 0, 4])
                .rotate([0, 1, 0], 180 - degrees),
                "intensity": 16 * math.pi,
            },
            wall={"type": "rectangle", "bsdf": WHITE},
        )
        for degrees in (0, 14, 16, 17.5, 19)
    ]
    np.testing.assert_allclose(values, [1, 1, 0.8, 0.5, 0.2], atol=0.01)


def test_a_film_writes_half_floats_that_overflow(rgb, tmp_path):
    path = str(tmp_path / "x.exr")
    sky = {"type": "constant", "radiance": 1e5}
    scene = mi.load_dict(
        {"type": "scene", "integrator": {"type": "path"}, "s": camera()} | {"k": sky}
    )
    image = mi.render(scene, spp=4)
    scene.sensors()[0].film().write(path)
    assert np.isinf(np.array(mi.Bitmap(path))).all()
    mi.util.write_bitmap(path, image, write_async=False)
    np.testing.assert_allclose(np.array(mi.Bitmap(path)), 1e5)


def test_the_first_row_of_an_envmap_is_seen_and_never_sampled(rgb):
    rows = np.zeros((8, 16, 3), np.float32)
    rows[0] = 1
    sky = {"type": "envmap", "bitmap": mi.Bitmap(rows)}
    up = mi.ScalarTransform4f().look_at([0, 0, 0], [0, 1, 0.01], [0, 0, 1])
    assert seen(sky=sky, sensor=camera(to_world=up)) > 0.9
    floor = {"type": "rectangle", "to_world": mi.ScalarTransform4f().rotate([1, 0, 0], -90)}
    down = mi.ScalarTransform4f().look_at([0, 2, 0], [0, 0, 0.01], [0, 0, 1])
    lit = {"floor": floor | {"bsdf": WHITE}, "sky": sky, "sensor": camera(to_world=down)}
    by_sky = {"type": "direct", "bsdf_samples": 0, "emitter_samples": 1}
    by_surface = {"type": "direct", "bsdf_samples": 1, "emitter_samples": 0}
    values = [seen(spp=1 << 16, integrator=each, **lit) for each in (by_sky, by_surface)]
    assert values == [0, pytest.approx(0.065, rel=0.05)]
