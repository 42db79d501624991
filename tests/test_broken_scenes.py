"""Scenes that cannot be meant are refused in words, and never rendered in silence."""

import os
import struct
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest

from comparisons.case import Request, open_case
from comparisons.check.check import measure_scene
from comparisons.compare import compare
from comparisons.cost.cost import quick
from comparisons.fit.fit import fit
from comparisons.options import LARGEST_SPP, Options
from heuristic.errors import InputError
from heuristic.interpolation import FINEST
from reference.rendering.renderer import LARGEST_PASS
from reference.scene import reading
from tests import broken_scenes, corpus_files
from tests.small_scene import SCENE

SMALL = {"spp": 4, "resolution": (12, 8)}

SPHERE = '<shape type="sphere">'
BALL = '<shape type="sphere" id="ball">'
MATTE = '<bsdf type="twosided"><bsdf type="diffuse"/></bsdf>'
FILM = '<integer name="width" value="24"/><integer name="height" value="16"/>'
LOOK = '<lookat origin="0, -5, 2" target="0, 0, 0" up="0, 0, 1"/>'
ALPHA = '<float name="alpha" value="0.2"/>'
END = "</scene>"


def number(name, value):
    return f'<float name="{name}" value="{value}"/>'


def transform(inner, name="to_world"):
    return f'<transform name="{name}">{inner}</transform>'


def radius(value):
    return SPHERE, BALL + number("radius", value)


def ior(plugin, value, key="int_ior"):
    return MATTE, f'<bsdf type="{plugin}" id="odd">{number(key, value)}</bsdf>'


def camera(inner):
    return '<sensor type="perspective">', f'<sensor type="perspective" id="eye">{inner}'


def table(values):
    inner = '<string name="wavelengths" value="400, 500, 600"/>'
    inner += f'<string name="values" value="{values}"/>'
    spectrum = f'<spectrum type="irregular" name="reflectance" id="odd">{inner}</spectrum>'
    return MATTE, f'<bsdf type="diffuse">{spectrum}</bsdf>'


def film(inner):
    return FILM, f"{FILM}{inner}"


