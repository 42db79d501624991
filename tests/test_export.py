"""Exports: the camera, geometry, materials and lights of the files are those of the scene."""

import base64
import json
from math import pi

import mitsuba as mi
import numpy as np
import OpenEXR
import pytest

from comparisons.case import Request, open_case
from comparisons.exports.exported import exported
from heuristic.errors import InputError
from reference.rendering.gbuffer import gbuffer
from reference.scene.source import Source
from reports.exports.gltf import gltf
from reports.exports.wavefront import obj
from tests import oracle

SIZE = (48, 32)


def exported_of(scene, **more):
    case = open_case(scene, Request(resolution=SIZE, **more))
    return case, exported(case.source, case.options)


def shaded(found):
    """Return the chapters' model (8.10) at the pixel centres, in NumPy, from the export alone."""
    p, n, number = (found.layers[name].astype(float) for name in ("P", "N", "shape"))
    hit = number > 0
    p, n = p[hit], n[hit]
    view = np.array(found.camera["view"])
    v = oracle.unit(np.linalg.inv(view)[:3, 3] - p)
    place = np.array([shape.material for shape in found.shapes])[number[hit].astype(int) - 1]

    def of(name):
        return np.array([material[name] for material in found.materials], float)[place]

    value = of("k_i") + of("k_a") * found.ambient
    for light in found.lights:
        toward, factor = arriving(light, p)
        cosine = np.sum(n * toward, axis=1)
        mirrored = 2 * cosine[:, None] * n - toward
        lobe = np.maximum(np.sum(mirrored * v, axis=1), 0) ** of("n")
        reflected = of("k_d") * cosine[:, None] + of("k_s") * lobe[:, None]
        value += np.where(cosine > 0, factor, 0)[:, None] * light["intensity"] * reflected
    image = np.zeros((*hit.shape, 3))
    image[hit] = value
    return image


def arriving(light, p):
    if light["type"] == "directional":
        return np.broadcast_to(-oracle.unit(np.array([light["direction"]])), p.shape), np.ones(
            len(p)
        )
    offset = light["position"] - p
    distance = np.linalg.norm(offset, axis=1)
    toward = offset / distance[:, None]
    k0, k1, k2 = light["attenuation"]
    factor = 1 / (k0 + k1 * distance + k2 * distance**2)
    if light["type"] == "spot":
        axis = np.array(light["direction"]) / np.linalg.norm(light["direction"])
        cosine = -toward @ axis
        inside = cosine >= np.cos(np.radians(light["cutoff"])) - 1e-7
        factor = factor * np.where(inside, np.maximum(cosine, 0) ** light["exponent"], 0)
    return toward, factor


@pytest.mark.parametrize("scene", ["fig-8-9", "fig-8-11-n3", "fig-6-5-m40", "plastic-spheres",
                                   "cornell-box"])  # fmt: skip
def test_the_files_hold_all_that_the_textbooks_picture_is_made_of(rgb, scene):
    """The picture that the export makes in NumPy is the kernel's, but for edges."""
    case, found = exported_of(scene)
    half = case.options.pair(case.source).heuristic.instantiate()
    image, expected = shaded(found), centres(half)
    edge = np.abs(image - expected).max(axis=-1) > 2e-4 * max(1, expected.max())
    assert expected.max() > 0.1
    assert edge.mean() < 0.005


def centres(scene):
    """Shade the rays through the pixel centres with the integrator of a heuristic half."""
    width, height = SIZE
    x, y = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    place = mi.Point2f(mi.Float(x.ravel()), mi.Float(y.ravel()))
    ray, _ = scene.sensors()[0].sample_ray_differential(0.0, 0.5, place, mi.Point2f(0.5))
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(0, width * height)
    colour, hit, _ = scene.integrator().sample(scene, sampler, ray)
    image = np.where(np.array(hit), np.array(mi.Color3f(colour)), 0)
    return image.T.reshape(height, width, 3)


@pytest.mark.parametrize("scene", ["fig-8-9", "cornell-box", "plastic-spheres"])
def test_the_matrices_put_points_into_their_pixels(rgb, scene):
    _, found = exported_of(scene)
    p, hit = found.layers["P"].astype(float), found.layers["shape"] > 0
    both = np.array(found.camera["projection"]) @ np.array(found.camera["view"])
    clip = np.concatenate([p[hit], np.ones((hit.sum(), 1))], axis=1) @ both.T
    ndc = clip[:, :3] / clip[:, 3:]
    y, x = np.nonzero(hit)
    np.testing.assert_allclose((ndc[:, 0] + 1) / 2 * SIZE[0] - 0.5, x, atol=2e-3)
    np.testing.assert_allclose((1 - ndc[:, 1]) / 2 * SIZE[1] - 0.5, y, atol=2e-3)
    assert (np.abs(ndc[:, 2]) <= 1).all()


def test_the_geometry_is_the_scenes_own(rgb, tmp_path):
    """Mitsuba reads the OBJ, whose fronts the camera sees where it saw the scene's."""
    case, found = exported_of("cornell-box")
    (tmp_path / "scene.obj").write_text(obj(found), encoding="utf-8")
    again = mi.load_dict({
        "type": "scene",
        "mesh": {"type": "obj", "filename": str(tmp_path / "scene.obj")},
        "sensor": {
            "type": "perspective",
            "fov": found.camera["x_fov_degrees"],
            "to_world": mi.ScalarTransform4f(np.array(found.camera["to_world"])),
            "film": {"type": "hdrfilm", "width": SIZE[0], "height": SIZE[1]},
        },
    })  # fmt: skip
    seen = gbuffer(again, *SIZE)
    same = found.layers["shape"] > 0
    assert (seen.hit == same).mean() > 0.99  # rays along the open edge of the box
    off = np.linalg.norm(seen.position - found.layers["P"], axis=-1)[same & seen.hit]
    assert np.percentile(off, 99) < 1e-4
    away = np.linalg.norm(seen.normal - found.layers["N"], axis=-1)[same & seen.hit]
    assert np.percentile(away, 99) < 1e-3
    assert case.name == found.name


