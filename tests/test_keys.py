"""The key of a result covers every file that was read for it."""

import os

import mitsuba as mi
import numpy as np
import pytest

from reference.rendering.renderer import Renderer
from reference.scene.identity import digest
from reference.scene.script import Script
from reference.scene.source import Source

SCENE = """<scene version="3.0.0">
  %s
  <integrator type="direct"/>
  <sensor type="perspective">
    <transform name="to_world">
      <lookat origin="0, 0, 4" target="0, 0, 0" up="0, 1, 0"/>
    </transform>
    <film type="hdrfilm">
      <integer name="width" value="8"/><integer name="height" value="8"/>
    </film>
  </sensor>
  <emitter type="constant"/>
  %s
</scene>
"""
BALL = '<shape type="sphere"><bsdf type="diffuse">%s</bsdf></shape>'
NAMED = '<string name="filename" value="%s"/>'


def picture(path, value):
    mi.Bitmap(np.full((4, 4, 3), value, np.float32)).write(str(path))


def mesh(path, value):
    size = 1 + value
    corners = ((-size, -size), (size, -size), (size, size), (-size, size))
    lines = [f"v {x} {y} 0" for x, y in corners]
    path.write_text("\n".join([*lines, "f 1 2 3", "f 1 3 4", ""]))


def spectrum(path, value):
    path.write_text(f"400 {value}\n500 0.3\n700 {value}\n")


def volume(path, value):
    mi.VolumeGrid(np.full((2, 2, 2, 1), value, np.float32)).write(str(path))


def part(path, value):
    path.write_text(
        f'<scene version="3.0.0">{BALL}</scene>' % f'<rgb name="reflectance" value="{value}"/>'
    )


TEXTURE = f'<texture type="bitmap" name="reflectance">{NAMED}</texture>'
MEDIUM = (
    '<shape type="cube"><bsdf type="null"/><medium type="heterogeneous" name="interior">'
    f'<volume type="gridvolume" name="sigma_t">{NAMED}</volume></medium></shape>'
)
KINDS = {
    "texture": ("t.exr", picture, BALL % TEXTURE),
    "mesh": ("m.obj", mesh, f'<shape type="obj">{NAMED}</shape>'),
    "spectrum": ("s.spd", spectrum, BALL % '<spectrum name="reflectance" filename="%s"/>'),
    "volume": ("v.vol", volume, MEDIUM),
    "included": ("i.xml", part, '<include filename="%s"/>'),
}
PLACES = {"own": "", "inner": "inner/", "current": "", "path": ""}


def file_in(place, name, folder):
    """Return where a file lies in a place of `PLACES`."""
    return {
        "own": folder / "scene",
        "inner": folder / "scene/inner",
        "current": folder / "current",
        "path": folder / "elsewhere",
    }[place] / name


@pytest.fixture
def folder(tmp_path, monkeypatch, rgb):
    """Folders in which Mitsuba looks for files, begun in the current one."""
    for name in ("scene/inner", "current", "elsewhere"):
        (tmp_path / name).mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "current")
    before = mi.file_resolver()
    mi.set_file_resolver(mi.FileResolver(before))
    yield tmp_path
    mi.set_file_resolver(before)


def image(source):
    graph = source.parse()
    integrator = mi.load_dict({"type": "volpath"})
    return np.array(Renderer(graph.instantiate(), integrator, 4, "test").render(0))


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("kind", KINDS)
def test_a_file_that_changes_changes_image_and_key(kind, place, folder):
    name, write, element = KINDS[kind]
    scene, file = folder / "scene/s.xml", file_in(place, name, folder)
    path = '<path value="../elsewhere"/>' if place == "path" else ""
    scene.write_text(SCENE % (path, element % (PLACES[place] + name)))
    seen = []
    for value in (0.2, 0.2, 0.9):
        write(file, value)
        source = Source("s", scene)
        seen.append((digest(source), image(source)))
    (first, before), (same, _), (second, after) = seen
    assert np.abs(after - before).max() > 0.01, "Mitsuba reads the file"
    assert first == same
    assert first != second


