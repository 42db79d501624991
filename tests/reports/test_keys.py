"""The key of a result covers every file that was read for it."""

import mitsuba as mi
import numpy as np
import pytest

from fotismos.reference.rendering.renderer import Renderer
from fotismos.reference.scene.source import Source, digest

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


@pytest.mark.parametrize(
    ("kind", "place"),
    [
        *((kind, "own") for kind in KINDS),
        *(("texture", place) for place in PLACES if place != "own"),
    ],
)
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


@pytest.mark.thorough
@pytest.mark.guarantee(
    "runs", "A finished scene is rendered again once a file that Mitsuba read changes."
)
def test_a_finished_scene_is_rendered_again_once_a_file_changes(run, folder):
    name, write, element = KINDS["texture"]
    scene, texture = folder / "scene/s.xml", file_in("current", name, folder)
    write(texture, 0.2)
    scene.write_text(SCENE % ("", element % name))
    words = ("compare", scene, "--spp", 4, "-o", folder / "out")
    result = folder / "out/s/comparison.json"

    def written():
        before = result.stat().st_mtime_ns if result.exists() else None
        assert run(*words)[0] == 0
        return result.stat().st_mtime_ns != before

    assert [written(), written()] == [True, False]
    write(texture, 0.9)
    assert written()
