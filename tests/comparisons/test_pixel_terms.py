"""Equation 8.10 term by term: what the records and the page hold is what the kernel has."""

from dataclasses import replace

import numpy as np
import OpenEXR
import pytest

from fotismos.comparisons import pixel_terms
from fotismos.comparisons.gallery.builtin import SCENES
from fotismos.reference.records import Missing
from fotismos.reference.rendering.passes import passes
from fotismos.reference.rendering.renderer import variant
from fotismos.reports.files import results
from fotismos.reports.page import page
from fotismos.reports.page.why_view import terms_view
from fotismos.reports.run.scene_files import view_of, write
from tests.shared import records
from tests.shared.oracle import unit
from tests.shared.pages import codes
from tests.shared.parts import rgb_of, shown_by
from tests.shared.spheres import PLASTIC, centres, lamp, prepared, seen_on_the_unit_sphere, sphere

KERNEL = 1e-5
"""Of the largest value: single precision, and ``n`` times its rounding of a cosine."""

CODES = 2e-4
"""Of the largest value: what 16 bits of each factor leave of a sum of products."""


def traced(scene, **options):
    ready, given = prepared(scene, **options)
    grid = pixel_terms.trace(ready.heuristic, given)
    assert not isinstance(grid, Missing), grid.reason
    return grid, ready


def kernel(ready, grid):
    """Return what the heuristic half's integrator has at the grid's points, (H, W, 3)."""
    half = ready.heuristic
    with variant(half.variant):
        size = grid.resolution
        image = centres(half.scene, half.integrator, size, grid.columns, grid.rows)
    return np.where(grid.material[..., None] < 0, 0, image)


def test_the_grid_has_the_pixel_of_interest_and_the_kernels_value_there():
    ready, given = prepared("fig-8-9", resolution=(200, 100))
    plain = pixel_terms.trace(ready.heuristic, given)
    pixel = plain.columns[40] + 1, plain.rows[12] + 1
    grid = pixel_terms.trace(ready.heuristic, given, pixel)
    assert grid.at(*pixel).pixel == pixel
    assert (grid.columns != plain.columns).sum() == (grid.rows != plain.rows).sum() == 1
    require_sum(grid, ready)


@pytest.mark.thorough
@pytest.mark.guarantee("kernel", "The terms of 8.10 on a page add up to the kernel's value.")
def test_the_terms_add_up_to_what_the_kernel_has():
    for name in [n for n, s in SCENES.items() if s.interpolation == "phong"]:
        require_sum(*traced(name, resolution=(24, 16)))


def require_sum(grid, ready):
    """Require that the terms, also as the page has them, add up to what the kernel has."""
    expected = kernel(ready, grid)
    assert expected.max() > 0.1
    assert abs(sum_of(grid) - expected).max() <= KERNEL * expected.max()
    assert abs(total_of(terms_view(grid)) - expected).max() <= CODES * expected.max()


def sum_of(grid):
    """Add up the terms of a grid, (H, W, 3)."""
    even = [np.add(m.k_i, np.multiply(m.ambient, m.k_a)) for m in grid.materials]
    image = np.array([*even, np.zeros(3)])[grid.material]
    image = image + sum(map(grid.light_image, grid.lights))
    return image if grid.others is None else image + grid.others


def total_of(view):
    """Add up the terms that the page holds, as its script does."""
    planes = unpacked(view.grid, view.data["tops"])
    material = planes["material"]
    image = np.zeros((*material.shape, 3))
    for number, shown in enumerate(view.data["materials"], 1):
        found = pixel_terms.TermMaterial(**shown)
        here = (material == number)[..., None]
        k_d, k_s = map(np.array, (found.k_d, found.k_s))
        value = np.add(found.k_i, np.multiply(found.ambient, found.k_a))
        for place, light in enumerate(view.data["lights"]):
            of = {name: planes[f"{place}.{name}"][..., None] for name in
                  ("attenuation", "cos_incidence", "lobe")}  # fmt: skip
            diffuse = light["intensity"] * k_d * np.maximum(of["cos_incidence"], 0)
            specular = light["specular_intensity"] * k_s * of["lobe"]
            value = value + of["attenuation"] * (diffuse + specular)
        image = np.where(here, value, image)
    if "others.R" in planes:
        image += np.stack([planes[f"others.{colour}"] for colour in "RGB"], axis=-1)
    return image


