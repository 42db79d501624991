"""docs/scenes/gltf.py: a glTF file's scene is the one that Mitsuba's own plugins make."""

import io
import json
import struct

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from PIL import Image

from fotismos.comparisons.case import open_case
from fotismos.comparisons.options import Options
from fotismos.comparisons.plain_scene import plain_scene
from fotismos.comparisons.prepared import pair_for
from fotismos.heuristic.errors import InputError
from fotismos.reference.rendering.gbuffer import gbuffer
from fotismos.reference.scene.source import Script, Source
from fotismos.reports.files.export_files import gltf
from fotismos.reports.files.export_lights import cone_of
from tests.shared.parts import camera
from tests.shared.programs import ROOT

SCRIPT = ROOT / "docs/scenes/gltf.py"
RNG = np.random.default_rng(54)
PIXELS = RNG.integers(0, 256, (4, 8, 3), np.uint8)
ROUGH = np.stack([RNG.integers(low, high, (4, 8), np.uint8) for low, high in
                  ((0, 255), (90, 250), (0, 200))], axis=-1)  # fmt: skip
CORNERS = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], np.float32)
NORMALS = CORNERS * 0.4 + (0, 0, 1)
NORMALS /= np.linalg.norm(NORMALS, axis=1, keepdims=True)
UV = np.array([(0, 1), (1, 1), (1, 0), (0, 0)], np.float32)  # the image upright, as glTF has it
FACES = np.array([0, 1, 2, 0, 2, 3], np.uint16)
LIGHTS = "KHR_lights_punctual"
STRENGTH = "KHR_materials_emissive_strength"


def png(pixels):
    content = io.BytesIO()
    Image.fromarray(pixels).save(content, "PNG")
    return content.getvalue()


def glb(path, nodes, materials=(), lights=(), normals=True, **more):
    """Write a GLB file of squares with vertices in one view, side by side, and two images."""
    vertices = np.hstack([CORNERS, NORMALS, UV]).astype("<f4").tobytes()
    parts = [vertices, FACES.tobytes(), png(more.pop("pixels", PIXELS)), png(ROUGH)]
    views, content = [], b""
    for part in parts:
        views.append({"buffer": 0, "byteOffset": len(content), "byteLength": len(part)})
        content += part + bytes(-len(part) % 4)
    views[0]["byteStride"] = 32
    kinds = (("VEC3", 0, 5126, 4, 0), ("VEC3", 0, 5126, 4, 12), ("VEC2", 0, 5126, 4, 24),
             ("SCALAR", 1, 5123, 6, 0))  # fmt: skip
    attributes = {"POSITION": 0, "TEXCOORD_0": 2} | ({"NORMAL": 1} if normals else {})
    file = {
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": len(content)}],
        "bufferViews": views,
        "accessors": [
            {"type": kind, "bufferView": view, "componentType": component, "count": count,
             "byteOffset": start} for kind, view, component, count, start in kinds
        ],
        "images": [{"bufferView": 2, "mimeType": "image/png"},
                   {"bufferView": 3, "mimeType": "image/png"}],
        "samplers": [{"magFilter": 9729}],
        "textures": [{"source": 0, "sampler": 0}, {"source": 1}],
        "materials": list(materials),
        "meshes": [{"primitives": [{"attributes": attributes, "indices": 3, "material": number}]}
                   for number in range(len(materials))],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.7, "aspectRatio": 1.5,
                                                            "znear": 0.1}}],
        "extensions": {LIGHTS: {"lights": list(lights)}},
        "nodes": nodes,
        "scene": 0,
        "scenes": [{"nodes": more.pop("roots", list(range(len(nodes))))}],
    } | more  # fmt: skip
    text = json.dumps(file).encode()
    text += b" " * (-len(text) % 4)
    size = 28 + len(text) + len(content)
    path.write_bytes(b"glTF" + struct.pack("<IIII", 2, size, len(text), 0x4E4F534A) + text
                     + struct.pack("<II", len(content), 0x004E4942) + content)  # fmt: skip
    return path


