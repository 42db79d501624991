"""Wavelengths: what three numbers a colour cannot say, and what the spectral variant does."""

import re

import mitsuba as mi
import numpy as np
import pytest

from fotismos.comparisons.compare import compare
from fotismos.comparisons.gallery.builtin import SCENES
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import prepare
from fotismos.heuristic.errors import InputError, NonFiniteError
from fotismos.reference import Source
from fotismos.reference.pairing import halves
from tests.shared.misplanned import scene


def test_rgb_cannot_tell_metamers_apart_and_spectra_can(rgb):
    def colours(variant):
        mi.set_variant(variant)
        result = compare(SCENES["metameric-pair"].source(), Options(spp=16, resolution=(32, 18)))
        image, counted = result.images.heuristic, result.images.counted
        halves = np.arange(32) < 16
        return [image[counted & side].mean(axis=0) for side in (halves, ~halves)]

    plain, other = colours("llvm_ad_rgb")
    assert other / other.sum() == pytest.approx(plain / plain.sum(), rel=1e-3)
    plain, other = colours("llvm_ad_spectral")
    assert np.abs(other / other.sum() - plain / plain.sum()).max() > 0.01


BRIGHT = np.tile(np.float32([10, 8, 6]), (4, 4, 1))
POINT = {"type": "point", "position": [1, -4, 3], "intensity": 30.0}


def under_a_point(bsdf):
    return scene((0, -4, 1), size=8, ball={"type": "sphere", "bsdf": bsdf}, lamp=POINT)


def metal(**values):
    return under_a_point({"type": "roughconductor", "alpha": 0.3, **values})


def coloured(*values):
    return {"type": "rgb", "value": list(values)}


def pictured(values=BRIGHT):
    return {"type": "bitmap", "bitmap": mi.Bitmap(np.array(values))}


def shining(radiance):
    """A white ball under a lamp."""
    above = mi.ScalarTransform4f().translate([0, -1, 3]).rotate([1, 0, 0], 180)
    lamp = {"type": "rectangle", "to_world": above}
    lamp["glow"] = {"type": "area", "radiance": radiance}
    return scene((0, -4, 1), size=8, ball={"type": "sphere"}, lamp=lamp)


def irregular(wavelengths, values):
    return {"type": "irregular", "wavelengths": wavelengths, "values": values}


READ_OTHERWISE = {
    "picture of a light": (
        lambda: shining(pictured()),
        lambda: shining(pictured(BRIGHT.clip(0, 1))),
        "^glow: radiance is a picture",
    ),
    "bright picture": (
        lambda: under_a_point({"type": "diffuse", "reflectance": pictured()}),
        lambda: under_a_point({"type": "diffuse", "reflectance": pictured(BRIGHT.clip(0, 1))}),
        "reach 10, and spectral variants cut",
    ),
    "array": (
        lambda: under_a_point(
            {
                "type": "diffuse",
                "reflectance": {"type": "bitmap", "data": mi.TensorXf(BRIGHT / 10)},
            }
        ),
        lambda: under_a_point({"type": "diffuse", "reflectance": pictured(0 * BRIGHT + 1)}),
        "three channels of `data`",
    ),
    "metal in colours": (
        lambda: metal(eta=coloured(0.2, 0.9, 1.1), k=coloured(3.9, 2.4, 2.1)),
        lambda: metal(eta=coloured(0.2, 0.9, 1), k=coloured(1, 1, 1)),
        "^bsdf: (eta = 0.2, 0.9, 1.1|k = 3.9, 2.4, 2.1) is a colour",
    ),
    "metal with a short table": (
        lambda: metal(eta=irregular("300,600", "1.5,1.5"), k=irregular("300,600", "2,2")),
        lambda: metal(
            eta=irregular("300,600,600.001,900", "1.5,1.5,0,0"),
            k=irregular("300,600,600.001,900", "2,2,0,0"),
        ),
        "^bsdf: (eta|k) is known from 300 to 600 nm, of 360 to 830",
    ),
}
"""What spectral variants read otherwise than meant, what they take it for, and our words."""


@pytest.mark.parametrize("what", READ_OTHERWISE)
def test_what_is_read_otherwise_is_named_and_it_is_what_mitsuba_does(spectral, what):
    made, taken_for, words = READ_OTHERWISE[what]
    warnings = halves.pair(Source("a test", made())).warnings
    assert warnings
    assert all(re.search(words, warning) for warning in warnings)
    images = [
        np.array(mi.render(Source("a test", each()).parse().instantiate(), spp=64, seed=1))
        for each in (made, taken_for)
    ]
    assert images[0].mean() > 0.005
    np.testing.assert_allclose(*images, rtol=0.02, atol=2e-3)


