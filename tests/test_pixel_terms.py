"""Equation 8.10 term by term: what the records and the page hold is what the kernel has."""

import mitsuba as mi
import numpy as np
import pytest

from comparisons import pixel_terms
from comparisons.case import open_case
from comparisons.gallery.builtin import SCENES
from comparisons.options import Options
from comparisons.prepared import prepare
from reference.rendering.gbuffer import pixel_rays
from reference.rendering.renderer import variant
from reports.page.why_view import terms_view
from tests.misplanned import scene as described
from tests.oracle import unit
from tests.test_embedding import codes

KERNEL = 1e-5
"""Of the largest value: single precision, and ``n`` times its rounding of a cosine."""

CODES = 2e-4
"""Of the largest value: what 16 bits of each factor leave of a sum of products."""


def prepared(scene, **options):
    case = open_case(scene, Options.of({"spp": 4, **options}))
    return prepare(case.source, case.options), case.options


def traced(scene, **options):
    ready, given = prepared(scene, **options)
    grid, missing = pixel_terms.trace(ready.heuristic, given)
    assert grid is not None, missing
    return grid, ready


def centres(scene, integrator, size, columns, rows):
    """Return what an integrator has through the centres of pixels, (H, W, 3)."""
    ray = pixel_rays(scene, size, *np.meshgrid(columns, rows))
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(0, len(columns) * len(rows))
    colour, valid, _ = integrator.sample(scene, sampler, ray)
    image = np.array(mi.Color3f(colour) & valid, np.float64)
    return image.T.reshape(len(rows), len(columns), 3)


def kernel(ready, grid):
    """Return what the heuristic half's integrator has at the grid's points, (H, W, 3)."""
    half = ready.heuristic
    with variant(half.variant):
        size = grid.resolution
        image = centres(half.scene, half.integrator, size, grid.columns, grid.rows)
    return np.where(grid.material[..., None] < 0, 0, image)


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
    planes = unpacked(view.grid, view.tops)
    material = planes["material"]
    image = np.zeros((*material.shape, 3))
    for number, shown in enumerate(view.materials, 1):
        found = pixel_terms.TermMaterial(**shown)
        here = (material == number)[..., None]
        k_d, k_s = map(np.array, (found.k_d, found.k_s))
        value = np.add(found.k_i, np.multiply(found.ambient, found.k_a))
        for place, light in enumerate(view.lights):
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


def seen_on_the_unit_sphere(x, y, side, viewer):
    """Return where the ray through a pixel's centre meets the figures' sphere, in float64."""
    forward = unit(-viewer)
    right = unit(np.cross(forward, (0, 0, 1)))
    across, down = (np.tan(np.radians(20)) * (2 * (place + 0.5) / side - 1) for place in (x, y))
    ray = unit(forward + across * right - down * np.cross(right, forward))
    half = ray @ viewer
    return viewer - ray * (half + np.sqrt(half**2 - viewer @ viewer + 1))


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
        for number, (light, lamp) in enumerate(zip(found.lights, lamps.values(), strict=True)):
            toward = unit(lamp - normal)
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


def sphere(material, *lights):
    parts = {"ball": {"type": "sphere", "bsdf": material}}
    parts |= {f"lamp {number}": light for number, light in enumerate(lights)}
    return described((0, -4, 1), size=16, **parts)


def lamp(x, strength=30.0):
    return {"type": "point", "position": [x, -4, 3], "intensity": strength}


PLASTIC = {"type": "roughplastic", "alpha": 0.2}


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
        grid, missing = pixel_terms.trace(ready.heuristic, given)
        assert grid is None
        assert reason in missing