def decoded(pixels):
    """Decode sRGB as IEC 61966-2-1 has it."""
    encoded = pixels / 255
    return np.where(encoded > 0.04045, ((encoded + 0.055) / 1.055) ** 2.4, encoded / 12.92)


def made(path, **values):
    return Script(SCRIPT, {"file": str(path), **values})()


def image(scene, depth, size=(96, 64)):
    sensors = [part for part in scene.values() if isinstance(part, dict) and "film" in part]
    sensors[0]["film"] |= {"width": size[0], "height": size[1]}
    integrator = mi.load_dict({"type": "path", "max_depth": depth})
    return np.array(mi.render(mi.load_dict(scene), integrator=integrator, spp=16, seed=1))


def quaternion(axis, degrees):
    half = np.radians(degrees) / 2
    return [*(np.sin(half) * np.array(axis)).tolist(), float(np.cos(half))]


def test_a_file_renders_as_the_same_scene_of_mitsubas_own_plugins(rgb, tmp_path):
    """Nodes, normals, textures, lights and camera, against OBJ files and Mitsuba's transforms."""
    T = mi.ScalarTransform4f
    inner = T().translate((0.2, 0.1, 0)).rotate((0, 1, 0), 25).scale((-0.8, 1.1, 1.3))
    textured = {"metallicFactor": 0.9, "roughnessFactor": 0.8, "baseColorFactor": [1, 0.5, 0.8, 1],
                "baseColorTexture": {"index": 0},
                "metallicRoughnessTexture": {"index": 1}}  # fmt: skip
    plain = {"baseColorFactor": [0.2, 0.5, 0.7, 1], "metallicFactor": 0.0, "roughnessFactor": 0.4}
    materials = [
        {"pbrMetallicRoughness": textured},
        {"pbrMetallicRoughness": plain, "doubleSided": True,
         "extensions": {"KHR_materials_ior": {"ior": 1.33}}},
    ]  # fmt: skip
    lights = [
        {"type": "point", "intensity": 20, "color": [1, 0.5, 0.25]},
        {"type": "directional", "intensity": 2, "color": [0.2, 1, 0.5]},
    ]
    held = [{"name": name, "extensions": {LIGHTS: {"light": number}}}
            for number, name in enumerate(("point", "sun"))]  # fmt: skip
    path = glb(
        tmp_path / "all.glb",
        [
            {"name": "outer", "translation": [-0.9, 0.2, 0.3], "scale": [1, 1.4, 0.7],
             "rotation": quaternion((2 / 7, 3 / 7, 6 / 7), 30), "children": [1]},
            {"name": "plate", "matrix": np.array(inner.matrix).T.ravel().tolist(), "mesh": 0},
            {"name": "back", "translation": [1.3, 0, -0.5], "rotation": quaternion((0, 1, 0), 160),
             "mesh": 1},
            held[0] | {"translation": [1, 2, 3], "scale": [2, 2, 2]},
            held[1] | {"rotation": quaternion((1, 0, 0), -50)},
            {"name": "eye", "translation": [0.5, 0.4, 6], "scale": [3, 3, 3], "camera": 0,
             "rotation": quaternion((0.6, -0.8, 0), -6)},
        ],
        materials,
        lights,
        roots=[0, 2, 3, 4, 5],
    )  # fmt: skip
    lines = ["v {} {} {}".format(*row) for row in CORNERS]
    lines += ["vn {} {} {}".format(*row) for row in NORMALS]
    lines += [f"vt {u} {1 - v}" for u, v in UV]  # v points up in OBJ files
    lines += ["f 1/1/1 2/2/2 3/3/3", "f 1/1/1 3/3/3 4/4/4"]
    (tmp_path / "square.obj").write_text("\n".join(lines))
    square = {"type": "obj", "filename": str(tmp_path / "square.obj")}

    def texture(pixels):
        bitmap = mi.Bitmap(np.ascontiguousarray(pixels, np.float32))
        return {"type": "bitmap", "raw": True, "bitmap": bitmap}

    def ahead(place, axis, degrees):
        turn = T().rotate(axis, degrees)
        to = np.array(place) + np.array(turn @ mi.ScalarVector3f(0, 0, -1))
        return T().look_at(place, to.tolist(), turn @ mi.ScalarVector3f(0, 1, 0))

    outer = T().translate((-0.9, 0.2, 0.3)).rotate((2 / 7, 3 / 7, 6 / 7), 30).scale((1, 1.4, 0.7))
    film = {"type": "hdrfilm", "rfilter": {"type": "box"}}
    expected = {
        "type": "scene",
        "plate": square | {
            "to_world": outer @ inner,
            "bsdf": {"type": "principled", "base_color": texture(decoded(PIXELS) * (1, 0.5, 0.8)),
                     "roughness": texture(0.8 * ROUGH[..., 1:2] / 255),
                     "metallic": texture(0.9 * ROUGH[..., 2:] / 255), "specular": 0.5},
        },
        "back": square | {
            "to_world": T().translate((1.3, 0, -0.5)).rotate((0, 1, 0), 160),
            "bsdf": {"type": "twosided", "bsdf": {
                "type": "principled", "base_color": {"type": "rgb", "value": [0.2, 0.5, 0.7]},
                "roughness": 0.4, "eta": 1.33}},
        },
        "point": {"type": "point", "position": [1, 2, 3],
                  "intensity": {"type": "rgb", "value": [20, 10, 5]}},
        "sun": {"type": "directional", "irradiance": {"type": "rgb", "value": [0.4, 2, 1]},
                "direction": T().rotate((1, 0, 0), -50) @ mi.ScalarVector3f(0, 0, -1)},
        "eye": {"type": "perspective", "fov_axis": "y", "fov": float(np.degrees(0.7)),
                "to_world": ahead((0.5, 0.4, 6), (0.6, -0.8, 0), -6), "film": film},
    }  # fmt: skip
    mine = made(path)
    assert mine["eye"]["film"]["width"] / mine["eye"]["film"]["height"] == 1.5
    lamps = ("point", "sun")
    for lamp in lamps:  # one at a time, so that no sample chooses among them
        others = set(lamps) - {lamp}
        ours, theirs = (
            image({name: part for name, part in scene.items() if name not in others}, 2)
            for scene in (mine, expected)
        )
        assert (theirs.max(axis=-1) > 0.02).mean() > 0.05
        off = np.abs(ours - theirs).max(axis=-1)
        assert np.percentile(off, 99.5) < 2e-4 * theirs.max()  # all but rays along an edge
    half = image(made(path, light="0.5"), 2).mean() / image(mine, 2).mean()
    assert half == pytest.approx(0.5, rel=1e-4)


