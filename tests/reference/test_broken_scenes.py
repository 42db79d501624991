"""Scenes that cannot be meant are refused in words, and never rendered in silence."""

import os
import re
import struct
import tomllib
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest

from fotismos.comparisons.case import open_case
from fotismos.comparisons.check.measured import measure_scene
from fotismos.comparisons.check.moved import check
from fotismos.comparisons.compare import compare
from fotismos.comparisons.departure import criterion
from fotismos.comparisons.departure.criterion import TOLERANCE, caution
from fotismos.comparisons.departure.metrics import leading_distance
from fotismos.comparisons.fit.fit import fit
from fotismos.comparisons.halves import Halves
from fotismos.comparisons.ladder.cost import cost
from fotismos.comparisons.options import LARGEST_SPP, Options
from fotismos.comparisons.records.departure import DEFAULT_VIEWING
from fotismos.comparisons.study import design
from fotismos.heuristic.errors import FotismosError, InputError, NonFiniteError
from fotismos.reference.rendering.renderer import LARGEST_PASS
from fotismos.reference.scene.source import Source
from fotismos.reports import verdict
from tests.shared import corpus_files
from tests.shared.misplanned import scene as described
from tests.shared.small_scene import SCENE

SMALL = {"spp": 4, "resolution": (12, 8)}
END = "</scene>"
TABLE = tomllib.loads(
    (Path(__file__).parents[1] / "shared/broken_scenes.toml").read_text(encoding="utf-8")
)
"""Scenes as what is replaced in the small scene, by what, and a pattern of the message."""


def case_of(tmp_path, text, **words):
    path = tmp_path / "scene.xml"
    path.write_bytes(text.encode("utf-8", errors="surrogateescape"))
    return open_case(path, Options(**SMALL | words))


def compared(tmp_path, text, **words):
    case = case_of(tmp_path, text, **words)
    return compare(case.source, case.options)


def changed(before, after):
    assert before in SCENE
    return SCENE.replace(before, after, 1)


@pytest.mark.guarantee(
    "runs",
    "Impossible values (roughness, shares, indices, `sigma_t`, sizes) are refused with a message.",
)
def test_what_cannot_be_meant_is_refused_by_name(rgb, tmp_path):
    odd = [("point", "p\0int", "parsing"), ("point", "p\udce9int", "in UTF-8")]
    odd += [(f'"{word}"', f'"a&#x{half};b"', r"a(\\x..){3}b' is not text in UTF-8")
            for word, half in (("sphere", "D800"), ("alpha", "DFFF"))]  # fmt: skip
    odd += [('<shape type="sphere">', '<shape type="sphere" id="a&#xD800;b">', "is not text")]
    wrong = []
    for before, after, message in [*TABLE["broken"], *odd]:
        is_film = any(word in message for word in ("crop", "width", "height"))
        words = {"resolution": None} if is_film else {}
        try:
            compared(tmp_path, changed(before, after), **words)
            wrong.append((after, "not refused"))
        except InputError as refusal:
            wrong += [] if re.search(message, str(refusal)) else [(after, str(refusal))]
    assert not wrong


@pytest.mark.thorough
def test_what_mitsuba_renders_is_not_refused(rgb, tmp_path):
    for ball, floor in zip(TABLE["legal_balls"], TABLE["legal_floors"], strict=True):
        images = compared(tmp_path, changed(*ball).replace(*floor)).images
        assert np.isfinite(images.heuristic).all()
        assert images.reference.max() > 0


OBJ_OF_QUAD = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nvn 0 0 1\n"
PARTLY = r"bad\.obj: the face in line {} names no normal, .* or set face_normals"
UNDEFINED = {
    "second": ("f 1//1 2//1 3//1\nf 1 3 4\n", 7),
    "first": ("vt 0 0\nf 1/1 2/1 3/1\nf 1/1/1 3/1/1 4/1/1\n", 7),
    "none": ("f 1 2 3\nf 1 3 4", 6),
    "empty": ("vt 0 0\nf 1/1/1 2/1/1 3/1/1\nf 1/1/ 3/1/ 4/1/\n", 8),
    "zero": ("f 1//1 2//1 3//0\nf 1//1 3//1 4//1\n", 6),
}


