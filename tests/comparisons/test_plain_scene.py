"""Exports: the camera, geometry, materials and lights of the files are those of the scene."""

import json
from dataclasses import fields
from math import pi

import numpy as np
import OpenEXR
import pytest

from fotismos.comparisons.case import open_case
from fotismos.comparisons.options import Options
from fotismos.comparisons.plain_scene import plain_scene
from fotismos.comparisons.prepared import pair_for
from fotismos.heuristic.errors import InputError
from fotismos.reference.scene.source import Source
from fotismos.reports.files.export_files import gltf
from tests.shared import oracle
from tests.shared.spheres import centres

SIZE = (48, 32)


def exported_of(scene, **more):
    case = open_case(scene, Options(resolution=SIZE, **more))
    return case, plain_scene(case.source, case.options)


def shaded(found):
    """Return the chapters' model (8.10) at the pixel centres, by the oracle, from the export."""
    p, n, number = (found.layers[name].astype(float) for name in ("P", "N", "shape"))
    view = np.linalg.inv(np.array(found.camera["view"]))[:3, 3] - p
    names = {field.name for field in fields(oracle.Light)}
    lights = [
        oracle.Light(kind=light["type"], **{key: light[key] for key in names & light.keys()})
        for light in found.lights
    ]
    image = np.zeros_like(p)
    for place, shape in enumerate(found.shapes, start=1):
        given, on = found.materials[shape.material], number == place
        material = oracle.Material(**{name: given[name] for name in ("k_i", "k_a", "k_d", "k_s")},
                                   n=given["n"])  # fmt: skip
        image[on] = oracle.shade(p[on], n[on], view[on], material, lights, found.ambient)
    return image


def test_the_files_hold_all_that_the_textbooks_picture_is_made_of(rgb):
    """The picture that the export makes in NumPy is the kernel's, but for edges."""
    for scene in ("fig-6-5-m40", "two-intensities", "plastic-spheres", "cornell-box"):
        case, found = exported_of(scene)
        half = pair_for(case.source, case.options).heuristic.instantiate()
        pixels = map(np.arange, SIZE)
        image, expected = shaded(found), centres(half, half.integrator(), SIZE, *pixels)
        edge = np.abs(image - expected).max(axis=-1) > 2e-4 * max(1, expected.max())
        assert expected.max() > 0.1
        assert edge.mean() < 0.005


def test_the_projection_puts_each_point_into_its_pixel(rgb):
    _, found = exported_of("cornell-box")
    both = np.array(found.camera["projection"]) @ np.array(found.camera["view"])
    is_seen = found.layers["shape"] > 0
    clip = np.insert(found.layers["P"][is_seen].astype(float), 3, 1, axis=1) @ both.T
    ndc = clip[:, :3] / clip[:, 3:]
    y, x = np.nonzero(is_seen)
    pixels = (1 + ndc[:, :2] * (1, -1)) / 2 * SIZE - 0.5
    np.testing.assert_allclose(pixels, np.stack([x, y], axis=1), atol=2e-3)
    assert (np.abs(ndc[:, 2]) <= 1).all()


def matrix_of(node):
    return np.array(node["matrix"]).reshape(4, 4).T


def test_the_gltf_says_the_same(rgb):
    _, found = exported_of("plastic-spheres", tessellation=4)
    file = json.loads(json.dumps(gltf(found)))
    for mesh, shape in zip(file["meshes"], found.shapes, strict=True):
        assert mesh["primitives"][0]["material"] == shape.material
        material, given = (each[shape.material] for each in (file["materials"], found.materials))
        own = material["pbrMetallicRoughness"]
        assert own["baseColorFactor"][:3] == given["base_color"]
        assert own["roughnessFactor"] ** 2 == pytest.approx(given["alpha"])
        assert material["extensions"]["KHR_materials_ior"]["ior"] == given["ior"]
    light = file["extensions"]["KHR_lights_punctual"]["lights"][0]
    intensity = np.array(light["color"]) * light["intensity"]
    np.testing.assert_allclose(intensity, pi * np.array(found.lights[0]["intensity"]))
    assert light["extras"].keys().isdisjoint({"diffuse_intensity", "specular_intensity"})
    _, two = exported_of("two-intensities")
    light = gltf(two)["extensions"]["KHR_lights_punctual"]["lights"][0]
    intensity = np.array(light["color"]) * light["intensity"]
    np.testing.assert_allclose(intensity, pi * np.array((0.9, 0.4, 0.1)), 1e-6)
    assert light["extras"]["specular_intensity"] == [1, 1, 1]
    half = np.tan(file["cameras"][0]["perspective"]["yfov"] / 2)
    assert half == pytest.approx(1 / found.camera["projection"][1][1])
    _, spots = exported_of("fig-6-5-m40")
    nodes = gltf(spots)["nodes"][len(spots.shapes) + 1 :]
    for node, light in zip(nodes, spots.lights, strict=True):
        axis = -matrix_of(node)[:3, 2]
        np.testing.assert_allclose(np.cross(axis, light["direction"]), 0, atol=1e-5)
        assert axis @ light["direction"] > 0


def test_the_command_writes_files_and_says_what_they_mean(run, tmp_path):
    words = ("export", "fig-8-9", "--resolution", "16x12", "-o", tmp_path)
    code, said, _ = run(*words)
    folder = tmp_path / "export/fig-8-9"
    assert (code, str(folder) in said.replace("\n", "")) == (0, True)
    names = {path.name for path in folder.glob("[!.]*")}
    assert names == {"camera.json", "lights.json", "materials.json", "scene.gltf",
                     "gbuffer.exr", "README.md"}  # fmt: skip
    text = (folder / "README.md").read_text()
    assert "16 by 12 pixels" in text
    with OpenEXR.File(str(folder / "gbuffer.exr"), separate_channels=True) as file:
        assert {"P.X", "N.Z", "shape.Y"} <= set(file.channels())


def test_what_cannot_be_exported_is_refused(rgb):
    for sensor, message in (
        ({"type": "orthographic"}, "only perspective cameras can be exported"),
        ({"type": "perspective", "principal_point_offset_x": 0.1}, "must be in the middle"),
    ):
        scene = {"type": "scene", "floor": {"type": "rectangle"}, "sensor": sensor}
        with pytest.raises(InputError, match=message):
            plain_scene(Source("a", scene | {"light": {"type": "point"}}), Options())