BROKEN = {
    "an integrator that is none": (
        'type="path"',
        'type="no_such_thing"',
        "no_such_thing.*not found",
    ),
    "a depth below none": (
        'name="max_depth" value="3"',
        'name="max_depth" value="-5"',
        "max_depth",
    ),
    "a pixel format that is none": (
        '<film type="hdrfilm">',
        '<film type="hdrfilm"><string name="pixel_format" value="rgbx"/>',
        "pixel_format = 'rgbx'",
    ),
    "radius NaN": (*radius("nan"), "ball: radius = nan"),
    "radius infinite": (*radius("inf"), "ball: radius = inf"),
    "radius 0": (*radius("0"), "ball: radius = 0 .*other than 0"),
    "radius beyond floats": (*radius("1e39"), "ball: radius = 1e.39 .*finite"),
    "radius too large": (*radius("1e38"), "ball: the shape reaches"),
    "singular transform": (
        SPHERE,
        BALL + transform('<scale x="1" y="1" z="0"/>'),
        "ball: to_world",
    ),
    "NaN transform": (SPHERE, BALL + transform('<translate x="nan"/>'), "ball: to_world .*finite"),
    "infinite transform": (SPHERE, BALL + transform('<scale value="inf"/>'), "ball: to_world"),
    "a matrix that no axis leaves": (
        SPHERE,
        BALL + transform('<matrix value="1 0 0 0  1 0 0 0  0 0 1 0  0 0 0 1"/>'),
        "ball: to_world .*inverted",
    ),
    "a matrix that flattens": (
        SPHERE,
        BALL + transform('<matrix value="1 1 0 0  1 1 0 0  0 0 1 0  0 0 0 1"/>'),
        "ball: to_world .*inverted",
    ),
    "a cylinder without length": (
        END,
        '<shape type="cylinder" id="tube"><point name="p0" x="1" y="2" z="3"/>'
        f'<point name="p1" x="1" y="2" z="3"/></shape>{END}',
        "tube: p0 and p1 are the same point",
    ),
    "a table with a NaN": (*table("0.1, nan, 0.3"), "odd: values = .*finite"),
    "a table with a word": (*table("0.1, some, 0.3"), "some"),
    "camera at its target": (LOOK, LOOK.replace("0, -5, 2", "0, 0, 0"), "invalid lookat"),
    "camera along up": (LOOK, LOOK.replace('up="0, 0, 1"', 'up="0, -5, 2"'), "invalid lookat"),
    "fov NaN": (*camera(number("fov", "nan")), "eye: fov = nan .*between 0 and 180"),
    "fov 0": (*camera(number("fov", 0)), "eye: fov = 0 .*between 0 and 180"),
    "fov 180": (*camera(number("fov", 180)), "eye: fov = 180"),
    "fov infinite": (*camera(number("fov", "inf")), "eye: fov = inf"),
    "near clip 0": (*camera(number("near_clip", 0)), "eye: near_clip = 0 .*above 0"),
    "near beyond far": (*camera(number("near_clip", 9) + number("far_clip", 3)), "near_clip = 9"),
    "far clip infinite": (*camera(number("far_clip", "inf")), "eye: far_clip = inf"),
    "film of width 0": (FILM, FILM.replace('"24"', '"0"'), "width = 0 .*1 or more"),
    "film of height -1": (FILM, FILM.replace('"16"', '"-1"'), "height = -1 .*1 or more"),
    "crop of width 0": (*film('<integer name="crop_width" value="0"/>'), "crop_width = 0"),
    "crop outside": (*film('<integer name="crop_offset_x" value="9"/>'), "crop_offset_x = 9"),
    "looking away": (LOOK, LOOK.replace('target="0, 0, 0"', 'target="0, -9, 3"'), "no pixel sees"),
    "no shapes": (SCENE[SCENE.index("<shape") : SCENE.index("<emitter")], "", "no pixel sees"),
    "ior infinite": (*ior("plastic", "inf"), "odd: int_ior = inf"),
    "ior 0": (*ior("dielectric", 0, "ext_ior"), "odd: ext_ior = 0 .*above 0"),
    "ior negative": (*ior("roughplastic", -1.5), "odd: int_ior = -1.5 .*above 0"),
    "eta negative": (*ior("principled", -1, "eta"), "odd: eta = -1 .*above 0"),
    "k NaN": (*ior("conductor", "nan", "k"), "odd: k = nan"),
    "roughness 1e308": (ALPHA, ALPHA.replace("0.2", "1e308"), "alpha = 1e.308 .*roughness"),
    "roughness 1e9": (ALPHA, ALPHA.replace("0.2", "1e9"), "alpha = 1e.09 .*up to 1000"),
    "spot without opening": (
        END,
        f'<emitter type="spot" id="lamp">{number("cutoff_angle", 0)}</emitter>{END}',
        "lamp: cutoff_angle = 0",
    ),
    "light to nowhere": (
        END,
        '<emitter type="directional" id="sun"><vector name="direction" x="0" y="0" z="0"/>'
        f"</emitter>{END}",
        "sun: direction",
    ),
    "bumps of a checkerboard": (
        MATTE,
        '<bsdf type="bumpmap" id="odd"><texture type="checkerboard"/><bsdf type="diffuse"/></bsdf>',
        "odd: a texture checkerboard gives bumpmap no slope",
    ),
    "bumps of nothing": (MATTE, '<bsdf type="bumpmap"><bsdf type="diffuse"/></bsdf>', "Texture"),
    "a bitmap of nothing": (
        MATTE,
        '<bsdf type="diffuse"><texture type="bitmap" name="reflectance" id="odd"/></bsdf>',
        "odd: it has no picture",
    ),
    "a blend of one": (
        MATTE,
        '<bsdf type="blendbsdf" id="odd"><bsdf type="diffuse"/></bsdf>',
        "odd: it needs 2 BSDF elements, and has 1",
    ),
    "a NUL byte": ("point", "p\0int", "holds a NUL byte"),
    "not UTF-8": ("point", "p\udce9int", "not UTF-8"),
}


def case_of(tmp_path, text, **words):
    path = tmp_path / "scene.xml"
    path.write_bytes(text.encode("utf-8", errors="surrogateescape"))
    return open_case(path, Request(**SMALL | words))


def compared(tmp_path, text, **words):
    case = case_of(tmp_path, text, **words)
    return compare(case.source, case.options)


def changed(before, after):
    assert before in SCENE
    return SCENE.replace(before, after, 1)


@pytest.mark.guarantee(
    "runs",
    "A scene with impossible values, or with nothing in view, is rejected with a message that"
    " names the element.",
)
@pytest.mark.parametrize(("before", "after", "message"), BROKEN.values(), ids=BROKEN.keys())
def test_what_cannot_be_meant_is_refused_by_name(rgb, tmp_path, before, after, message):
    text = changed(before, after)
    if "crop" not in message and "width" not in message and "height" not in message:
        with pytest.raises(InputError, match=message):
            compared(tmp_path, text)
        return
    with pytest.raises(InputError, match=message):
        compared(tmp_path, text, resolution=None)