def test_an_image_stands_upright_and_shines_as_the_file_says(rgb, tmp_path):
    material = {"emissiveFactor": [1, 0.5, 0.25], "emissiveTexture": {"index": 0},
                "extensions": {STRENGTH: {"emissiveStrength": 3}}}  # fmt: skip
    half = 1 / np.tan(0.35)  # as far as the square fills the picture from top to bottom
    eye = {"name": "eye", "camera": 0, "translation": [0, 0, half]}
    clamp = [{"wrapS": 33071}]
    path = glb(tmp_path / "lamp.glb", [{"mesh": 0}, eye], [material], samplers=clamp)
    seen = image(made(path), 1, size=(96, 64))[:, 16:80]  # the square
    # Symmetric about the middles of the image's pixels, where its own values show.
    middle = seen.reshape(4, 16, 8, 8, 3)[:, 7:9, :, 3:5].mean(axis=(1, 3))
    np.testing.assert_allclose(middle, decoded(PIXELS) * (3, 1.5, 0.75), atol=0.3)
    edge = seen.reshape(4, 16, 64, 3)[:, 7:9, 0].mean(axis=1)  # not mixed with the other edge
    np.testing.assert_allclose(edge, decoded(PIXELS)[:, 0] * (3, 1.5, 0.75), atol=0.3)


