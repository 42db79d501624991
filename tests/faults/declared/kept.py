"""What an earlier run left, damaged, with something else in its place, or leading elsewhere."""

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from threading import Lock

from tests.faults.declared.words import STUDY
from tests.faults.fault import RESULTS, Fault, compare, with_scene, written
from tests.interruptions import ROOT

Damage = Callable[[Path], object]
STUDIED = ("study", "s.toml", "-o", "out", "--processes", "1")
OURS = ("out/*", "out/*/*", "out/*/*/*", "out/*/*/*/*")
"""Results, which the same command replaces; those called mine are not among them."""

_making = Lock()


@cache
def _finished(words: tuple[str, ...]) -> Path:
    """Return a folder in which a command has run."""
    folder = Path(tempfile.mkdtemp(prefix="finished-"))
    with_scene(folder)
    (folder / "s.toml").write_text(STUDY)
    command = [sys.executable, "-P", "-m", "reports", *words]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    subprocess.run(command, cwd=folder, env=environment, check=True, capture_output=True)
    return folder


def _sparse(path: Path) -> None:
    path.unlink()
    with path.open("wb") as file:
        file.truncate(2**34)


def _replaced(make: Callable[[Path], object]) -> Damage:
    def damage(path: Path) -> None:
        path.unlink()
        make(path)

    return damage


def _edited(path: Path) -> None:
    text = path.read_text(encoding="utf-8", errors="replace")
    path.write_text(text.replace("1", "2").replace("5", "7"), encoding="utf-8")


DAMAGES: dict[str, Damage] = {
    "is empty": lambda path: path.write_bytes(b""),
    "is garbage": lambda path: path.write_bytes(b"\x00garbage\xff" * 100),
    "is cut in half": lambda path: path.write_bytes(path.read_bytes()[: path.stat().st_size // 2]),
    "has other digits": _edited,
    "is gone": Path.unlink,
    "is a folder": _replaced(os.mkdir),
    "is a pipe": _replaced(os.mkfifo),
    "is a link to itself": _replaced(lambda path: path.symlink_to(path.name)),
    "is 16 GB of nothing": _sparse,
    "is lists in lists": lambda path: path.write_text("[" * 200_000),
}
KEPT = {"view.json": "out/a/view.json", "the list of the folder": "out/.fotismos",
        "the lock": "out/.fotismos-lock"}  # fmt: skip
OTHERS = {
    "comparison.exr": "out/a/comparison.exr",
    "comparison.json": "out/a/comparison.json",
    "the list of the scene's folder": "out/a/.fotismos",
    "run.json": "out/run.json",
}

LISTS = {
    "a list that names files elsewhere": "../mine.txt\n/etc/passwd\n../../x\n.\n..\n",
    "a list of JSON that is none": '{\n{"gone": 3}\n{"coming": []}\n{"place": {}, "of": 1}\n"\n',
    "a list of a name in 10 MB": "x" * 10**7 + "\n",
    "a list of 100000 names": "".join(f"n{i}\n" for i in range(100_000)),
    "a list without its last line's end": "a\nindex.html",
    "a list that places the scene elsewhere": '{"place": "../..", "of": "../a.xml"}\n',
    "a list that places the scene at a file": '{"place": "mine.txt", "of": "../a.xml"}\n',
}

PASSES = {
    "kept passes of nothing": b"",
    "kept passes of garbage": b"PK\x03\x04" + b"garbage" * 100,
    "kept passes of an empty archive": b"PK\x05\x06" + b"\0" * 18,
    "kept passes that are text": b"[1, 2]",
}


def faults() -> Iterator[Fault]:
    """Yield faults of what is kept."""
    for files, chosen in ((KEPT, DAMAGES), (OTHERS, dict(list(DAMAGES.items())[3:7]))):
        for file, place in files.items():
            for name, damage in chosen.items():
                yield _after(f"{file} {name}", _damaged(place, damage))
    for name, content in LISTS.items():
        yield _after(name, written({"out/.fotismos": content}))
    for name, content in PASSES.items():
        yield _after(name, _without_view(written({"out/.a.fotismos-passes.npz": content})))
    pipe = _without_view(lambda folder: os.mkfifo(folder / "out/.a.fotismos-passes.npz"))
    yield _after("kept passes that are a pipe", pipe)
    for file in (".fotismos", ".fotismos-lock"):
        yield _after(f"{file} that is a link to a file of others", _linked(f"out/{file}"))
    yield _after("a scene's list that is a link to a file of others", _linked("out/a/.fotismos"))
    for name in ("page", "picture"):
        place = "out/index.html" if name == "page" else "out/a/dE2000.png"
        yield _after(f"a {name} that is a link to a file of others", _linked(place))
    yield _after("the scene's folder moved", lambda f: (f / "out/a").rename(f / "out/b"))
    yield _after("the scene's folder gone", lambda f: shutil.rmtree(f / "out/a"))
    yield _after("another's file in the tables", written({"out/tables/mine.txt": "mine"}))
    yield _after("another's file among the results", written({"out/a/mine.txt": "mine"}))
    yield from _studies()


def _studies() -> Iterator[Fault]:
    for name, damage in list(DAMAGES.items())[1:7]:
        yield _after(f"a study's points {name}", _damaged_points(damage), STUDIED)
        yield _after(
            f"a study's dataset {name}", _damaged("out/study/s/s.parquet", damage), STUDIED
        )


def _damaged(place: str, damage: Damage) -> Damage:
    return lambda folder: damage(folder / place)


def _damaged_points(damage: Damage) -> Damage:
    def do(folder: Path) -> None:
        for path in list((folder / "out/study/s/points").glob("*.json")):
            damage(path)

    return do


def _linked(place: str) -> Damage:
    def do(folder: Path) -> None:
        (folder / place).unlink()
        (folder / place).symlink_to(folder / "mine.txt")

    return do


def _without_view(damage: Damage) -> Damage:
    def do(folder: Path) -> None:
        (folder / "out/a/view.json").unlink()
        damage(folder)

    return do


def _after(name: str, damage: Damage, words: tuple[str, ...] = ()) -> Fault:
    """Return the fault of a command that runs again, after its results are damaged."""
    words = words or compare()

    def prepare(folder: Path) -> None:
        with _making:
            whole = _finished(words)
        shutil.copytree(whole, folder, dirs_exist_ok=True)
        damage(folder)

    # What is damaged is made again, or in the way.
    results = RESULTS if words[0] == "compare" else ("out/study/s/*.parquet",)
    return Fault(name, words, "out", (0, 2), prepare, results, ours=OURS)
