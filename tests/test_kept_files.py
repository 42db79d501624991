"""Kept results that somebody damaged are computed again; nothing crashes, waits or is wrong."""

import io
import json
import os
import random
import zipfile
from hashlib import sha256
from types import SimpleNamespace

import mitsuba as mi
import numpy as np
import pytest

from comparisons import render
from comparisons.store import Entry
from comparisons.study import dataset, design, point, running
from heuristic.errors import InputError
from reference.rendering.moments import DifferenceSums
from reference.rendering.sums import Accumulator, Mean
from reports.run import finished
from reports.run.kept import KeptPasses
from tests.small_scene import SCENE

CONTENT = {
    "r.json": {"rows": [{"a": 1, "b": 2.5, "c": None, "d": "ü"}]},
    "r.npz": {"sum": np.arange(6.0).reshape(2, 3), "count": np.array(3), "none": np.zeros((2, 0))},
}


def damaged(content, rng):
    """Return bytes of which something is cut, flipped, doubled or left out."""
    begin, end = sorted(rng.randrange(len(content) + 1) for _ in range(2))
    flipped = bytearray(content)
    flipped[rng.randrange(len(flipped))] ^= 1 << rng.randrange(8)
    return rng.choice(
        [
            content[:end],
            content[begin:],
            content[:begin] + content[end:],
            content[:end] + content[begin:],
            bytes(flipped),
            rng.randbytes(len(content)),
        ]
    )


def equal(found, content):
    return found.keys() == content.keys() and all(
        np.array_equal(found[name], value) and np.shape(found[name]) == np.shape(value)
        for name, value in content.items()
    )


@pytest.mark.parametrize(
    "count", [500, pytest.param(50_000, marks=pytest.mark.slow)], ids=["short", "long"]
)
@pytest.mark.parametrize("name", CONTENT)
def test_a_damaged_file_is_no_result_or_the_same(name, count, tmp_path):
    entry = Entry(tmp_path / name, "key")
    entry.save(CONTENT[name])
    whole, refused = entry.path.read_bytes(), 0
    for seed in range(count):
        entry.path.write_bytes(damaged(whole, random.Random(seed)))
        found = entry.load()
        refused += found is None
        assert found is None or equal(found, CONTENT[name]), seed
    assert refused > 0.8 * count


def put(kind, path):
    """Put something that is not a file into a place."""
    if kind == "folder":
        path.mkdir()
        (path / "mine.txt").write_text("mine")
    elif kind == "fifo":
        os.mkfifo(path)
    else:
        path.symlink_to(path.name)


@pytest.mark.parametrize("name", CONTENT)
@pytest.mark.parametrize("kind", ["folder", "fifo", "loop"])
def test_what_is_not_a_file_is_no_result_and_stays(kind, name, tmp_path):
    entry = Entry(tmp_path / name, "key")
    put(kind, entry.path)
    before = entry.path.lstat()
    assert entry.load() is None
    if kind != "loop":  # a link that leads nowhere is replaced
        with pytest.raises(InputError, match=r"not a regular file.* -o"):
            entry.save(CONTENT[name])
    entry.remove()
    assert entry.path.lstat() == before


def archive(arrays, compression=zipfile.ZIP_STORED):
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w", compression) as file:
        for name, content in arrays.items():
            file.writestr(f"{name}.npy", content)
    return made.getvalue()


def array_file(value, **header):
    """Return an array in NumPy's format, with another header where that is given."""
    made = io.BytesIO()
    np.lib.format.write_array(made, np.asanyarray(value))
    if not header:
        return made.getvalue()
    other = io.BytesIO()
    told = {"descr": "<f8", "fortran_order": False, "shape": (1,)} | header
    np.lib.format.write_array_header_1_0(other, told)
    return other.getvalue() + np.asanyarray(value).tobytes()


