"""Arrays of meshes, through Mitsuba's interface of today and the announced one."""

import ast

import mitsuba as mi
import numpy as np
import pytest

from heuristic import mesh_arrays, meshes
from heuristic.errors import InstallationError
from reports.commands import doctor
from reports.terminal import version_lines
from tests.test_rooms import ROOT, modules

POINTS = [(0, 0, 0), (1, 0, 0), (1, 1, 0.5), (0, 1, 0.25)]
FACES = [(0, 1, 2), (0, 2, 3)]
NORMALS = [(0, 0, 1), (0, 0.6, 0.8), (0.6, 0, 0.8), (0, 0, 1)]
UV = [(0, 0), (1, 0), (1, 1), (0, 1)]


class ComingMesh:
    """Mitsuba's next mesh, as its pull request 1933 describes it: rows, set when it is made."""

    def __init__(self, name, faces, positions, **others):
        self.name, self.changed, self.attributes = name, [], {}
        self.values = {"faces": faces, "positions": positions, **others}
        self.check()

    def check(self):
        for name, value in {**self.values, **self.attributes}.items():
            kind = mi.TensorXu if name == "faces" else mi.TensorXf
            if not name.endswith("_index"):
                assert isinstance(value, kind), name
                assert value.shape[1:] == ((2,) if name == "texcoords" else (3,)), name

    def traverse(self, callback):
        for name, value in {**self.values, **self.attributes}.items():
            callback.put(name, value, mi.ParamFlags.Differentiable)

    def parameters_changed(self, keys):
        self.changed += keys
        self.check()

    def add_attribute(self, name, size, values):
        self.attributes[name] = mi.TensorXf(mi.Float(values), (len(values) // size, size))

    def has_attribute(self, name):
        return name in self.attributes

    def vertex_count(self):
        return len(mesh_arrays.rows(self, mesh_arrays.POSITIONS))

    def face_count(self):
        return len(mesh_arrays.rows(self, mesh_arrays.FACES))

    def id(self):
        return self.name

    def set_id(self, name):
        self.name = name

    def bsdf(self):
        return None

    def set_bsdf(self, bsdf):
        assert bsdf is None

    def has_flipped_normals(self):
        return False


class Coming:
    """Mitsuba with its next mesh."""

    Mesh = ComingMesh

    def __getattr__(self, name):
        return getattr(mi, name)


@pytest.fixture(params=["today", "coming"])
def interface(request, rgb, monkeypatch):
    if request.param == "coming":
        monkeypatch.setattr(mesh_arrays, "mi", Coming())
    return request.param


def transposed(kind, values):
    return kind(np.array(values).T)


def made(normals=True, uv=True):
    return mesh_arrays.made(
        "roof",
        transposed(mi.Vector3f, POINTS),
        transposed(mi.Vector3u, FACES),
        transposed(mi.Vector3f, NORMALS) if normals else None,
        transposed(mi.Point2f, UV) if uv else None,
    )


ARRAYS = {"POSITIONS": POINTS, "FACES": FACES, "NORMALS": NORMALS, "TEXCOORDS": UV}


@pytest.mark.parametrize("name", ARRAYS)
def test_arrays_are_read_as_written(interface, name):
    part, mesh, given = getattr(mesh_arrays, name), made(), np.array(ARRAYS[name], np.float32)
    assert mesh_arrays.is_flat(mesh) == (interface == "today")
    np.testing.assert_array_equal(mesh_arrays.rows(mesh, part), given)
    np.testing.assert_array_equal(np.array(mesh_arrays.vectors(mesh, part)).T, given)


@pytest.mark.parametrize("normals", [False, True])
@pytest.mark.parametrize("uv", [False, True])
def test_missing_arrays_are_known(interface, normals, uv):
    mesh = made(normals, uv)
    assert mesh_arrays.has(mesh, mesh_arrays.NORMALS) == normals
    assert mesh_arrays.has(mesh, mesh_arrays.TEXCOORDS) == uv


def test_attributes_are_added_once_and_overwritten(interface):
    mesh = made()
    for factor in (1, 2):
        values = factor * transposed(mi.Vector3f, NORMALS)
        mesh_arrays.store(mesh, {"vertex_own": values, "face_own": mi.Vector3f([1, 2], 3, factor)})
    stored = mi.traverse(mesh)
    np.testing.assert_array_equal(np.ravel(stored["vertex_own"]), 2 * np.float32(NORMALS).ravel())
    np.testing.assert_array_equal(np.ravel(stored["face_own"]), [1, 3, 2, 2, 3, 2])
    if interface == "coming":
        assert {"vertex_own", "face_own"} <= {*mesh.changed}


def test_vertices_that_share_positions_and_normals(rgb):
    """A seam of the coming interface: four vertices at three positions, with two normals."""
    mesh = ComingMesh(
        "seam",
        mi.TensorXu(np.array(FACES, np.uint32)),
        mi.TensorXf(np.float32(POINTS[:3])),
        normals=mi.TensorXf(np.float32(NORMALS[:2])),
        position_index=mi.UInt32(0, 1, 2, 0),
        normal_index=mi.UInt32(1, 1, 0, 0),
    )
    points = mesh_arrays.rows(mesh, mesh_arrays.POSITIONS)
    np.testing.assert_array_equal(points, np.float32(POINTS)[[0, 1, 2, 0]])
    normals = mesh_arrays.rows(mesh, mesh_arrays.NORMALS)
    np.testing.assert_array_equal(normals, np.float32(NORMALS)[[1, 1, 0, 0]])


@pytest.mark.parametrize("change", [meshes.split_faces, meshes.with_vertex_normals])
def test_both_interfaces_give_the_same_meshes(rgb, monkeypatch, change):
    today = change(made())
    monkeypatch.setattr(mesh_arrays, "mi", Coming())
    coming = change(made())
    assert isinstance(coming, ComingMesh)
    for name in ARRAYS:
        rows = [mesh_arrays.rows(mesh, getattr(mesh_arrays, name)) for mesh in (today, coming)]
        np.testing.assert_array_equal(*rows)


NAMES = {f"{part.flat}_buffer" for part in vars(mesh_arrays).values() if hasattr(part, "flat")}
NAMES |= {"has_vertex_normals", "has_vertex_texcoords"}
KEYS = {"vertex_positions", "vertex_texcoords", "vertex_normals"}


def touches(node):
    """Whether a node of a module's tree reads, writes or makes a mesh's arrays."""
    match node:
        case ast.Attribute(attr=name):
            return name in NAMES
        case ast.Constant(value=str(text)):
            return text in KEYS | NAMES
        case (
            ast.Subscript(slice=ast.Constant(value="faces"))
            | ast.Call(func=ast.Attribute(attr="Mesh"))
        ):
            return True
    return False


def test_nothing_else_touches_the_arrays_of_meshes():
    found = {
        str(path.relative_to(ROOT))
        for path in modules()
        if any(map(touches, ast.walk(ast.parse(path.read_text(encoding="utf-8")))))
    }
    assert found == {"heuristic/mesh_arrays.py"}


def test_the_doctor_tries_meshes(interface):
    assert doctor.meshed(mi.variant()).startswith("are made and read, as ")


@pytest.mark.parametrize("fault", ["no such keyword", ""])
def test_the_doctor_says_what_breaks_if_meshes_differ(rgb, monkeypatch, fault):
    def changed(mesh, part):
        if fault:
            raise ValueError(fault)
        return np.zeros((3, 3))

    monkeypatch.setattr(mesh_arrays, "rows", changed)
    said = doctor.meshed(mi.variant())
    assert "scenes with meshes cannot be compared" in said
    assert (fault or "positions, faces, normals, texcoords") in said
    with pytest.raises(InstallationError):
        mesh_arrays.tried()


def test_only_versions_other_than_the_pinned_ones_are_explained(monkeypatch):
    installed = {library: "1.2.3" for library in version_lines.LIBRARIES}
    installed |= version_lines.pinned()
    monkeypatch.setattr(version_lines.metadata, "version", installed.get)
    assert len([*version_lines.version_lines()]) == len(version_lines.LIBRARIES)
    assert {"mitsuba", "drjit"} == version_lines.CHANGES.keys() == version_lines.pinned().keys()
    pin, installed["mitsuba"] = installed["mitsuba"], "99.0"
    lines = [*version_lines.version_lines()]
    assert lines[0].split(maxsplit=1) == ["mitsuba", f"99.0; {pin} is pinned"]
    assert lines[1].strip() == version_lines.CHANGES["mitsuba"]
    assert len(lines) == len(version_lines.LIBRARIES) + 1