LAMBERT = {
    "pbrMetallicRoughness": {"metallicFactor": 0.0, "baseColorFactor": [0.5, 0.5, 0.5, 1]},
    "extensions": {"KHR_materials_ior": {"ior": 1}},
}


@pytest.mark.parametrize(
    ("inner", "outer"),
    [(None, None), (0, 0.7), (0.1, 0.3), (0.3, 1.2), (0.72, np.pi / 2), (0.1569, 0.1571)],
)
def test_spots_fall_off_as_the_extension_says(rgb, tmp_path, inner, outer):
    """The formula of KHR_lights_punctual, with its defaults, times Lambert's cosine over d^2."""
    light = {"type": "spot", "intensity": 40}
    if outer is not None:
        light["spot"] = {"innerConeAngle": inner, "outerConeAngle": outer}
    inner = inner or 0
    outer = outer or np.pi / 4
    held = {"extensions": {LIGHTS: {"light": 0}}, "translation": [1, 0.5, 3], "scale": [2, 2, 2],
            "rotation": quaternion((0, 1, 0), 20)}  # fmt: skip
    eye = {"name": "eye", "camera": 0, "translation": [0, 0, 8]}
    nodes = [{"mesh": 0, "scale": [9, 9, 1]}, held, eye]
    scene = made(glb(tmp_path / "a.glb", nodes, [LAMBERT], [light], normals=False))
    seen = image(scene, 2)
    offset = np.array((1, 0.5, 3)) - gbuffer(mi.load_dict(scene), (96, 64)).position
    distance = np.linalg.norm(offset, axis=-1)
    angle = np.radians(20)
    cosine = offset @ (np.sin(angle), 0, np.cos(angle)) / distance
    width = max(0.001, np.cos(inner) - np.cos(outer))
    level = np.clip((cosine - np.cos(outer)) / width, 0, 1) ** 2
    expected = 0.5 / np.pi * 40 * level * offset[..., 2] / distance**3
    off = np.abs(seen.mean(axis=-1) - expected)
    assert expected.max() > 0.3
    assert np.percentile(off, 98.5) < 0.01 * expected.max()  # all but means over a sharp edge
    assert seen.mean() == pytest.approx(expected.mean(), rel=0.01)
    pair = pair_for(Source("a", scene), Options(resolution=(96, 64)))
    assert not pair.unrepresentable
    textbook = mi.render(pair.heuristic.instantiate(), spp=16, seed=0)
    # It has the spot's flux, some of which misses the picture.
    assert np.mean(textbook) == pytest.approx(expected.mean(), rel=0.05)


@pytest.mark.parametrize("scale", [None, 0, 0.5, 3])
@pytest.mark.parametrize("normal", [(0.6, 0, 0.8), (0, 0.6, 0.8), (-0.36, -0.48, 0.8)])
def test_a_normal_map_tilts_to_the_images_right_and_top(rgb, tmp_path, normal, scale):
    """Lambert's cosine about the mapped normal, whose x is the image's right, and y its top.

    Its scale multiplies x and y.
    """
    colour = np.round((np.array(normal) + 1) * 127.5).astype(np.uint8)
    info = {"index": 0} if scale is None else {"index": 0, "scale": scale}
    material = LAMBERT | {"normalTexture": info}
    sun = {"extensions": {LIGHTS: {"light": 0}}, "rotation": quaternion((0.6, 0.8, 0), 20)}
    eye = {"name": "eye", "camera": 0, "translation": [0, 0, 6]}
    pixels = np.tile(colour, (2, 2, 1))
    light = {"type": "directional", "intensity": 2}
    path = glb(tmp_path / "a.glb", [{"mesh": 0}, eye, sun], [material], [light],
               normals=False, pixels=pixels)  # fmt: skip
    angle = np.radians(20)  # by Rodrigues, (0, 0, 1) turned about (0.6, 0.8, 0)
    to_light = np.array([0.8 * np.sin(angle), -0.6 * np.sin(angle), np.cos(angle)])
    factor = 1 if scale is None else scale
    mapped = (colour / 127.5 - 1) * (factor, factor, 1)
    cosine = mapped @ to_light / np.linalg.norm(mapped)
    seen = image(made(path), 2)[32, 48]
    np.testing.assert_allclose(seen, 0.5 / np.pi * 2 * cosine, rtol=1e-3)