def test_the_nearest_file_counts(folder):
    name, write, element = KINDS["texture"]
    scene = folder / "scene/s.xml"
    scene.write_text(SCENE % ("", element % name))
    keys = []
    for place in ("current", "own"):
        write(file_in(place, name, folder), 0.2 if place == "current" else 0.9)
        source = Source("s", scene)
        keys.append(digest(source))
        assert file_in(place, name, folder).resolve() in source.files()
    assert keys[0] != keys[1]


def test_a_place_that_one_scene_adds_is_not_searched_for_the_next(folder):
    name, write, element = KINDS["texture"]
    write(file_in("path", name, folder), 0.5)
    files = []
    for path in ('<path value="../elsewhere"/>', ""):
        scene = folder / "scene/s.xml"
        scene.write_text(SCENE % (path, element % name))
        files.append({file.name for file in Source("s", scene).files()})
    assert files == [{"s.xml", name}, {"s.xml"}]


def test_values_count_to_the_last_digit(folder):
    scene = folder / "s.xml"
    scene.write_text(SCENE % ("", BALL % '<rgb name="reflectance" value="$grey"/>'))
    keys = {digest(Source("s", scene, {"grey": grey})) for grey in ("0.5", "0.50000001")}
    assert len(keys) == 2
    keys = {digest(Source("s", {"type": "scene", "f": f})) for f in map(frame, (1.0, 1.0000001))}
    assert len(keys) == 2


def frame(size):
    return {"type": "rectangle", "to_world": mi.ScalarTransform4f().scale(size)}


PYTHON = """
import json
from pathlib import Path

GREY = json.loads(Path("grey.json").read_text())
scene = {
    "type": "scene",
    "sensor": {"type": "perspective", "film": {"type": "hdrfilm", "width": 8, "height": 8}},
    "ball": {"type": "sphere", "center": [0, 0, 4],
             "bsdf": {"type": "diffuse", "reflectance": {"type": "bitmap", "filename": "t.exr"}}},
    "lamp": {"type": "constant", "radiance": GREY},
}
"""


@pytest.mark.guarantee(
    "runs",
    "A finished scene is rendered again once a file changes that Mitsuba or the scene's script"
    " read for it, wherever it was found.",
)
@pytest.mark.parametrize("suffix", [".xml", ".py"])
def test_a_finished_scene_is_rendered_again_once_a_file_changes(suffix, run, folder):
    name, write, element = KINDS["texture"]
    scene, texture = folder / f"scene/s{suffix}", file_in("current", name, folder)
    grey = folder / "current/grey.json"
    grey.write_text("0.5")
    write(texture, 0.2)
    scene.write_text(PYTHON if suffix == ".py" else SCENE % ("", element % name))
    words = ("compare", scene, "--spp", 4, "-o", folder / "out")
    result = folder / "out/s/comparison.json"

    def written():
        before = result.stat().st_mtime_ns if result.exists() else None
        assert run(*words)[0] == 0
        return result.stat().st_mtime_ns != before

    assert [written(), written()] == [True, False]
    write(texture, 0.9)
    assert [written(), written()] == [True, False]
    if suffix == ".py":
        grey.write_text("0.50000001")
        assert [written(), written()] == [True, False]


# --- Scripts ---------------------------------------------------------------------------------

WORDS = """
import json
import os
import sys
from pathlib import Path

import first
from inside import second

here = Path(__file__).parent
sys.path.append(str(here / "library"))
import third

json.loads((here / "words.json").read_text())
os.close(os.open(here / "low.bin", os.O_RDONLY))
with (here / "written.log").open("a") as log:
    log.write("ran")
temporary = here / "temporary"
temporary.write_text("a")
temporary.read_text()
temporary.unlink()
Path("/proc/self/stat").read_text()


def scene():
    (here / "late.txt").read_bytes()
    return {"type": "scene", "ball": {"type": "sphere"}}
"""
READ = {
    "s.py": WORDS,
    "first.py": "import fourth",
    "fourth.py": "",
    "inside/second.py": "",
    "inside/__init__.py": "",
    "library/third.py": "",
    "words.json": "[1]",
    "low.bin": "low",
    "late.txt": "late",
}
"""Content of the files that the script reads, by name."""