def unpacked(embedded, tops):
    found = {name: plane.astype(float) for name, plane in codes(embedded).items()}
    material = found.pop("material")
    for name, code in found.items():
        is_signed = name not in tops
        found[name] = 2 * code / 65535 - 1 if is_signed else tops[name] * (code / 65535) ** 2
    return found | {"material": material}


def test_each_factor_is_that_of_the_formula():
    """Figure 8.11: three lights about a unit sphere, in closed form."""
    grid, _ = traced("fig-8-11-n9", resolution=(32, 32))
    viewer = np.array((-3.0, 0.0, 1.0))
    lamps = {"light 1": (-4.24, 0, 0), "light 2": (-3.5, -3.5, 0), "light 3": (0, -4.24, 0)}
    lit = 0
    for x, y in ((9, 14), (16, 16), (24, 18), (20, 9)):
        found = grid.at(x, y)
        assert found.pixel == (x, y)
        normal = seen_on_the_unit_sphere(x, y, 32, viewer)
        view = unit(viewer - normal)
        assert found.cos_view == pytest.approx(normal @ view, abs=1e-5)
        assert found.ambient == pytest.approx((0.3, 0.3, 0.3))
        for number, (light, at) in enumerate(zip(found.lights, lamps.values(), strict=True)):
            toward = unit(at - normal)
            cosine = normal @ toward
            reflection = (2 * cosine * normal - toward) @ view
            lobe = max(reflection, 0) ** 9 if cosine > 0 else 0
            cosines = light.cos_incidence, light.cos_reflection, light.attenuation
            assert cosines == pytest.approx((cosine, reflection, 1), abs=1e-5)
            terms = light.diffuse[number], light.specular[number], light.lobe
            assert terms == pytest.approx((0.5 * max(cosine, 0), 0.7 * lobe, lobe), abs=1e-4)
            assert sum(light.diffuse) == light.diffuse[number]
            lit += cosine > 0 and lobe > 0.01
        assert [light.name for light in found.lights] == list(lamps)
    assert lit >= 4


def test_lights_beyond_four_are_one_term_and_textures_materials_of_each_colour(rgb):
    grid, ready = traced(sphere(PLASTIC, *(lamp(x, 10.0 + 3 * x) for x in range(-3, 4))))
    assert [light.name for light in grid.lights] == [f"lamp {n}" for n in range(3, 7)]
    assert grid.others.max() > 0.01
    assert grid.at(8, 8).total == pytest.approx(tuple(sum_of(grid)[8, 8]))
    require_sum(grid, ready)
    colour = {"type": "rgb", "value": [0.8, 0.4, 0.2]}
    board = {"type": "checkerboard", "color0": 0.1, "color1": colour}
    grid, ready = traced(sphere({"type": "diffuse", "reflectance": board}, lamp(2)))
    assert sorted(round(m.k_d[0], 3) for m in grid.materials) == [0.1, 0.8]
    require_sum(grid, ready)


def test_other_shading_has_no_terms_and_says_why():
    for scene, options, reason in (
        ("fig-6-10", {}, "Flat shading"),
        ("fig-8-9", {"heuristic": "hemisphere-ambient"}, "hemisphere-ambient"),
        ("fig-8-9", {"variant": "llvm_ad_spectral"}, "by wavelength"),
    ):
        ready, given = prepared(scene, resolution=(8, 8), **options)
        assert reason in pixel_terms.trace(ready.heuristic, given).reason


# --- As images ------------------------------------------------------------------------------------


def textbook(ready, count=1):
    """Return the mean of passes of the heuristic half, (H, W, 3)."""
    return np.mean([np.array(one[0]) for one in passes([ready.heuristic], 0, count)], axis=0)


def images(scene, **options):
    """Return the layers of a scene's terms, and its textbook image."""
    ready, given = prepared(scene, **{"resolution": (24, 24), "spp": 8, **options})
    whole = textbook(ready)
    return pixel_terms.layers(ready.heuristic, given, whole), whole


def of_terms(**coefficients):
    ambient = {"ambient": 0.5} if "k_a" in coefficients else {}
    return shown_by("phong", {"type": "phong", "n": 9, **coefficients}, **ambient)


ALONE = {
    "term.emission": {"k_i": 0.1},
    "term.ambient": {"k_a": rgb_of(0.3, 0.2, 0.1)},
    "term.diffuse": {"k_d": rgb_of(0.1, 0.5, 0.4)},
    "term.specular": {"k_s": 0.7},
}