LEGAL = {
    "roughness 0": (ALPHA, ALPHA.replace("0.2", "0")),
    "roughness below 0": (ALPHA, ALPHA.replace("0.2", "-0.1")),
    "a tiny scale": (SPHERE, BALL + transform('<scale x="1" y="1" z="1e-6"/>')),
    "inside out": (SPHERE, BALL + number("radius", -1)),
    "a mirror": (*ior("conductor", 0, "eta"),),
    "no difference of indices": (*ior("dielectric", 1),),
    "an index of 1e5": (*ior("plastic", "1e5"),),
    "stripes": (
        MATTE,
        '<bsdf type="diffuse"><texture type="checkerboard" name="reflectance">'
        + transform('<scale x="4" y="0"/>', "to_uv")
        + "</texture></bsdf>",
    ),
}


@pytest.mark.parametrize(("before", "after"), LEGAL.values(), ids=LEGAL.keys())
def test_what_mitsuba_renders_is_not_refused(rgb, tmp_path, before, after):
    images = compared(tmp_path, changed(before, after)).images
    assert np.isfinite(images.heuristic).all()
    assert images.reference.max() > 0


AWAY = SCENE.replace('target="0, 0, 0"', 'target="0, -9, 3"')


@pytest.mark.parametrize("work", [compare, measure_scene, quick, fit])
def test_every_command_refuses_an_empty_picture(rgb, tmp_path, work):
    case = case_of(tmp_path, AWAY)
    with pytest.raises(InputError, match=r"no pixel sees a surface.*--allow-empty"):
        work(case.source, case.options)


def test_an_empty_picture_is_taken_where_it_is_asked_for(rgb, tmp_path):
    case = case_of(tmp_path, AWAY, allow_empty=True)
    assert compare(case.source, case.options).record.pixels.counted == 0
    assert measure_scene(case.source, case.options).measurement.metrics["dE2000"].value == 0
    assert "--allow-empty" in case.command()


# -- Files -----------------------------------------------------------------------------------------

CORPUS = Path(__file__).parent / "corpus"
POINTS = np.array([[1, 1, 1], [-1, -1, 1], [-1, 1, -1], [1, -1, -1]], "<f4")
CORNERS = np.array([[0, 1, 3], [0, 2, 1], [0, 3, 2], [1, 2, 3]], "<i4")


def ply(points=POINTS, corners=CORNERS, vertices=None):
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {vertices or len(points)}"]
    head += [f"property float {axis}" for axis in "xyz"] + [f"element face {len(corners)}"]
    head += ["property list uchar int vertex_indices", "end_header", ""]
    faces = b"".join(struct.pack("<Biii", 3, *map(int, face)) for face in corners)
    return "\n".join(head).encode() + points.tobytes() + faces


def ply_in_words(corners=CORNERS, vertices=4, faces=4):
    head = ["ply", "format ascii 1.0", "comment - 1 - 2", f"element vertex {vertices}"]
    head += [f"property float {axis}" for axis in "xyz"] + [f"element face {faces}"]
    head += ["property list uchar int vertex_indices", "end_header"]
    lines = [" ".join(map(str, point)) for point in POINTS.tolist()]
    lines += [" ".join(map(str, (3, *face))) for face in corners.tolist()]
    return "\n".join([*head, *lines, ""]).encode()


def with_index(index):
    corners = CORNERS.copy()
    corners[1, 1] = index
    return corners


MESHES = {
    "an index that is not there": (ply(corners=with_index(9)), "names vertex 9, and there are 4"),
    "an index far beyond memory": (ply(corners=with_index(10**8)), "names vertex 100000000"),
    "positions that are nowhere": (ply(np.where(POINTS > 0, POINTS, np.nan)), "invalid vertex"),
    "an index below 0": (ply(corners=with_index(-1)), "face 1 names a vertex below 0"),
    "words with an index below 0": (ply_in_words(with_index(-1)), "face 1 names a vertex below 0"),
    "words that promise a trillion vertices": (ply_in_words(vertices=10**12), "mesh.ply"),
    "words that promise a trillion faces": (ply_in_words(faces=10**12), "mesh.ply"),
    "a cut": (ply()[:-9], "read"),
    "nothing": (b"", "mesh.ply"),
    "noise": (np.random.default_rng(0).bytes(500), "mesh.ply"),
    "a header of a trillion": (ply(vertices=10**12), "read"),
}