def test_parts_of_one_name_are_all_there(rgb, tmp_path):
    names = ("a", "camera", "a", "a.b", "type", "a 4")
    path = glb(tmp_path / "a.glb", [{"name": name, "mesh": 0} for name in names], [{}])
    kinds = [part["type"] for part in made(path).values() if isinstance(part, dict)]
    assert (kinds.count("ply"), kinds.count("perspective")) == (len(names), 1)


@pytest.mark.parametrize("scale", [(1, 1, 1), (-1, 1, 1)])
def test_a_mirrored_mesh_without_normals_still_shows_its_front(rgb, tmp_path, scale):
    eye = {"name": "eye", "camera": 0, "translation": [0, 0, 6]}
    material = {"pbrMetallicRoughness": {"metallicFactor": 0.0}}
    path = glb(tmp_path / "a.glb", [{"mesh": 0, "scale": scale}, eye], [material], normals=False)
    assert image(made(path, sky="1"), 2)[32, 48].min() > 0.5


def test_a_map_or_a_sky_lights_a_file_and_a_camera_sees_all_of_it(rgb, tmp_path):
    nodes = [{"mesh": 0, "translation": [9, -3, 2]}, {"mesh": 0, "scale": [4, 1, 1]}]
    path = glb(tmp_path / "a.glb", nodes, [{"doubleSided": True}])
    mi.Bitmap(np.full((8, 16, 3), 0.5, np.float32)).write(str(tmp_path / "sky.exr"))
    under_map = made(path, environment=str(tmp_path / "sky.exr"))
    scene = mi.load_dict(under_map)
    box = scene.bbox()
    to_world = np.array(scene.sensors()[0].world_transform().matrix, float).reshape(4, 4)
    corners = np.array([np.ravel(box.corner(number)) for number in range(8)])
    x, y, z = (np.insert(corners, 3, 1, axis=1) @ np.linalg.inv(to_world).T)[:, :3].T
    half = np.tan(np.radians(under_map["camera"]["fov"]) / 2)
    assert (z > 0).all()
    assert (abs(y) < z * half).all()
    assert (abs(x) < z * half * 4 / 3).all()
    assert max((abs(y) / z / half).max(), (abs(x) / z / half).max()) > 0.5
    first, second = image(under_map, 3), image(made(path, sky="0.5"), 3)
    assert abs(first.mean() / second.mean() - 1) < 0.01
    assert abs(first[0, 0] - 0.5).max() < 1e-3


def test_what_is_left_out_is_named_once_and_what_cannot_be_read_refused(rgb, tmp_path, capsys):
    cut = {"alphaMode": "MASK", "occlusionTexture": {"index": 0}}
    opaque = {"alphaMode": "OPAQUE", "extras": {"range": 1}}
    more = {"extensionsUsed": ["KHR_materials_sheen", LIGHTS], "skins": [{"joints": [0]}],
            "samplers": [{"wrapS": 33071}, {"wrapT": 10497}]}  # fmt: skip
    lights = [{"type": "point", "range": 3}, {"type": "spot", "spot": {"innerConeAngle": 0.2}}]
    path = glb(tmp_path / "a.glb", [{"mesh": 0}, {"mesh": 1}], [cut, cut], lights, **more)
    made(path)
    words = [line.rpartition(": ")[2] for line in capsys.readouterr().err.splitlines()]
    assert words == ["KHR_materials_sheen", "alphaMode MASK", "occlusionTexture", "range", "skins",
                     "wrapT, apart from wrapS"]  # fmt: skip
    made(glb(tmp_path / "b.glb", [{"mesh": 0}], [opaque]))
    assert capsys.readouterr().err == ""
    packed = {"extensionsRequired": ["KHR_draco_mesh_compression", "KHR_mesh_quantization"]}
    with pytest.raises(InputError, match="requires KHR_draco_mesh_compression"):
        made(glb(tmp_path / "c.glb", [{"mesh": 0}], [opaque], **packed))