@pytest.mark.parametrize("name", UNDEFINED)
def test_faces_without_normals_in_a_file_that_has_some_are_refused(name, rgb, tmp_path):
    """Mitsuba 3.9 leaves what it does not read as it finds it in memory."""
    faces, line = UNDEFINED[name]
    path = tmp_path / "bad.obj"
    path.write_text(OBJ_OF_QUAD + faces, encoding="utf-8")
    shown = changed('"sphere">', f'"obj"><string name="filename" value="{path}"/>')
    with pytest.raises(InputError, match=PARTLY.format(line)):
        compared(tmp_path, shown)
    even = shown.replace(f'"{path}"/>', f'"{path}"/><boolean name="face_normals" value="true"/>')
    assert np.isfinite(compared(tmp_path, even).images.normal).all()


def quad(folder, **rows):
    """Write a PLY of two triangles, of which the first vertex has other values."""
    names = ("x", "y", "z", "nx", "ny", "nz", "u", "v")
    points = [(x, y, 0, 0, 0, 1, x, y) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    points[0] = tuple(rows.get(name, value) for name, value in zip(names, points[0], strict=True))
    head = "".join(f"property float {name}\n" for name in names)
    path = folder / "quad.ply"
    path.write_bytes(
        b"ply\nformat binary_little_endian 1.0\nelement vertex 4\n" + head.encode()
        + b"element face 2\nproperty list uchar int vertex_indices\nend_header\n"
        + b"".join(struct.pack("<8f", *point) for point in points)
        + b"".join(struct.pack("<B3i", 3, *face) for face in ((0, 1, 2), (0, 2, 3)))
    )  # fmt: skip
    return f'"ply" id="quad"><string name="filename" value="{path}"/>'


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ({"nz": 0.0}, "quad: the normal of vertex 0 is "),
        ({"nz": np.nan}, "quad: the normal of vertex 0 is "),
        ({"u": np.inf}, "quad: the texture coordinate of vertex 0 is "),
    ],
)
def test_meshes_without_shading_frames_are_refused_by_name(rows, message, rgb, tmp_path):
    with pytest.raises(InputError, match=message):
        compared(tmp_path, changed('"sphere">', quad(tmp_path, **rows)))
    # A long one is normalised.
    found = compared(tmp_path, changed('"sphere">', quad(tmp_path, nz=5.0))).images
    assert np.linalg.norm(found.normal[found.counted], axis=1) == pytest.approx(1, abs=1e-5)


def test_normals_that_only_rays_show_are_named_with_their_shape(rgb, tmp_path):
    """A mesh within a group, which no scene lists."""
    group = f'<shape type="shapegroup" id="group"><shape type={quad(tmp_path, nz=0.0)}</shape>'
    whole = SCENE.replace(
        END, f'{group}</shape><shape type="instance" id="copy"><ref id="group"/></shape>{END}'
    )
    whole = re.sub(r'(?s)<shape type="sphere">.*?</shape>', "", whole, count=1)
    with pytest.raises(NonFiniteError, match=r"copy: .* without a finite normal"):
        compared(tmp_path, whole)


@pytest.mark.parametrize("mirror", ['<scale x="-1"/>', '<scale value="-1"/>', ""])
def test_a_mirrored_sphere_is_named_beside_others_and_alone(mirror, rgb, tmp_path):
    """Its normals point inwards, so it is black from outside, unless they are flipped."""
    own = f'<transform name="to_world">{mirror}</transform>'
    own = own if mirror else '<float name="radius" value="-1"/>'
    dark = changed('"sphere">', f'"sphere" id="ball">{own}')
    said = "ball: a transform or a negative radius mirrors the sphere"
    assert [said in line for line in compared(tmp_path, dark).record.warnings] == [True]
    alone = re.sub(r'(?s)<shape type="rectangle">.*?</shape>', "", dark)
    alone = re.sub(r'  <emitter type="constant".*\n', "", alone)
    with pytest.raises(InputError, match=rf"both pictures are black.*{said}"):
        compared(tmp_path, alone)
    flip = f'"ball"><boolean name="flip_normals" value="true"/>{own}'
    right = alone.replace(f'"ball">{own}', flip)
    assert not compared(tmp_path, right).record.warnings