@pytest.fixture
def script(folder):
    """A script that reads files in all the ways that are noted."""
    place = folder / "scene"
    for name, content in READ.items():
        (place / name).parent.mkdir(exist_ok=True)
        (place / name).write_text(content)
    return place / "s.py"


def read_by(path):
    source = Source("s", Script(path))
    return digest(source), source.files()


@pytest.mark.parametrize("how", ["source", "compiled"])
def test_what_a_script_reads_is_known_whether_or_not_it_is_compiled(how, script, monkeypatch):
    monkeypatch.setattr("sys.dont_write_bytecode", how == "source")
    for _ in range(2):
        _, files = read_by(script)
    assert bool(list(script.parent.glob("__pycache__/first.*.pyc"))) == (how == "compiled")
    assert set(files) == {script.parent / name for name in READ}


@pytest.mark.parametrize("name", READ)
def test_a_file_that_a_script_reads_changes_the_key(name, script, monkeypatch):
    monkeypatch.setattr("sys.dont_write_bytecode", False)
    file = script.parent / name
    before, _ = read_by(script)
    assert read_by(script)[0] == before
    file.write_text(file.read_text() + "  ")
    later = file.stat().st_mtime + 2  # compiled code is told by the time of its source
    os.utime(file, (later, later))
    assert read_by(script)[0] != before


def test_two_scripts_have_modules_of_one_name(folder):
    colours = []
    for name, colour in (("a", 0.1), ("b", 0.7)):
        (folder / name).mkdir()
        (folder / name / "colours.py").write_text(f"GREY = {colour}\n")
        (folder / name / "s.py").write_text(
            "import colours\nscene = {'type': 'scene', 'grey': colours.GREY}\n"
        )
        colours.append(Script(folder / name / "s.py")()["grey"])
    assert colours == [0.1, 0.7]


def test_what_a_script_opens_after_it_failed_or_another_opens_is_not_its_own(script, tmp_path):
    _, files = read_by(script)
    other = tmp_path / "other.txt"
    other.write_text("")
    other.read_text()
    script.write_text("raise ValueError")
    with pytest.raises(Exception, match="ValueError"):
        Script(script)()
    other.read_text()
    script.write_text(WORDS)
    assert read_by(script)[1] == files


MADE = """
import mitsuba as mi
import numpy as np

corners = np.fromfile(%r)
shape = mi.Mesh("made", 3, 1)
parameters = mi.traverse(shape)
parameters["vertex_positions"] = corners
parameters["faces"] = [0, 1, 2]
parameters.update()
ply = mi.load_dict({"type": "ply", "filename": %r})
picture = mi.load_dict({"type": "bitmap", "filename": %r, "raw": True})
scene = {"type": "scene", "made": shape, "ply": ply,
         "ball": {"type": "sphere", "bsdf": {"type": "diffuse", "reflectance": picture}}}
"""


def test_files_that_native_code_reads_for_a_script_count_by_what_is_made_of_them(folder):
    names = [str(folder / name) for name in ("corners.bin", "m.ply", "t.exr")]
    (folder / "s.py").write_text(MADE % tuple(names))

    def write(at, value):
        if at in (0, None):
            np.array([0, 0, 0, value, 0, 0, 0, 1, 0], float).tofile(names[0])
        if at in (1, None):
            # A corner moves inside the bounding box, which is what Mitsuba prints of a mesh.
            made = mi.Mesh("m", 4, 2)
            parameters = mi.traverse(made)
            parameters["vertex_positions"] = [0, 0, 0, 1, 0, 0, 0, 1, 0, value / 4, 0.2, 0]
            parameters["faces"] = [0, 1, 3, 0, 3, 2]
            parameters.update()
            made.write_ply(names[1])
        if at in (2, None):
            grey = np.full((4, 4, 3), 0.5, np.float32)
            grey[0], grey[1] = value, 1 - value  # of one mean
            mi.Bitmap(grey).write(names[2])

    write(None, 1.0)
    keys = [read_by(folder / "s.py")[0]]
    assert read_by(folder / "s.py")[0] == keys[0]
    for at in range(3):
        write(at, 0.5)
        keys.append(read_by(folder / "s.py")[0])
    assert len(set(keys)) == len(keys)