@pytest.mark.parametrize(
    "made",
    [
        lambda: shining(coloured(10, 8, 6)),
        lambda: under_a_point({"type": "diffuse", "reflectance": pictured(BRIGHT / 10)}),
        lambda: metal(material="Au"),
        lambda: metal(eta=coloured(0.2, 0.9, 1), k=irregular("300,900", "2,3")),
        lambda: scene(ball={"type": "sphere"}, sky=pictured() | {"type": "envmap"}),
    ],
)
def test_what_is_read_as_meant_is_not_warned_of(spectral, made):
    assert not halves.pair(Source("a test", made())).warnings


def test_colours_are_no_matter_of_spectra_in_rgb(rgb):
    for what in ("picture of a light", "bright picture", "array", "metal in colours"):
        made, *_ = READ_OTHERWISE[what]
        assert not halves.pair(Source("a test", made())).warnings


@pytest.mark.parametrize("variant", ["llvm_ad_rgb", "llvm_ad_spectral"], indirect=True)
def test_a_light_whose_spectrum_is_one_number_is_named_with_its_colour(variant):
    def lit(intensity):
        return scene(
            (0, 0, 5),
            size=4,
            wall={"type": "rectangle", "to_world": mi.ScalarTransform4f().scale(9)},
            lamp={"type": "directional", "direction": [0, 0, -1], "irradiance": intensity},
        )

    flat = lit({"type": "spectrum", "value": 1.0})
    (warning,) = halves.pair(Source("a test", flat)).warnings
    pink = [float(part) for part in re.search(r"pink: \((.*)\) times", warning)[1].split(",")]
    for white in (coloured(1, 1, 1), 1.0):
        assert not halves.pair(Source("a test", lit(white))).warnings
        shown, plain = (
            np.mean(mi.render(mi.load_dict(each), spp=2048, seed=1), axis=(0, 1))
            for each in (flat, lit(white))
        )
        np.testing.assert_allclose(shown / plain, pink, rtol=0.02)


def test_a_blackbody_is_refused_in_rgb_before_it_is_rendered(rgb):
    light = POINT | {"intensity": {"type": "blackbody", "temperature": 5000.0}}
    given = scene((0, -4, 1), size=8, ball={"type": "sphere"}, lamp=light)
    mi.load_dict(given)
    with pytest.raises(InputError, match=r"no colour in llvm_ad_rgb\. Give .* llvm_ad_spectral"):
        halves.pair(Source("a test", given))


@pytest.mark.parametrize("kind", ["uchar", "float"])
def test_the_whole_numbers_of_a_ply_are_named_and_are_reflectances(rgb, tmp_path, kind):
    rows = "\n".join(f"{x} {y} 0 128 64 32" for x, y in ((-9, -9), (9, -9), (0, 9)))
    places = "".join(f"property float {axis}\n" for axis in "xyz")
    colours = "".join(f"property {kind} {channel}\n" for channel in "rgb")
    (tmp_path / "mesh.ply").write_text(
        f"ply\nformat ascii 1.0\nelement vertex 3\n{places}{colours}element face 1\n"
        f"property list uchar int vertex_indices\nend_header\n{rows}\n3 0 1 2\n"
    )
    painted = {"type": "mesh_attribute", "name": "vertex_color"}
    mesh = {"type": "ply", "filename": str(tmp_path / "mesh.ply")}
    mesh["bsdf"] = {"type": "diffuse", "reflectance": painted}
    sun = {"type": "directional", "direction": [0, 0, -1], "irradiance": np.pi}
    given = scene((0, 0, 5), size=4, mesh=mesh, sun=sun)
    warnings = halves.pair(Source("a test", given)).warnings
    named = [each for each in warnings if "128 is a reflectance of 128" in each]
    assert len(named) == (kind == "uchar")
    image = np.array(mi.render(mi.load_dict(given), spp=4))
    np.testing.assert_allclose(image, np.broadcast_to([128, 64, 32], image.shape), rtol=1e-3)


def test_a_metal_that_is_not_finite_is_named_with_its_table(spectral):
    """Light falls straight on it, so Fresnel's term is 0 / 0 beyond the table."""
    flat = {"type": "rectangle", "bsdf": {"type": "conductor", "material": "AlSb"}}
    facing = mi.ScalarTransform4f().rotate([1, 0, 0], 90)
    parts = {"mirror": flat | {"to_world": facing}, "sky": {"type": "constant"}}
    seen = scene((0, -4, 0), lens={"type": "orthographic"}, size=8, **parts)
    ready = prepare(Source("a test", seen), Options(spp=16))
    with pytest.raises(
        NonFiniteError, match=r"the index of AlSb is known from 302\.4 to 590\.4 nm"
    ):
        ready.reference.render(1)


def test_a_metal_that_rgb_makes_of_nothing_is_named_with_its_table(rgb):
    """Red, the table's missing end, has no index."""
    with pytest.raises(InputError, match=r"not a number.* eta is known from 300 to 600 nm"):
        halves.pair(Source("a test", READ_OTHERWISE["metal with a short table"][0]()))