AWAY = SCENE.replace('target="0, 0, 0"', 'target="0, -9, 3"')


@pytest.mark.guarantee("runs", "A picture in which nothing is in view is refused, unless allowed.")
def test_every_command_refuses_an_empty_picture_unless_it_is_allowed(rgb, tmp_path):
    case = case_of(tmp_path, AWAY)
    for work in (compare, measure_scene, cost, fit):
        with pytest.raises(InputError, match=r"no pixel sees a surface.*`allow_empty`"):
            work(case.source, case.options)
    case = case_of(tmp_path, AWAY, allow_empty=True)
    assert compare(case.source, case.options).record.pixels.counted == 0
    measured = measure_scene(case.source, case.options)
    assert measured.metrics(measured.halves)["dE2000"] == 0
    assert check(measured.halves, measured).moves == ()
    assert "--allow-empty" in case.command()


DARK = SCENE.replace('value="60"', 'value="1e-38"').replace(
    'value="0.2"/></emitter>', 'value="0"/></emitter>'
)


@pytest.mark.guarantee("runs", "Two black halves are an error; a black reference is named first.")
def test_black_pictures_never_pass_in_silence(rgb, tmp_path):
    case = case_of(tmp_path, DARK)
    for work in (compare, measure_scene):
        with pytest.raises(InputError, match=r"both pictures are black.*`allow_empty`"):
            work(case.source, case.options)
    case = case.changed(allow_empty=True)
    said = "Both pictures are black, so their error means nothing."
    record = compare(case.source, case.options).record
    assert record.caution == said
    assert measure_scene(case.source, case.options).caution == said
    assert said in verdict.sentence(record)


def test_doubts_about_pictures_are_told_from_their_values():
    rng = np.random.default_rng(1)
    seen, noise = np.ones((4, 5), bool), rng.uniform(0.1, 1, (4, 5, 3))
    seen[0] = False  # where all is black
    black, grey = np.zeros((4, 5, 3)), np.where(seen[..., None], (0.2, 0.3, 0.4), 0.0)

    def view(counted):
        return Halves(
            name="a",
            options=Options(),
            first=None,
            second=None,
            passes=2,
            has=frozenset({"textbook"}),
            where=counted,
        )

    def doubt(test, reference):
        return view(seen).caution(test, reference)

    assert doubt(noise, noise) == doubt(grey, noise) == doubt(black, noise) == ""
    assert doubt(noise, black).startswith("The picture to compare with is black")
    assert doubt(grey, 2 * grey).startswith("Each picture is one colour")
    assert not view(np.zeros((4, 5), bool)).caution(black, black)
    with pytest.raises(InputError, match="a: both pictures are black"):
        doubt(black, 1e-6 * noise)


def test_masks_within_masks_without_end_are_refused_in_words(rgb):
    bsdf = {"type": "diffuse"}
    for _ in range(300):
        bsdf = {"type": "mask", "opacity": 0.999, "inner": bsdf}
    scene = described(size=8, ball={"type": "sphere", "bsdf": bsdf})
    with pytest.raises(InputError, match="nested too deeply, such as masks within masks"):
        compare(Source("a test", scene), Options(**SMALL))


CORPUS = Path(__file__).parents[1] / "corpus"
POINTS, CORNERS = corpus_files.TETRAHEDRON, corpus_files.FACES
PLY = '<shape type="ply"><string name="filename" value="{}"/></shape>'


