"""Damaged files that the scenes of the corpus read: textures, meshes, volumes, materials."""

import os
import shutil
import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from threading import Lock

from tests.faults.fault import RESULTS, Fault, compare, written
from tests.small_scene import SCENE

CORPUS = Path(__file__).parents[2] / "corpus"

READS = {
    "waves.png": "texture-bitmap",
    "sky.exr": "emitter-envmap",
    "tetrahedron.obj": "shape-obj",
    "coloured.ply": "shape-ply",
    "tetrahedron.serialized": "shape-serialized",
    "ellipsoids.ply": "shape-ellipsoids",
    "cloud.vol": "medium-heterogeneous",
    "curve.txt": "shape-linearcurve",
    "measured.bsdf": "bsdf-measured",
}
"""Files, and a scene that reads each."""

TEXTS = {"tetrahedron.obj", "curve.txt"}
"""Half of these is whole by itself."""


def _garbage(path: Path) -> None:
    path.write_bytes(b"\x00garbage\xff" * 100)


def _pipe(path: Path) -> None:
    path.unlink()
    os.mkfifo(path)


def _folder(path: Path) -> None:
    path.unlink()
    path.mkdir()


DAMAGES = {
    "is not there": Path.unlink,
    "is empty": lambda path: path.write_bytes(b""),
    "is cut in half": lambda path: path.write_bytes(path.read_bytes()[: path.stat().st_size // 2]),
    "is garbage": _garbage,
    "is a pipe": _pipe,
    "is a folder": _folder,
}

PLY = """ply
format ascii 1.0
element vertex {count}
property float x
property float y
property float z
element face {faces}
property list uchar int vertex_indices
end_header
0 0 0
1 0 0
{last}
3 0 1 {index}
"""
MESHES = {
    "a mesh with an index beyond its points": PLY.format(count=3, faces=1, last="0 0 1", index=9),
    "a mesh with an index below 0": PLY.format(count=3, faces=1, last="0 0 1", index=-1),
    "a mesh with a point of NaN": PLY.format(count=3, faces=1, last="nan 0 1", index=2),
    "a mesh with an infinite point": PLY.format(count=3, faces=1, last="inf 0 1", index=2),
    "a mesh with a point of words": PLY.format(count=3, faces=1, last="a b c", index=2),
    "a mesh of fewer points than told": PLY.format(count=99, faces=1, last="0 0 1", index=2),
    "a mesh of a million million points": PLY.format(count=10**12, faces=1, last="", index=2),
    "a mesh of no faces": PLY.format(count=3, faces=0, last="0 0 1", index=2),
    "a mesh of -1 points": PLY.format(count=-1, faces=1, last="0 0 1", index=2),
}
OBJECTS = {
    "an object with an index beyond its points": "v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 2 9\n",
    "an object with a point of NaN": "v 0 0 0\nv 1 0 0\nv nan 0 1\nf 1 2 3\n",
    "an object with a face of words": "v 0 0 0\nv 1 0 0\nv 0 0 1\nf a b c\n",
    "an object with an index of 0": "v 0 0 0\nv 1 0 0\nv 0 0 1\nf 0 1 2\n",
    "an object with a face of two points": "v 0 0 0\nv 1 0 0\nv 0 0 1\nf 1 2\n",
}


_one_at_a_time = Lock()
"""Faults are tried in several threads, and the first writes the corpus."""


@cache
def _whole() -> Path:
    """Return a folder with the corpus, and all files that it reads."""
    import heuristic  # noqa: F401  isort: skip  finds LLVM first
    import mitsuba as mi

    from tests import corpus_files

    mi.set_variant("llvm_ad_rgb")
    folder = Path(tempfile.mkdtemp(prefix="corpus-"))
    corpus_files.write(folder)
    return folder


def _damaged(file: str, scene: str, damage):
    def prepare(folder: Path) -> None:
        with _one_at_a_time:
            shutil.copy(_whole() / file, folder / file)
        shutil.copy(CORPUS / f"{scene}.xml", folder / "a.xml")
        damage(folder / file)

    return prepare


def _with_mesh(kind: str, content: str):
    name = f"mesh.{kind}"
    shape = f'<shape type="{kind}"><string name="filename" value="{name}"/></shape></scene>'
    return written({name: content, "a.xml": SCENE.replace("</scene>", shape)})


def faults() -> Iterator[Fault]:
    """Yield faults of files that scenes read."""
    for file, scene in READS.items():
        for what, damage in DAMAGES.items():
            may_do = file in TEXTS and "cut" in what
            codes = (0, 2) if may_do else (2,)
            message = rf"^fotismos: error: a.*{file.partition('.')[0]}"
            prepare = _damaged(file, scene, damage)
            yield Fault(f"{file} {what}", compare(), message, codes, prepare, RESULTS)
    for kind, meshes in (("ply", MESHES), ("obj", OBJECTS)):
        for name, content in meshes.items():
            codes = (0, 2) if "of no faces" in name or "two points" in name else (2,)
            prepare = _with_mesh(kind, content)
            yield Fault(name, compare(), r"^fotismos: error: a.*mesh", codes, prepare, RESULTS)
    for path in sorted(CORPUS.glob("refused-*.xml")):
        prepare = written({"a.xml": path.read_bytes()})
        yield Fault(f"corpus: {path.stem}", compare(), r"^fotismos: error: a", (2,), prepare)