KEY = array_file("key")
ARCHIVES = {
    "bomb": archive({"key": KEY, "a": array_file(np.zeros(10**6))}, zipfile.ZIP_DEFLATED),
    "header": archive({"key": KEY, "a": array_file(np.zeros(2), shape=(10**15,))}),
    "negative": archive({"key": KEY, "a": array_file(np.zeros(2), shape=(-1, -2))}),
    "objects": archive({"key": KEY, "a": array_file(np.zeros(2), descr="|O", shape=(2,))}),
    "no key": archive({"a": array_file(np.zeros(2))}),
    "no array": archive({"key": KEY, "a": b"nothing"}),
}


@pytest.mark.parametrize("kind", ARCHIVES)
def test_arrays_that_are_not_what_they_say_are_no_result(kind, tmp_path):
    (tmp_path / "r.npz").write_bytes(ARCHIVES[kind])
    assert Entry(tmp_path / "r.npz", "key").load() is None


# --- Passes ----------------------------------------------------------------------------------

SIZE = (6, 5)


def sums():
    return [Mean(), Accumulator(), DifferenceSums(np.ones(SIZE, bool))]


def halves():
    return [SimpleNamespace(times=[0.1, 0.2], compilation=0.5) for _ in range(2)]


@pytest.fixture
def state(rgb):
    """The state of three sums after two passes."""
    made = sums()
    for number in range(2):
        for total in made:
            total.add(mi.TensorXf(np.full((*SIZE, 3), number, np.float32)))
    return render._state(made, halves())


def replaced(value, rng):
    """Return another array than one that a state holds."""
    return rng.choice(
        [
            value[..., None],
            np.full(value.shape, np.nan),
            np.full(value.shape, np.inf),
            np.zeros((3, *value.shape[1:])) if value.shape else np.zeros(2),
            value.astype(np.float32),
            value.astype(str),
            value.astype(complex),
            np.zeros(value.shape, "M8[s]"),
            np.array(-1),
            np.array(10**9),
            np.zeros(value.shape, [("a", float)]),
        ]
    )


def test_a_state_of_other_arrays_is_not_taken_up(state):
    assert render._fits(state, sums(), halves(), SIZE, 2)
    assert not render._fits(state, sums(), halves(), SIZE, 1)
    assert not render._fits(state, sums(), halves(), SIZE[::-1], 2)
    assert not render._fits({}, sums(), halves(), SIZE, 2)
    for seed in range(400):
        rng = random.Random(seed)
        name = rng.choice(sorted(state))
        other = dict(state)
        del other[name]
        if rng.random() < 0.8:
            other[name] = replaced(state[name], rng)
        assert not render._fits(other, sums(), halves(), SIZE, 2), (seed, name)


def test_passes_that_do_not_fit_are_rendered_again(run, tmp_path, monkeypatch):
    from comparisons.case import Request, open_case
    from reports.run import kept

    # With a wider filter, samples are added up in the order in which threads get there.
    box = '<film type="hdrfilm"><rfilter type="box"/>'
    (tmp_path / "s.xml").write_text(SCENE.replace('<film type="hdrfilm">', box))
    words = ("compare", tmp_path / "s.xml", "--spp", 8, "--resolution", "12x8", "--fresh", "-o")
    assert run(*words, tmp_path / "undisturbed")[0] == 0
    whole = record(tmp_path / "undisturbed")
    out = tmp_path / "out"
    out.mkdir()
    case = open_case(str(tmp_path / "s.xml"), Request(spp=8, resolution=(12, 8)))
    place = kept.of_scene(out, "s", case)
    for content in ({}, {"sum0_count": np.array(1)}, {"sum0_count": np.array([[1]])}):
        place.save(content)
        assert place.load() is not None
        assert run(*words, out)[0] == 0
        assert record(out) == whole
        assert not place.path.exists()
    os.mkfifo(place.path)
    assert run(*words, out)[0] == 0
    assert record(out) == whole
    assert place.path.is_fifo()
    monkeypatch.setattr(kept, "of_scene", lambda *_: KeptPasses(place.path, "key", 0))
    code, _, messages = run(*words, out)
    assert code == 2
    assert f"{place.path}: it is not a regular file" in messages