def ply(points=POINTS, corners=CORNERS, vertices=None):
    head = ["ply", "format binary_little_endian 1.0", f"element vertex {vertices or len(points)}"]
    head += [f"property float {axis}" for axis in "xyz"] + [f"element face {len(corners)}"]
    head += ["property list uchar int vertex_indices", "end_header", ""]
    faces = b"".join(struct.pack("<BIII", 3, *face) for face in corners)
    return "\n".join(head).encode() + points.tobytes() + faces


def ply_in_words(vertices=4, faces=4):
    head = ["ply", "format ascii 1.0", "comment - 1 - 2", f"element vertex {vertices}"]
    head += [f"property float {axis}" for axis in "xyz"] + [f"element face {faces}"]
    head += ["property list uchar int vertex_indices", "end_header"]
    lines = [" ".join(map(str, point)) for point in POINTS.tolist()]
    lines += [" ".join(map(str, (3, *face))) for face in CORNERS.tolist()]
    return "\n".join([*head, *lines, ""]).encode()


def with_index(index):
    corners = CORNERS.copy()
    corners[1, 1] = index
    return corners


MESHES = (
    (ply(corners=with_index(9)), "names vertex 9, and there are 4"),
    (ply(corners=with_index(10**8)), "names vertex 100000000"),
    (ply(np.where(POINTS > 0, POINTS, np.nan)), "invalid vertex"),
    (ply_in_words(vertices=10**12), "mesh.ply"),
    (ply_in_words(faces=10**12), "mesh.ply"),
    (ply()[:-9], "read"),
    (b"", "mesh.ply"),
    (np.random.default_rng(0).bytes(500), "mesh.ply"),
    (ply(vertices=10**12), "read"),
    (ply(corners=CORNERS[:0]), "mesh.ply: it has no faces, .* Write the file again"),
    (ply(POINTS[:0], CORNERS[:0]), "mesh.ply: it has no faces"),
)