@pytest.mark.parametrize(("content", "message"), MESHES.values(), ids=MESHES.keys())
def test_a_damaged_mesh_is_named(rgb, tmp_path, content, message):
    (tmp_path / "mesh.ply").write_bytes(content)
    shape = '<shape type="ply"><string name="filename" value="mesh.ply"/></shape>'
    with pytest.raises(InputError, match=message) as refusal:
        compared(tmp_path, SCENE.replace(END, shape + END))
    assert "mesh.ply" in str(refusal.value)


@pytest.mark.parametrize("content", [ply(), ply_in_words()], ids=["numbers", "words"])
def test_a_sound_mesh_is_compared(rgb, tmp_path, content):
    (tmp_path / "mesh.ply").write_bytes(content)
    shape = '<shape type="ply"><string name="filename" value="mesh.ply"/></shape>'
    assert compared(tmp_path, SCENE.replace(END, shape + END)).record.pixels.counted


def test_a_measured_material_is_refused_wherever_it_is_cut(rgb, corpus):
    path, scene = corpus / "measured.bsdf", (CORPUS / "bsdf-measured.xml").read_text()
    whole = path.read_bytes()
    assert compared(corpus, scene).record.pixels.counted
    for size in (0, 5, 14, 30, 150, *range(200, len(whole), 97), len(whole) - 1):
        path.write_bytes(whole[:size])
        with pytest.raises(InputError, match="measured"):
            compared(corpus, scene)
    path.write_bytes(whole)


READERS = {
    "include": '<include filename="{}"/>',
    "placeholder": '<default name="where" value="{}"/><include filename="$where"/>',
    "spectrum": '<shape type="sphere"><bsdf type="diffuse">'
    '<spectrum name="reflectance" filename="{}"/></bsdf></shape>',
    "mesh": '<shape type="ply"><string name="filename" value="{}"/></shape>',
    "bitmap": '<shape type="sphere"><bsdf type="diffuse"><texture type="bitmap" name="reflectance">'
    '<string name="filename" value="{}"/></texture></bsdf></shape>',
}


@pytest.mark.parametrize("reader", READERS.values(), ids=READERS.keys())
@pytest.mark.parametrize("kind", ["a pipe", "a folder", "a device"])
def test_special_files_are_refused_before_they_are_opened(rgb, tmp_path, reader, kind):
    path = tmp_path / "special"
    if kind == "a pipe":
        os.mkfifo(path)
    elif kind == "a folder":
        path.mkdir()
    else:
        path = Path("/dev/zero")
    with pytest.raises(InputError, match=f"{path} is {kind}"):
        compared(tmp_path, SCENE.replace(END, reader.format(path) + END))


def test_a_pipe_in_a_dictionary_is_refused(rgb, tmp_path):
    os.mkfifo(tmp_path / "pipe")
    spectrum = {"type": "spectrum", "filename": str(tmp_path / "pipe")}
    with pytest.raises(InputError, match="is a pipe"):
        open_case({"type": "scene", "part": {"type": "diffuse", "reflectance": spectrum}})


def test_includes_that_fan_out_end(rgb, tmp_path):
    for depth in range(10):
        inner = f'<include filename="{depth + 1}.xml"/>' * 6
        (tmp_path / f"{depth}.xml").write_text(f'<scene version="3.0.0">{inner}</scene>')
    (tmp_path / "10.xml").write_text('<scene version="3.0.0"/>')
    with pytest.raises(InputError, match=f"more than {reading.MOST_INCLUDES} times"):
        compared(tmp_path, SCENE.replace(END, '<include filename="0.xml"/>' + END))


def test_text_without_end_is_refused(rgb, tmp_path, monkeypatch):
    monkeypatch.setattr(reading, "LONGEST", 4200)
    (tmp_path / "part.xml").write_text(f'<scene version="3.0.0"><!--{4000 * "x"}--></scene>')
    with pytest.raises(InputError, match=r"part.xml: .*4200 are allowed"):
        compared(tmp_path, SCENE.replace(END, '<include filename="part.xml"/>' + END))