WHOLE = {name: k for each in ALONE.values() for name, k in each.items()}

FORMS = {
    "box": {},
    "wide filter": {"rfilter": "gaussian"},
    "grey": {"variant": "llvm_ad_mono"},
    "spectral": {"variant": "llvm_ad_spectral"},
    "Blinn": {"heuristic": "blinn"},
    "flat": {"interpolation": "flat", "tessellation": 8},
    "Gouraud": {"interpolation": "gouraud", "tessellation": 8},
}
QUICK = ("wide filter", "Blinn")


@pytest.mark.guarantee("kernel", "The layer of each term is the image of that term alone.")
@pytest.mark.parametrize(
    "form",
    [
        pytest.param(form, id=name, marks=[] if name in QUICK else pytest.mark.thorough)
        for name, form in FORMS.items()
    ],
)
def test_each_layer_is_the_image_of_a_scene_with_that_term_alone(form):
    def made(coefficients, rfilter="box", **options):
        scene = of_terms(**coefficients)
        scene["sensor"]["film"]["rfilter"] = {"type": rfilter}
        return images(scene, **options)

    layers, whole = made(WHOLE, **form)
    assert list(layers) == list(ALONE)
    np.testing.assert_allclose(sum(layers.values()), whole, atol=1e-6)
    for name, coefficients in ALONE.items():
        _, alone = made(coefficients, **form)
        assert alone.max() > 0.04
        np.testing.assert_allclose(layers[name], alone, atol=2e-6 * whole.max(), err_msg=name)


def test_with_more_passes_shares_of_the_first_one_are_near(rgb):
    """Exactly a sum, and off by little where shares change within a pixel."""
    ready, given = prepared(of_terms(**WHOLE), resolution=(24, 24), spp=128)
    whole = textbook(ready, 16)
    layers = pixel_terms.layers(ready.heuristic, given, whole)
    np.testing.assert_allclose(sum(layers.values()), whole, atol=1e-6)
    assert min(layer.min() for layer in layers.values()) > -1e-6
    for name, coefficients in ALONE.items():
        alone, _ = prepared(of_terms(**coefficients), resolution=(24, 24), spp=128)
        off = abs(layers[name] - textbook(alone, 16))
        assert off.mean() < 5e-4
        assert off.max() < 0.04


def test_what_shines_behind_a_surface_is_emission(rgb):
    sky = {"type": "constant", "radiance": 0.25}
    layers, whole = images(sphere(PLASTIC, lamp(2)) | {"sky": sky})
    assert layers["term.emission"][0, 0] == pytest.approx(whole[0, 0])
    assert whole[0, 0].min() == pytest.approx(0.25)
    assert layers["term.emission"][12, 12] == pytest.approx(0, abs=1e-6)
    assert abs(sum(layers.values()) - whole).max() <= 1e-5 * whole.max()


@pytest.mark.thorough
def test_other_heuristics_and_more_than_64_lights_have_no_layers(rgb):
    assert images("fig-8-9", resolution=(8, 8), heuristic="hemisphere-ambient")[0] == {}
    for count in (64, 65):
        lights = (lamp(x) for x in range(count))
        assert bool(images(sphere(PLASTIC, *lights))[0]) is (count == 64)


def test_the_layers_are_in_the_file_and_their_sum_on_the_page(tmp_path):
    rng = np.random.default_rng(0)
    layers = {name: rng.random((4, 6, 3), np.float32) for name in ALONE}
    layers["term.emission"][:] = 0
    found = records.comparison(4, 6)
    found = replace(found, images=replace(found.images, terms=layers))
    view = write(results.own(tmp_path / "out"), "ball", found)
    with OpenEXR.File(str(tmp_path / "out/ball/comparison.exr"), separate_channels=True) as file:
        channels = file.channels()
        for name, image in layers.items():
            for place, letter in enumerate("RGB"):
                np.testing.assert_array_equal(
                    channels[f"{name}.{letter}"].pixels, image[..., place]
                )
    html = page.render([view])
    shown = [name for name in ALONE if f"{name[5:]} term" in html]
    assert shown == ["term.ambient", "term.diffuse", "term.specular"]  # emission is black
    assert ', sum of the terms"' in html
    assert ', sum of the terms"' not in page.render([view_of(records.comparison())])
