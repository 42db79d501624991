"""The points that a page shades again: where they are, and when there are none."""

import json

import mitsuba as mi
import numpy as np
import pytest

from fotismos.comparisons import pixel_terms
from fotismos.reference.rendering.gbuffer import image_size, pixel_rays
from fotismos.reference.rendering.renderer import variant
from fotismos.reports.page.scene_view import PointsView
from fotismos.reports.page.why_view import live_view
from fotismos.reports.run import scene_files
from tests.shared import records
from tests.shared.misplanned import scene as described
from tests.shared.pages import codes
from tests.shared.spheres import PLASTIC, lamp, prepared, sphere


def points_of(subject, **options):
    ready, given = prepared(subject, **options)
    return pixel_terms.live(ready.heuristic, given), ready.heuristic


LENSES = {
    "pinhole": {"fov": 60.0},
    "shifted": {"fov": 60.0, "principal_point_offset_x": 0.2},
    "near": {"near_clip": 2.5},
    "lens": {"type": "thinlens", "aperture_radius": 0.3, "focus_distance": 4.0},
    "parallel": {"type": "orthographic"},
}


@pytest.mark.parametrize("lens", LENSES.values(), ids=LENSES)
def test_rays_and_depths_lead_to_the_points(rgb, lens):
    ball = {"type": "sphere", "bsdf": PLASTIC}
    subject = described((0.5, -4, 1), lens=lens, ball=ball, lamp=lamp(2))
    points, half = points_of(subject, resolution=(24, 16))
    assert not isinstance(points, str), points
    (width, height), seen = image_size(half.scene), points.planes["material"] > 0
    assert seen.sum() > 20
    v, u = np.mgrid[: 1 : height * 1j, : 1 : width * 1j]
    film = np.stack((1 - u - v, u, v), axis=-1)
    origin, ray = (film @ corners for corners in points.rays)
    length = np.linalg.norm(ray, axis=-1, keepdims=True)
    found = origin + np.exp(points.planes["depth"])[..., None] * ray / length
    with variant(half.variant):
        rays = pixel_rays(half.scene, (width, height), *np.meshgrid(range(width), range(height)))
        expected = np.array(half.scene.ray_intersect(rays).p).T.reshape(height, width, 3)
    np.testing.assert_allclose(found[seen], expected[seen], atol=1e-4)


def test_a_texture_of_many_colours_gives_factors(rgb):
    rng = np.random.default_rng(0)
    bitmap = mi.Bitmap(rng.random((40, 40, 3), np.float32))
    reflectance = {"type": "bitmap", "bitmap": bitmap, "raw": True}
    subject = sphere({"type": "diffuse", "reflectance": reflectance}, lamp(2))
    points, _ = points_of(subject, resolution=(40, 40))
    (material,) = points.materials
    assert material.k_d == (1, 1, 1)
    k_d, seen = points.planes["k_d.x"], points.planes["material"] > 0
    assert len(np.unique(k_d[seen])) > pixel_terms.MATERIALS
    view = live_view(points)
    stored = codes(view.grid)["k_d.x"].cumsum(axis=0, dtype=np.uint16) / 16383
    found = view.data["tops"]["k_d.x"] * (2 * stored - 1)
    np.testing.assert_allclose(found[seen], k_d[seen], atol=1e-4)


def test_scenes_without_points_say_why(rgb):
    for subject, options, reason in (
        ("fig-6-14", {}, "Gouraud shading"),
        ("fig-8-9", {"heuristic": "hemisphere-ambient"}, "hemisphere-ambient"),
        ("fig-8-9", {"variant": "llvm_ad_spectral"}, "by wavelength"),
        (sphere(PLASTIC, *map(lamp, range(17))), {}, "more than 16 lights"),
        (shadowed(), {}, "Shadow rays"),
    ):
        points, _ = points_of(subject, resolution=(8, 8), **options)
        assert reason in points.reason


def shadowed():
    light = {"type": "heuristic_point", "position": [2, -4, 3]}
    ball = {"type": "sphere", "bsdf": {"type": "phong", "k_d": 0.5}}
    found = described((0, -4, 1), size=16, ball=ball, lamp=light)
    return found | {"integrator": {"type": "heuristic", "occlusion": True}}


def test_a_page_of_a_large_scene_stays_small():
    points, _ = points_of("plastic-spheres")
    assert points.planes["material"].shape == (128, 128)
    assert len(live_view(points).grid.data) < 40_000


def test_what_a_fit_reached_stands_beside(tmp_path):
    view = records.view(records.data(), live=PointsView())
    fits = [{"departure": {"dE2000": {"after": mean}}} for mean in (3.0, 2.5)]
    fit = {"scene": "fig-8-9", "best": 1, "fits": fits, "resolution": [96, 48]}
    assert scene_files.with_fit(view, tmp_path).live.data.get("fit") is None
    for content, expected in (
        (fit, (2.5, 96, 48)),
        (fit | {"scene": "another"}, None),
        (fit | {"best": 2}, None),
        ([], None),
    ):
        (tmp_path / "fit.json").write_text(json.dumps(content))
        assert scene_files.with_fit(view, tmp_path).live.data.get("fit") == expected
    (tmp_path / "fit.json").write_text("{")
    assert scene_files.with_fit(view, tmp_path).live.data.get("fit") is None