def test_a_chain_of_includes_ends(rgb, tmp_path, monkeypatch):
    monkeypatch.setattr(reading, "DEEPEST", 3)
    for place in range(4):
        inner = f'<include filename="{place + 1}.xml"/>'
        (tmp_path / f"{place}.xml").write_text(f'<scene version="3.0.0">{inner}</scene>')
    (tmp_path / "4.xml").write_text('<scene version="3.0.0"/>')
    with pytest.raises(InputError, match=r"2.xml: more than 3 files include each other"):
        compared(tmp_path, SCENE.replace(END, '<include filename="0.xml"/>' + END))
    included = reading.included(tmp_path / "2.xml")
    assert [path.name for path in included] == ["2.xml", "3.xml", "4.xml"]


@pytest.mark.parametrize("reader", READERS.values(), ids=READERS.keys())
def test_a_name_too_long_for_a_file_is_refused(rgb, tmp_path, reader):
    with pytest.raises(InputError, match="xxxx"):
        compared(tmp_path, SCENE.replace(END, reader.format(5000 * "x") + END))


def test_a_name_too_long_for_a_file_is_refused_in_a_dictionary_too(rgb):
    given = {"type": "scene", "mesh": {"type": "ply", "filename": 5000 * "x"}}
    with pytest.raises(InputError, match=r"^'x+': File name too long. Give a file.$"):
        open_case(given)


def test_a_name_with_a_nul_is_refused(rgb, tmp_path):
    """From a placeholder's value: a file that holds one is refused as a whole."""
    text = SCENE.replace(END, '<shape type="ply"><string name="filename" value="$mesh"/></shape>'
                         + END)  # fmt: skip
    with pytest.raises(InputError, match="ball"):
        compared(tmp_path, text, define={"mesh": "ball\0.ply"})


def test_a_folder_is_not_read_as_a_scene(tmp_path):
    with pytest.raises(InputError, match="no such regular file"):
        reading.included(tmp_path)
    assert reading.placeholders(tmp_path) == set()


# -- Options ---------------------------------------------------------------------------------------

REFUSED_OPTIONS = [
    ({"spp": 99999999999999}, f"spp = .* to {LARGEST_SPP}"),
    ({"spp": 2.5}, "spp = 2.5 .*whole number"),
    ({"spp": True}, "spp = True .*whole number"),
    ({"tessellation": 10**8}, f"tessellation = .* to {FINEST}"),
    ({"tessellation": 0}, "tessellation = 0"),
    ({"seed": -1}, "seed = -1"),
    ({"noise": float("nan")}, "noise = nan"),
    ({"noise": float("inf")}, "noise = inf"),
    ({"noise": 0}, "noise = 0"),
    ({"noise": -1}, "noise = -1"),
    ({"noise": "little"}, "noise = 'little'"),
    ({"resolution": (0, 5)}, "resolution"),
    ({"resolution": (5,)}, "resolution"),
]


@pytest.mark.parametrize(("words", "message"), REFUSED_OPTIONS)
def test_options_beyond_their_bounds_are_refused(words, message):
    with pytest.raises(InputError, match=message):
        Options(**words)


def test_a_pass_is_bounded_however_it_is_asked_for(rgb, tmp_path):
    case = case_of(tmp_path, SCENE, spp=LARGEST_SPP, resolution=(2000, 1000))
    with pytest.raises(InputError, match=f"{LARGEST_PASS} samples per pass"):
        measure_scene(case.source, case.options)


# -- At random -------------------------------------------------------------------------------------


@pytest.fixture
def corpus(tmp_path):
    mi.set_variant("llvm_ad_rgb")
    level = mi.log_level()
    mi.set_log_level(mi.LogLevel.Error)
    corpus_files.write(tmp_path)
    yield tmp_path
    mi.set_log_level(level)


FEW, MANY = 16, 400


@pytest.mark.parametrize("seed", range(FEW))
def test_a_scene_broken_at_random_is_rendered_or_refused(seed, rgb, corpus):
    found = broken_scenes.outcome(seed, corpus)
    assert found.kind in ("rendered", "refused"), found


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(FEW, MANY))
def test_any_scene_broken_at_random_is(seed, rgb, corpus):
    found = broken_scenes.outcome(seed, corpus)
    assert found.kind in ("rendered", "refused"), found


def test_an_error_of_another_kind_is_found_out(rgb, corpus, monkeypatch):
    def fails(*_):
        raise ZeroDivisionError("float division by zero")

    monkeypatch.setattr(broken_scenes, "compare", fails)
    kinds = {broken_scenes.outcome(seed, corpus).kind for seed in range(FEW)}
    assert "wrong" in kinds