@pytest.mark.parametrize("name", ["cornell-box", "fig-6-5-m40"])
def test_pixels_see_an_exports_surfaces_where_they_were(rgb, tmp_path, name):
    size = (48, 32)
    case = open_case(name, Options(resolution=size))
    original = case.source.parse().instantiate()
    found = plain_scene(case.source, case.options)
    (tmp_path / "scene.gltf").write_text(json.dumps(gltf(found)))
    scene = mi.load_dict(made(tmp_path / "scene.gltf"))
    seen = gbuffer(scene, size)
    hit = found.layers["shape"] > 0
    assert (seen.hit == hit).mean() > 0.98  # rays along the open edge of the box
    for layer, own in (("P", seen.position), ("N", seen.normal)):
        off = np.linalg.norm(own - found.layers[layer], axis=-1)[hit & seen.hit]
        assert np.percentile(off, 98) < 0.02  # a sphere is triangles in the file
        assert np.median(off) < 1e-5
    place = mi.Point3f(np.ascontiguousarray(seen.position[hit & seen.hit].T))
    eye = mi.Point3f(np.linalg.inv(found.camera["view"])[:3, 3])
    rays = mi.Ray3f(eye, place - eye)
    off = dr.norm(scene.ray_intersect(rays).uv - original.ray_intersect(rays).uv)
    assert np.percentile(off, 90) < 0.01


def point(attenuation, **more):
    k0, k1, k2 = map(float, attenuation)
    return {
        "type": "heuristic_point",
        "position": (0.4, 0.2, 2),
        "k0": k0,
        "k1": k1,
        "k2": k2,
    } | more


def spot(exponent, cutoff, attenuation=(0, 0, 1)):
    cone = {"direction": (-0.2, 0, -1), "exponent": float(exponent), "cutoff": float(cutoff)}
    return point(attenuation) | cone | {"type": "heuristic_spot"}


GREEN = {"type": "rgb", "value": [0.2, 1, 0.5]}
KEPT = {
    "a point": point((0, 0, 1 / 9), intensity=1.5),
    "a coloured one": point((0, 0, 4), intensity=GREEN),
    "one with a scale": point((0, 0, 2), scale=3.0),
    "an even spot": spot(0, 25),
    "parallel light": {"type": "directional", "direction": (1, 0, -2), "irradiance": 2.0},
    "a shining ball": {"type": "sphere", "center": (0, 0, 2), "radius": 0.1},
}
CHANGED = {
    "no fall-off": (point((1, 0, 0)), "attenuation"),
    "linear": (point((0, 0.5, 0)), "attenuation"),
    "mixed": (point((1, 0.2, 0.1)), "attenuation"),
    "clamped": (point((0, 0, 1 / 9), clamped=True), "attenuation"),
    "two intensities": (
        point((0, 0, 0.25), diffuse_intensity=GREEN, specular_intensity=1.0), "specular intensity"),
    "a lamp's spot": (spot(1, 90), "cos^1"),
    "a sharp spot": (spot(40, 30), "cos^40"),
    "a spot cut off": (spot(3, 120), "cos^3"),
    "a wide spot": (spot(0, 120), "cone of 120"),
    "a spot without fall-off": (spot(10, 50, (1, 0, 0)), "attenuation"),
}  # fmt: skip