def array_of(file, number):
    accessor = file["accessors"][number]
    view = file["bufferViews"][accessor["bufferView"]]
    content = base64.b64decode(file["buffers"][0]["uri"].partition(",")[2])
    kind = {5126: np.float32, 5125: np.uint32}[accessor["componentType"]]
    width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3}[accessor["type"]]
    part = content[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]
    found = np.frombuffer(part, kind).reshape(-1, width)
    assert len(found) == accessor["count"]
    return found


def test_the_gltf_says_the_same(rgb):
    _, found = exported_of("plastic-spheres", tessellation=4)
    file = json.loads(json.dumps(gltf(found)))
    assert len(file["meshes"]) == len(found.shapes)
    for mesh, shape in zip(file["meshes"], found.shapes, strict=True):
        (primitive,) = mesh["primitives"]
        positions = array_of(file, primitive["attributes"]["POSITION"])
        np.testing.assert_array_equal(positions, shape.positions)
        accessor = file["accessors"][primitive["attributes"]["POSITION"]]
        np.testing.assert_array_equal(accessor["max"], positions.max(axis=0))
        faces = array_of(file, primitive["indices"]).reshape(-1, 3)
        np.testing.assert_array_equal(faces, shape.faces)
        material = file["materials"][primitive["material"]]
        given = found.materials[shape.material]
        own = material["pbrMetallicRoughness"]
        assert own["baseColorFactor"][:3] == given["base_color"]
        assert own["roughnessFactor"] ** 2 == pytest.approx(given["alpha"])
        assert material["extensions"]["KHR_materials_ior"]["ior"] == given["ior"]
    light = file["extensions"]["KHR_lights_punctual"]["lights"][0]
    intensity = np.array(light["color"]) * light["intensity"]
    np.testing.assert_allclose(intensity, pi * np.array(found.lights[0]["intensity"]))
    node = next(node for node in file["nodes"] if "extensions" in node)
    matrix = np.array(node["matrix"]).reshape(4, 4).T
    if "direction" in found.lights[0]:
        np.testing.assert_allclose(-matrix[:3, 2], found.lights[0]["direction"], atol=1e-6)
        np.testing.assert_allclose(np.linalg.det(matrix), 1)
    camera = next(node for node in file["nodes"] if "camera" in node)
    matrix = np.array(camera["matrix"]).reshape(4, 4).T
    np.testing.assert_allclose(matrix @ np.array(found.camera["view"]), np.eye(4), atol=1e-6)
    half = np.tan(file["cameras"][0]["perspective"]["yfov"] / 2)
    assert half == pytest.approx(1 / found.camera["projection"][1][1])


def test_materials_are_as_paired(rgb):
    case, found = exported_of("plastic-spheres")
    records = [
        each for each in case.options.pair(case.source).bsdfs if each.given == "roughplastic"
    ]
    glossy = [material for material in found.materials if any(material["k_s"])]
    assert len(records) == len(glossy) == 3
    for record in records:
        near = [m for m in glossy if abs(m["n"] - record.parameters["n"]) < 1e-3 * m["n"]]
        assert near
        np.testing.assert_allclose(near[0]["k_s"], record.parameters["k_s"], rtol=1e-5)
        assert near[0]["alpha"] == pytest.approx((1 / (2 * near[0]["n"] + 1)) ** 0.5, rel=1e-4)


def test_the_command_writes_files_and_says_what_they_mean(run, tmp_path):
    words = ("export", "fig-8-9", "--resolution", "16x12", "-o", tmp_path)
    code, said, _ = run(*words)
    folder = tmp_path / "export/fig-8-9"
    assert (code, str(folder) in said.replace("\n", "")) == (0, True)
    names = {path.name for path in folder.iterdir()} - {".fotismos"}
    assert names == {"camera.json", "lights.json", "materials.json", "scene.gltf", "scene.obj",
                     "gbuffer.exr", "README.md"}  # fmt: skip
    text = (folder / "README.md").read_text(encoding="utf-8")
    assert "16 by 12 pixels" in text
    assert "--image YOURS.exr" in text
    with OpenEXR.File(str(folder / "gbuffer.exr"), separate_channels=True) as file:
        assert {"P.X", "N.Z", "shape.Y"} <= set(file.channels())
    assert run(*words)[0] == 0  # in place of the first


def test_what_cannot_be_exported_is_refused(rgb):
    scene = {
        "type": "scene",
        "floor": {"type": "rectangle"},
        "sensor": {"type": "orthographic"},
        "light": {"type": "point"},
    }
    case = open_case(scene)
    with pytest.raises(InputError, match="only perspective cameras can be exported"):
        exported(case.source, case.options)
    moved = scene | {"sensor": {"type": "perspective", "principal_point_offset_x": 0.1}}
    with pytest.raises(InputError, match="its principal point must be in the middle"):
        exported(Source("moved", moved), case.options)