def record(out):
    content = json.loads((out / "s/comparison.json").read_text())
    return {name: content[name] for name in ("metrics", "plan", "regions")}


# --- Finished scenes -------------------------------------------------------------------------


def test_a_view_that_is_damaged_or_whose_files_are_is_made_again(run, tmp_path, monkeypatch):
    (tmp_path / "s.xml").write_text(SCENE)
    out, loaded = tmp_path / "out", []
    load = finished.load
    monkeypatch.setattr(finished, "load", lambda *words: loaded.append(load(*words)) or loaded[-1])
    words = ("compare", tmp_path / "s.xml", "--spp", 4, "--resolution", "12x8", "-o", out)
    for _ in range(2):
        assert run(*words)[0] == 0
    assert [found is not None for found in loaded] == [False, True]
    view, key = out / "s/view.json", None
    text = view.read_text()
    key = json.loads(text)["key"]
    for change in (
        lambda: view.write_text(text.replace("PNG", "png").replace("0.", "1.")),
        lambda: Entry(view, key).save({"view": None, "sizes": {}}),
        lambda: Entry(view, key).save({"view": json.loads(text)["content"]["view"], "sizes": []}),
        lambda: (out / "s/comparison.json").write_text("{}"),
        lambda: (out / "s/comparison.exr").unlink(),
    ):
        change()
        assert run(*words)[0] == 0
        assert loaded[-1] is None
        assert record(out)["metrics"]
    for seed in range(40):
        view.write_bytes(damaged(text.encode(), random.Random(seed)))
        assert load(out / "s", key) is None or view.read_text() == text


# --- Studies ---------------------------------------------------------------------------------


@pytest.fixture
def study(rgb):
    """A study of four points, three of them in files of their own."""
    return design.parse("[[part]]\nscene = 'lobe'\n[part.parameters]\nalpha = [0.1, 0.2, 0.3, 0.4]")


def test_points_that_do_not_fit_are_done_again(study, tmp_path):
    whole = running.run(study, tmp_path).table
    (part,) = study.parts
    block = point.blocks(part)[1]
    entry = Entry(tmp_path / "points" / f"{block.key}.json", block.key)
    (row,) = entry.load()["rows"]
    for seed in range(200):
        rng = random.Random(seed)
        name = rng.choice(sorted(row))
        odd = rng.choice([True, [], {}, "x" if name != "part" else 1, 10**30, [[1.0]]])
        less = {key: value for key, value in row.items() if key != "alpha"}
        rows = rng.choice([[row | {name: odd}], [less], None, {}, [row] * 2])
        entry.save({"rows": rows})
        assert not dataset.fits(entry.load()["rows"], block.points), (seed, name, odd)
    for content in ({"rows": None}, {"rows": [row | {"rmse": "x"}]}, {}, {"rows": 3}):
        entry.save(content)
        outcome = running.run(study, tmp_path)
        assert (outcome.done, outcome.cached) == (1, 3)
        assert outcome.table.equals(whole)
    entry.remove()
    os.mkfifo(entry.path)
    with pytest.raises(InputError, match="not a regular file"):
        running.run(study, tmp_path)
    assert entry.path.is_fifo()


SCENE_OF_FILES = SCENE.replace(
    '<shape type="sphere">',
    '<shape type="obj"><string name="filename" value="m.obj"/></shape>'
    '<shape type="sphere"><bsdf type="diffuse" id="paint">'
    '<rgb name="reflectance" value="0.5"/></bsdf></shape><shape type="sphere">',
)