def test_a_damaged_mesh_is_named_and_a_sound_one_compared(rgb, tmp_path):
    text = SCENE.replace(END, PLY.format("mesh.ply") + END)
    for content, message in MESHES:
        (tmp_path / "mesh.ply").write_bytes(content)
        with pytest.raises(InputError, match=message) as refusal:
            compared(tmp_path, text)
        assert "mesh.ply" in str(refusal.value)
    (tmp_path / "mesh.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"mesh\.obj: it has no faces"):
        compared(tmp_path, text.replace("ply", "obj"))
    for content in (ply(), ply_in_words()):
        (tmp_path / "mesh.ply").write_bytes(content)
        assert compared(tmp_path, text).record.pixels.counted


SPECTRUM = (
    '<shape type="sphere"><bsdf type="diffuse"><spectrum name="reflectance" filename="{}"/></bsdf>'
    "</shape>"
)


def test_what_a_file_holds_is_not_repeated(rgb, tmp_path):
    for content in (b"top secret\n400 1\n", bytes(range(128, 256))):
        (tmp_path / "private").write_bytes(content)
        for reader in (SPECTRUM, PLY):
            with pytest.raises(InputError, match="private") as refusal:
                compared(tmp_path, SCENE.replace(END, reader.format("private") + END))
            assert "top" not in str(refusal.value)
            assert "\ufffd" not in str(refusal.value)


def test_a_number_without_end_is_refused_in_short(rgb, tmp_path):
    digits = SCENE.replace('value="3"', f'value="{10_000 * "1"}"', 1)
    with pytest.raises(InputError, match="could not parse integer") as refusal:
        case_of(tmp_path, digits)
    assert len(str(refusal.value)) < 300


def test_a_pass_is_bounded_however_it_is_asked_for(rgb, tmp_path):
    case = case_of(tmp_path, SCENE, spp=LARGEST_SPP, resolution=(100, 80))
    with pytest.raises(InputError, match=f"{LARGEST_PASS} samples per pass"):
        measure_scene(case.source, case.options)


# A hair of a hundred segments and the sky's tables take longer than all else together.


@pytest.fixture
def corpus(tmp_path):
    mi.set_variant("llvm_ad_rgb")
    level = mi.log_level()
    mi.set_log_level(mi.LogLevel.Error)
    corpus_files.write(tmp_path)
    yield tmp_path
    mi.set_log_level(level)


NUMBER = re.compile(r"(?<![\w.$])[-+]?\d+\.?\d*(?:e[-+]?\d+)?(?![\w.])")
VALUE = re.compile(r'\b(?:value|x|y|z|origin|target|up|matrix|angle)="([^"]*)"')
VALUES = ("nan", "inf", "-inf", "0", "-1", "1e308", "-1e308", "1e38", "1e-40", "-0.0", "1e19", "2")
WORDS = ("", "abc", "true", "$", "\u00e9", "1,2", "0 0 0", "99999999999999999999")
SLOW = ("bsdf-hair", "emitter-sunsky", "emitter-timed-sunsky", "medium-", "integrator-volpath")


def broken(seed, folder):
    """Return a scene of the corpus with one thing broken: a number, a word, an element, a file."""
    draw = np.random.default_rng(seed)
    names = sorted(p.stem for p in CORPUS.glob("*.xml") if not p.stem.startswith(SLOW))
    text = (CORPUS / f"{draw.choice(names)}.xml").read_text(encoding="utf-8")
    numbers = [
        found.span()
        for value in VALUE.finditer(text)
        for found in NUMBER.finditer(text, value.start(1), value.end(1))
    ]
    words = [m.span(1) for m in re.finditer(r'\b(?!version)\w+="([^"]*)"', text)]
    elements = [m.span() for m in re.finditer(r"<(\w+)[^<>]*/>", text)]
    named = [
        m.span(1) for m in re.finditer(r'value="([\w-]+\.\w+)"', text) if (folder / m[1]).exists()
    ]
    kind = draw.integers(6)
    places = (numbers, numbers, numbers, words, elements, named or words)[kind] or words
    begin, end = places[draw.integers(len(places))]
    if places is named:
        new = f"{seed}-{text[begin:end]}"
        (folder / new).write_bytes(damaged(draw, (folder / text[begin:end]).read_bytes()))
    else:
        new = "" if places is elements else str(draw.choice(VALUES if places is numbers else WORDS))
    return text[:begin] + new + text[end:]


def damaged(draw, content):
    """Cut a file, change three bytes of it, or return noise."""
    how, content = draw.integers(3), bytearray(content)
    if how == 0:
        return content[: draw.integers(len(content))]
    for place in draw.integers(len(content), size=3):
        content[place] = draw.integers(256)
    return content if how == 1 else draw.bytes(200)


def outcome(seed, folder):
    """Compare a broken scene: finite pictures of something, or a message."""
    mi.set_variant("llvm_ad_rgb")
    path = folder / f"{seed}.xml"
    path.write_text(broken(seed, folder), encoding="utf-8")
    try:
        case = open_case(path, Options(spp=4, resolution=(16, 12)))
        made = compare(case.source, case.options)
    except FotismosError as error:
        return "refused" if str(error).strip() else "no message"
    except Exception as error:
        return f"{seed}: {type(error).__name__}: {error}"
    images = made.images
    is_sound = np.isfinite(images.heuristic).all() and np.isfinite(images.reference).all()
    return "rendered" if is_sound and made.record.pixels.counted else f"{seed}: not a picture"


@pytest.mark.thorough
def test_a_scene_broken_at_random_is_rendered_or_refused(rgb, corpus):
    assert {outcome(seed, corpus) for seed in range(8)} == {"rendered", "refused"}


@pytest.mark.slow
def test_any_scene_broken_at_random_is(rgb, corpus):
    assert {outcome(seed, corpus) for seed in range(20, 400)} == {"rendered", "refused"}


@pytest.mark.parametrize("device", ["pipe", "/dev/zero"])
@pytest.mark.parametrize("where", ["include", "nested", "mesh", "bitmap", "placeholder", "table"])
def test_a_pipe_or_a_device_that_a_scene_names_is_refused_at_once(rgb, tmp_path, where, device):
    """Reading it might never end."""
    os.mkfifo(tmp_path / "pipe")
    table = '<bsdf type="diffuse"><spectrum name="reflectance" filename="{}"/></bsdf>'
    text = {
        "include": '<include filename="{}"/>',
        "nested": '<include filename="part.xml"/>',
        "mesh": '<shape type="ply"><string name="filename" value="{}"/></shape>',
        "bitmap": '<texture type="bitmap" id="t"><string name="filename" value="{}"/></texture>',
        "placeholder": '<include filename="$part"/>',
        "table": f'<shape type="sphere">{table}</shape>',
    }[where].format(device)
    part = f'<scene version="3.0.0"><include filename="{device}"/></scene>'
    (tmp_path / "part.xml").write_text(part)
    define = {"part": device} if where == "placeholder" else {}
    with pytest.raises(InputError, match=f"{device} is not a regular file"):
        compared(tmp_path, SCENE.replace(END, f"{text}{END}"), define=define)


def test_a_pipe_that_a_dictionary_names_is_refused_at_once(rgb, tmp_path):
    os.mkfifo(tmp_path / "pipe")
    mesh = {"type": "obj", "filename": str(tmp_path / "pipe")}
    with pytest.raises(InputError, match="pipe is not a regular file"):
        compare(Source("odd", {"type": "scene", "mesh": mesh}))


def test_a_study_in_a_pipe_is_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match="pipe: it is not a regular file"):
        design.read(tmp_path / "pipe")


