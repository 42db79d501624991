"""What a command takes from a scene file: values for its placeholders, and one of its sensors."""

import json
import re

import mitsuba as mi
import numpy as np
import pytest

from fotismos.comparisons.options import Options
from fotismos.heuristic.errors import InputError
from fotismos.heuristic.lights import PointLight
from fotismos.heuristic.materials import Material
from fotismos.reference import Source
from fotismos.reference.pairing import halves
from fotismos.reference.pairing.settings import keep_sensor
from fotismos.reference.scene.source import digest
from tests.shared.misplanned import scene as described
from tests.shared.small_scene import PLAIN

BALL = '<bsdf type="diffuse"><rgb name="reflectance" value="$grey"/></bsdf>'
GREY = PLAIN.replace('<bsdf type="diffuse"/>', BALL, 1)
SECOND = PLAIN[PLAIN.index("<sensor") : PLAIN.index("</sensor>") + len("</sensor>")]
SMALL = ("--resolution", "16x16", "--spp", 4)


@pytest.fixture
def scene(tmp_path):
    """A file with a placeholder, and a second sensor whose film is 40 by 20 pixels."""
    assert "$grey" in GREY
    second = SECOND.replace('value="24"', 'value="40"').replace('value="16"', 'value="20"')
    path = tmp_path / "grey.xml"
    path.write_text(GREY.replace("</scene>", f"{second}</scene>"), encoding="utf-8")
    return path


def test_what_a_scene_does_not_have_is_refused_by_name(run, scene, tmp_path):
    out, grey, gray = ("-o", tmp_path / "out"), ("-D", "grey=0.5"), ("-D", "gray=0.2")
    hint = "-D gray: grey has no such placeholder (did you mean grey?); it has grey."
    for command, words, message in (
        ("compare", out, "grey"),
        ("compare", (*grey, *gray, *out), hint),
        ("plan", (*grey, *gray), hint),
        ("compare", (*grey, "--sensor", 2, *out), "no sensor 2: choose one from 0 to 1"),
    ):
        code, _, messages = run(command, scene, *words, *SMALL)
        assert code == 2
        assert message in messages.replace("grey.xml", "")


@pytest.mark.thorough
def test_a_value_and_a_sensor_are_used_and_recorded(run, scene, tmp_path):
    records = {}
    for value, sensor in (("0.2", 0), ("0.6", 0), ("0.6", 1)):
        out = tmp_path / f"{value}-{sensor}"
        words = ("-D", f"grey={value}", "--sensor", sensor, "--spp", 4, "-o", out)
        size = () if sensor else ("--resolution", "16x16")
        assert run("compare", scene, *words, *size)[0] == 0
        record = json.loads((out / "grey/comparison.json").read_text(encoding="utf-8"))
        assert f"-D grey={value}" in record["command"]
        records[value, sensor] = record
    means = [records[value, 0]["metrics"]["dE2000"]["mean"] for value in ("0.2", "0.6")]
    assert means[0] != means[1]
    assert records["0.6", 1]["resolution"] == [40, 20]


def test_all_files_that_are_missing_are_named_as_written(rgb, tmp_path):
    names = ("tex/wood.png", "meshes/cow.obj", "sky.exr")
    picture = '<texture type="bitmap" name="reflectance"><string name="filename" value="{}"/>'
    shapes = '<shape type="obj"><string name="filename" value="{}"/></shape>'
    sky = '<emitter type="envmap"><string name="filename" value="{}"/></emitter>'
    wooden = f'<bsdf type="diffuse">{picture.format(names[0])}</texture></bsdf>'
    text = PLAIN.replace('<bsdf type="diffuse"/>', wooden, 1)
    more = shapes.format(names[1]) + sky.format(names[2])
    path = tmp_path / "bare.xml"
    path.write_text(text.replace("</scene>", f"{more}</scene>"), encoding="utf-8")
    with pytest.raises(InputError, match=r"^bare: 3 files are missing: ") as refusal:
        halves.pair(Source("bare", path))
    assert all(f"{name} (" in str(refusal.value) for name in names)


def test_placeholders_without_a_value_are_all_named(rgb, tmp_path):
    text = GREY.replace("<scene", '<scene width="$width"', 1).replace('"2"', '"$depth"', 1)
    text = text.replace('value="24"', 'value="$width"').replace(' width="$width"', "", 1)
    text = text.replace("<integrator", '<default name="depth" value="2"/><integrator', 1)
    path = tmp_path / "grey.xml"
    path.write_text(text, encoding="utf-8")
    words = r"^grey: \$grey, \$width without a value: give -D grey=VALUE -D width=VALUE\.$"
    with pytest.raises(InputError, match=words):
        Source("grey", path).parse()