@pytest.mark.parametrize("script", [False, True], ids=["xml", "python"])
def test_a_study_is_done_again_once_a_file_of_its_scene_changes(script, rgb, tmp_path):
    def write(size):
        corners = ((-size, 0, 0), (size, 0, 0), (0, 0, 3 * size))
        lines = [f"v {x} {y} {z}" for x, y, z in corners]
        (tmp_path / "m.obj").write_text("\n".join([*lines, "f 1 2 3", "f 3 2 1", ""]))

    if script:
        (tmp_path / "s.py").write_text(
            "import mitsuba as mi\n"
            f"scene = dict(mi.load_dict) if 0 else {python_scene(tmp_path / 'm.obj')!r}\n"
        )
    else:
        (tmp_path / "s.xml").write_text(SCENE_OF_FILES)
    name = "s.py" if script else "s.xml"
    text = (
        f"[[part]]\nscene = '{name}'\nspp = 16\nresolution = [12, 12]\n"
        "[part.parameters]\n'paint.reflectance' = [0.2, 0.8]"
    )
    wanted = design.parse(text, folder=tmp_path)
    write(0.5)
    first = running.run(wanted, tmp_path / "out")
    assert (first.done, first.failed) == (2, 0)
    assert running.run(wanted, tmp_path / "out").done == 0
    write(2.0)
    second = running.run(wanted, tmp_path / "out")
    scene = tmp_path / name
    scene.write_text(scene.read_text().replace("60", "20"))  # its lamp
    third = running.run(wanted, tmp_path / "out")
    values = []
    for outcome in (first, second, third):
        assert (outcome.done, outcome.failed) == (2, 0)
        values.append(outcome.table["reference"].to_pylist())
    assert (np.abs(np.diff(values, axis=0)) > 1e-3).all()


def python_scene(mesh):
    return {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 3},
        "sensor": {"type": "perspective", "film": {"type": "hdrfilm", "width": 12, "height": 12}},
        "ball": {
            "type": "sphere",
            "center": [0, 0, 6],
            "bsdf": {
                "type": "diffuse",
                "id": "paint",
                "reflectance": {"type": "rgb", "value": 0.5},
            },
        },
        "mesh": {"type": "obj", "filename": str(mesh)},
        "lamp": {"type": "point", "position": [2, 2, -4], "intensity": 60.0},
        "sky": {"type": "constant", "radiance": 0.3},
    }


@pytest.mark.parametrize("kind", ["empty", "cut", "flipped", "other", "folder", "fifo"])
def test_a_damaged_dataset_is_a_message(kind, study, tmp_path):
    path = tmp_path / "d.parquet"
    table = running.run(study, tmp_path).table
    dataset.write(path, table)
    whole = path.read_bytes()
    if kind in ("folder", "fifo"):
        path.unlink()
        put(kind, path)
    elif kind == "other":
        dataset.write(path, dataset.read(path).drop_columns(["error"]))
    for seed in range(60 if kind in ("cut", "flipped") else 1):
        rng = random.Random(seed)
        if kind == "empty":
            path.write_bytes(b"")
        elif kind == "cut":
            path.write_bytes(whole[: rng.randrange(len(whole))])
        elif kind == "flipped":
            path.write_bytes(damaged(whole, rng))
        if path.is_file() and path.read_bytes() == whole:
            continue
        try:
            found = dataset.read(path)
        except InputError as error:
            message = str(error)
        else:  # where only the study's own words were hit
            message = "Run the study again" if kind == "flipped" and found.equals(table) else ""
        assert "Run the study again" in message, seed


def test_the_checksum_is_that_of_the_content(tmp_path):
    """So that a file made by hand can be told from a damaged one."""
    entry = Entry(tmp_path / "r.json", "key")
    entry.save(CONTENT["r.json"])
    text = entry.path.read_text(encoding="utf-8")
    body = text[text.index('"content": ') + len('"content": ') : -1]
    assert json.loads(text)["sha256"] == sha256(body.encode()).hexdigest()