def test_what_is_called_dark_is_as_near_to_black_as_may_pass():
    distance = leading_distance(DEFAULT_VIEWING)(np.full((1, 3), criterion.DARK), np.zeros((1, 3)))
    assert distance[0] == pytest.approx(TOLERANCE, rel=0.06)


@pytest.mark.parametrize(
    ("lit", "level", "exposure", "is_doubtful"),
    [
        (24, 1.0, 1.0, True),
        (50, 1.0, 1.0, True),
        (51, 1.0, 1.0, False),
        (1000, 0.003, 1.0, True),
        (1000, 0.003, 10.0, False),
        (24, 1e4, 1.0, True),
    ],
)
def test_a_picture_that_shows_almost_nothing_is_in_doubt(lit, level, exposure, is_doubtful):
    """Of 1,000 pixels so many are lit; up to 5 % may differ, so that these would pass alone."""
    light = np.zeros((1000, 3))
    light[:lit] = level * np.random.default_rng(0).uniform(0.9, 1, (lit, 3))

    def doubt(test, reference):
        return caution(
            test, reference, name="a", allow_empty=False, is_picture=True, exposure=exposure
        )

    assert ("Both pictures are nearly black" in doubt(light, 0.9 * light)) == is_doubtful
    assert doubt(light, np.random.default_rng(1).uniform(0.1, 1, light.shape)) == ""


WALL = """<shape type="rectangle"><transform name="to_world"><scale x="0.5"/>
<lookat origin="0, -4, 1.6" target="0, -3, 1.2" up="0, 0, 1"/><translate x="-0.14"/>
</transform></shape>"""
"""A wall whose back, which both halves show black, hides all but the right border of the view."""


@pytest.mark.guarantee("runs", "A verdict on a picture that shows almost nothing says so first.")
def test_a_room_from_behind_its_wall_does_not_look_right_in_silence(rgb, tmp_path):
    case = case_of(tmp_path, SCENE.replace(END, WALL + END), resolution=(40, 30))
    record = compare(case.source, case.options).record
    assert verdict.decision(record) == "undecided"
    assert "Both pictures are nearly black: " in verdict.headline([record])
    assert "looks right in 0 of 2 scenes; 2 are in doubt." in verdict.headline([record, record])
    assert all(record.caution in line for line in verdict.advice([(record, None)] * 2))