@pytest.mark.parametrize("length", [len(PLAIN) // 2, PLAIN.index("</scene>"), len("<scene ")])
def test_a_file_that_is_cut_off_is_called_that(rgb, tmp_path, length):
    path = tmp_path / "cut.xml"
    path.write_text(PLAIN[:length], encoding="utf-8")
    with pytest.raises(InputError, match=r"cut\.xml ends before its last element is closed"):
        Source("cut", path).parse()


def test_a_whole_file_with_a_wrong_tag_is_not_called_cut_off(rgb, tmp_path):
    path = tmp_path / "wrong.xml"
    path.write_text(PLAIN.replace("</sensor>", "</senser>"), encoding="utf-8")
    with pytest.raises(InputError, match="tags mismatch"):
        Source("wrong", path).parse()


def test_the_only_sensor_is_called_that(rgb):
    with pytest.raises(InputError, match=r"no sensor 3: the scene has one, number 0\. Omit"):
        keep_sensor(Source("a test", described(size=8)).parse(), 3)


@pytest.mark.parametrize("variant", ["cuda_ad_rgb", "scalar_rgb"])
def test_variants_that_llvm_does_not_render_are_explained(run, variant):
    said = "Only LLVM renders here, on the processor"
    with pytest.raises(InputError, match=said):
        Options.of({"variant": variant})
    assert said in " ".join(run("plan", "fig-8-9", "--variant", variant)[2].split())


@pytest.mark.parametrize(
    ("call", "near"),
    [
        (lambda: Options.of({"resolutoin": (8, 8)}), "resolution"),
        (lambda: Material(kd=0.5), "k_d"),
        (lambda: PointLight((0, 0, 1), 1.0, intensty=2), "intensity"),
    ],
)
def test_a_misspelt_keyword_gets_a_suggestion(call, near):
    with pytest.raises(InputError, match=rf"is not known \(did you mean {near}\?\)"):
        call()


SPECTRAL_FILM = """<film type="specfilm">
  <integer name="width" value="24"/><integer name="height" value="16"/>
  <integer name="crop_offset_x" value="3"/><integer name="crop_width" value="8"/>
  <rfilter type="tent"><float name="radius" value="1.5"/></rfilter>{bands}
</film>"""
BANDS = '<spectrum name="band" value="400:0, 500:1, 600:0"/>'


def test_another_film_keeps_its_size_its_crop_and_its_filter(rgb, tmp_path):
    """A film of bands becomes one of colours, and the record says so."""
    made = {}
    for kind, text in {
        "specfilm": SPECTRAL_FILM.format(bands=BANDS),
        "hdrfilm": SPECTRAL_FILM.format(bands="").replace("specfilm", "hdrfilm"),
    }.items():
        path = tmp_path / f"{kind}.xml"
        path.write_text(re.sub("<film.*?</film>", text, PLAIN, flags=re.DOTALL), encoding="utf-8")
        made[kind] = halves.pair(Source("a test", path))
    films = [each.physical.instantiate().sensors()[0].film() for each in made.values()]
    assert [str(film) for film in films] == 2 * [str(films[1])]
    assert (*films[0].crop_size(), *films[0].crop_offset()) == (8, 16, 3, 0)
    assert films[0].rfilter().radius() == 1.5
    told = {kind: [each.what for each in one.overridden] for kind, one in made.items()}
    assert told == {"specfilm": ["film"], "hdrfilm": []}


ORANGE = np.tile(np.float32([0.8, 0.3, 0.1]), (4, 4, 1))
LAMP = {"type": "point", "position": [1, -4, 3], "intensity": 30.0}
LAMP_ABOVE = {"type": "rectangle", "to_world": mi.ScalarTransform4f().translate([0, 0, 2])}
LAMP_ABOVE["to_world"] = LAMP_ABOVE["to_world"] @ mi.ScalarTransform4f().rotate([1, 0, 0], 180)
WITH_PICTURES = {
    "reflectance": lambda picture: {"ball": ball(picture), "lamp": LAMP},
    "two shapes": lambda picture: {
        "ball": ball(picture),
        "other": ball(picture) | {"center": [2, 0, 0]},
        "lamp": LAMP,
    },
    "base colour": lambda picture: {
        "ball": {"type": "sphere", "bsdf": {"type": "principled", "base_color": picture}},
        "lamp": LAMP,
    },
    "area": lambda picture: {
        "ball": {"type": "sphere"},
        "lamp": LAMP_ABOVE | {"light": {"type": "area", "radiance": picture}},
    },
    "projector": lambda picture: {
        "ball": {"type": "sphere"},
        "lamp": {
            "type": "projector",
            "irradiance": picture,
            "to_world": mi.ScalarTransform4f().look_at([0, -4, 1], [0, 0, 0], [0, 0, 1]),
        },
    },
}
"""Places of a picture in a scene whose colours a load in a spectral variant turns into spectra."""


def ball(picture):
    return {"type": "sphere", "bsdf": {"type": "diffuse", "reflectance": picture}}


@pytest.mark.parametrize("place", WITH_PICTURES)
def test_a_load_changes_nothing_that_the_scene_holds(spectral, tmp_path, place):
    """Each load is as from a file; ``mitsuba.load_dict`` overwrites such a bitmap."""
    made = WITH_PICTURES[place]
    bitmap = mi.Bitmap(ORANGE.copy())
    bitmap.write(str(tmp_path / "orange.exr"))

    def rendered(**picture):
        parts = made({"type": "bitmap", **picture})
        source = Source("a test", described((0, -4, 1), size=8, **parts))
        before = digest(source)
        scenes = [source.parse().instantiate() for _ in range(2)]
        assert digest(source) == before
        return [np.array(mi.render(scene, spp=16, seed=1)) for scene in scenes]

    in_file, _ = rendered(filename=str(tmp_path / "orange.exr"))
    assert in_file.mean() > 1e-3
    for image in rendered(bitmap=bitmap):
        np.testing.assert_allclose(image, in_file, atol=1e-6)
    np.testing.assert_array_equal(np.array(bitmap), ORANGE)


@pytest.mark.parametrize("key", ["bsdf", "film", "lamp"])
def test_what_is_already_made_is_refused_by_name(rgb, key):
    """Before, a default took the place of a BSDF, an integrator and a film."""
    scene = described((0, -4, 1), size=8, ball=ball(0.5), lamp=LAMP)
    holder = {"bsdf": scene["ball"], "film": scene["sensor"], "lamp": scene}[key]
    holder[key] = mi.load_dict(holder[key])
    with pytest.raises(InputError, match=f"{key} is an object .* Give the dictionary"):
        Source("a test", scene).parse()