def there_and_back(folder, light):
    """The textbook's picture of a floor below a light, and direct light in its export."""
    shade = {"bsdf": {"type": "diffuse", "reflectance": 0.5}}
    if light["type"] == "sphere":
        radiance = {"type": "rgb", "value": [18.4, 14, 6.8]}
        light = light | shade | {"emitter": {"type": "area", "radiance": radiance}}
    scene = {
        "type": "scene", "integrator": {"type": "heuristic"}, "it": light,
        "floor": {"type": "rectangle", "to_world": mi.ScalarTransform4f().scale(4)} | shade,
        "eye": camera((0, -3, 6), size=48, fov=35.0),
    }  # fmt: skip
    source = Source("floor", scene)
    found = plain_scene(source, Options())
    file = gltf(found)
    (folder / "scene.gltf").write_text(json.dumps(file))
    back = made(folder / "scene.gltf")
    if light["type"] == "sphere":  # the lamp is there beside its surface
        shining = [part for part in back.values() if isinstance(part, dict) and "emitter" in part]
        radiance = shining[0].pop("emitter")["radiance"]["value"]
        np.testing.assert_allclose(radiance, (18.4, 14, 6.8), rtol=1e-6)
    floor = found.layers["shape"] == 1 + [shape.name for shape in found.shapes].index("floor")
    textbook = mi.render(pair_for(source, Options()).heuristic.instantiate(), spp=16, seed=1)
    losses = file["extras"]["losses"]
    return np.array(textbook)[floor], image(back, 2, size=(48, 48))[floor], losses


@pytest.mark.parametrize("name", KEPT)
def test_lights_come_back_from_an_export_as_they_were(rgb, tmp_path, name):
    textbook, back, losses = there_and_back(tmp_path, KEPT[name])
    assert not losses
    off = np.abs(textbook - back).max(axis=-1)
    assert textbook.max() > 0.01
    assert np.percentile(off, 95) < 0.01 * textbook.max()  # all but the edge of a cone


@pytest.mark.parametrize("name", CHANGED)
def test_what_an_export_changes_is_named_and_keeps_its_mean(rgb, tmp_path, name):
    """The irradiance of what is seen stays, or a spot's flux, most of which is seen."""
    light, loss = CHANGED[name]
    textbook, back, losses = there_and_back(tmp_path, light)
    assert any(loss in words for words in losses)
    assert back.mean() == pytest.approx(textbook.mean(), rel=0.2 if "cos^" in loss else 0.01)


def test_the_cone_of_an_export_keeps_flux_and_intensity_ahead():
    """For cos t up to 90 degrees: cos i = 3 / 4, since 1 - 2 / 3 cos i is 1 / 2."""
    inner, outer, _ = cone_of(90, 1)
    assert (np.cos(inner), outer) == pytest.approx((0.75, np.pi / 2), abs=1e-6)
    for cutoff, exponent in ((90, 3), (30, 40), (60, 0.5), (20, 1e4)):
        inner, outer, _ = cone_of(cutoff, exponent)
        assert 0 <= inner < outer <= np.radians(cutoff) + 1e-9
        theta = np.linspace(0, np.radians(cutoff), 200_001)
        given = np.cos(theta) ** exponent
        width = np.cos(inner) - np.cos(outer)
        found = np.clip((np.cos(theta) - np.cos(outer)) / width, 0, 1) ** 2
        fluxes = [np.sum(level * np.sin(theta)) for level in (given, found)]
        assert fluxes[1] == pytest.approx(fluxes[0], rel=1e-3)


@pytest.mark.thorough
def test_the_command_compares_a_file(run, tmp_path):
    """An exact pair comes back as one: the export's light, camera and diffuse sphere."""
    assert run("export", "lambert-sphere", "--resolution", "32x24", "-o", tmp_path)[0] == 0
    file = tmp_path / "export/lambert-sphere/scene.gltf"
    words = ("-D", f"file={file}", "--resolution", "32x24", "--spp", "64", "-o", tmp_path / "out")
    code, said, _ = run("compare", SCRIPT, *words)
    assert code == 0
    assert "gltf" in said
    assert "left out" not in said
    record = json.loads((tmp_path / "out/gltf/comparison.json").read_text())
    assert record["plan"]["stock_integrator"] == "path"
    assert {"diffuse", "distance attenuation"} <= {
        effect["name"] for effect in record["plan"]["effects"] if effect["called_for"]
    }
