"""Baselines that somebody damaged, or tampered with."""

import json
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from tests.faults.fault import CHECKED, Fault, then, written
from tests.small_scene import SCENE

WHOLE = Path(__file__).parents[2] / "baselines/fig-8-9-llvm_ad_rgb.json"
CHECK = ("check", "b", "-o", "out", "--junit", CHECKED)
BESIDE = "a-whole.json"
Edit = Callable[[dict[str, Any]], object]

DROPPED = (
    "record_version", "scene", "options", "passes", "versions", "metrics", "heuristic", "reference",
)  # fmt: skip

VALUES: dict[str, tuple[str, Any]] = {
    "version 0": ("record_version", 0),
    "version 3": ("record_version", 3),
    "a version of words": ("record_version", "2"),
    "no scene": ("scene", ""),
    "a scene that is none": ("scene", "fig-8-99"),
    "a scene that is a number": ("scene", 89),
    "a scene with a NUL": ("scene", "a\0b"),
    "a scene with a newline": ("scene", "a\nb"),
    "a scene that is not there": ("scene", "../no.xml"),
    "a scene that is a pipe": ("scene", "pipe.xml"),
    "a scene that is a folder": ("scene", "folder.xml"),
    "a scene that is /dev/zero": ("scene", "/dev/zero"),
    "a scene that is itself": ("scene", "b.json"),
    "a scene of the folder": ("scene", "."),
    "a broken scene": ("scene", "broken.xml"),
    "a script that exits": ("scene", "exits.py"),
    "a script that ends its process": ("scene", "ends.py"),
    "a script that raises": ("scene", "raises.py"),
    "a script that never ends": ("scene", "never.py"),
    "options of words": ("options", {"spp": "many"}),
    "options that are none": ("options", {"ssp": 4}),
    "options that are a list": ("options", []),
    "a negative seed": ("options", {"seed": -1}),
    "a resolution of 0": ("options", {"resolution": [0, 0]}),
    "a resolution of a million": ("options", {"resolution": [10**6, 10**6]}),
    "a resolution of one number": ("options", {"resolution": [64]}),
    "a variant that is none": ("options", {"variant": "scalar_rgb"}),
    "a pairing that is none": ("options", {"pairing": "exact"}),
    "a heuristic that is none": ("options", {"heuristic": "phnog"}),
    "a sensor that is not there": ("options", {"sensor": 5}),
    "passes of 1": ("passes", 1),
    "passes of -1": ("passes", -1),
    "passes without number": ("passes", 10**9),
    "passes of words": ("passes", "16"),
    "versions of numbers": ("versions", {"mitsuba": 3}),
    "no metrics in it": ("metrics", {}),
    "a metric alone": ("metrics", {"dE2000": {"value": 1.0, "error": 0.1}}),
    "pictures that are not there": ("images", "no.exr"),
    "pictures that are garbage": ("images", "garbage.exr"),
    "pictures that are a pipe": ("images", "pipe.exr"),
    "pictures that are elsewhere": ("images", "../../etc/passwd"),
    "a half of None": ("heuristic", None),
}

NUMBERS = (float("nan"), float("inf"), 1e308, "1.0", None)

EDITS: dict[str, Edit] = {
    "rows of blocks that differ": lambda b: b["heuristic"]["blocks"][0].pop(),
    "no rows of blocks": lambda b: b["heuristic"].update(blocks=[]),
    "fewer blocks": lambda b: [b[h].update(blocks=b[h]["blocks"][:2]) for h in _HALVES],
    "a colour of two": lambda b: b["reference"]["mean"].pop(),
    "a negative error": lambda b: b["metrics"]["dE2000"].update(error=-1.0),
    "a metric that is none": lambda b: b["metrics"].update(x={"value": 1.0, "error": 0.0}),
    "a metric that is missing": lambda b: b["metrics"].pop("dE2000"),
}

MOVED: dict[str, Edit] = {
    "another mean": lambda b: b["reference"]["mean"].__setitem__(0, 0.6),
    "another metric": lambda b: b["metrics"]["dE2000"].update(value=2.3),
    "another block": lambda b: b["heuristic"]["blocks"][1][2]["mean"].__setitem__(1, 0.1),
    "halves in each other's place": lambda b: b.update(
        heuristic=b["reference"], reference=b["heuristic"]
    ),
    "another scene": lambda b: b.update(scene="fig-8-6a"),
    "another interpolation": lambda b: b["options"].update(interpolation="flat"),
}
"""Baselines that can be judged, of what is not there any more."""

_HALVES = ("heuristic", "reference")

SURROUNDINGS = {
    "b/broken.xml": SCENE[:300],
    "b/exits.py": "raise SystemExit(0)",
    "b/ends.py": "import os\nos._exit(0)",
    "b/raises.py": "raise ValueError('of its own')",
    "b/never.py": "import time\ntime.sleep(10000)",
    "b/garbage.exr": b"garbage" * 100,
    "b/folder.xml": None,
}


def _texts() -> dict[str, str | bytes]:
    whole = WHOLE.read_text(encoding="utf-8")
    return {
        "nothing": "",
        "text": "nothing",
        "a list": "[]",
        "null": "null",
        "half of it": whole[: len(whole) // 2],
        "UTF-16": whole.encode("utf-16"),
        "bytes": b"\xff\xfe\x00" * 50,
        "lists 200000 deep": "[" * 200_000 + "]" * 200_000,
        "a number of 10000 digits": whole.replace('"passes": 16', f'"passes": {"9" * 10_000}'),
        "two of them": whole * 2,
        "a comment": "// checked\n" + whole,
        "marks of a merge": "<<<<<<< ours\n" + whole + "=======\n>>>>>>> theirs\n",
        "a lone surrogate": whole.replace("fig-8-9", "\\ud800"),
    }


def _sparse(path: Path) -> None:
    with path.open("wb") as file:
        file.truncate(2**33)


PLACES: dict[str, Callable[[Path], object]] = {
    "a pipe": os.mkfifo,
    "a folder": os.mkdir,
    "a link to itself": lambda path: path.symlink_to(path.name),
    "a link to nothing": lambda path: path.symlink_to("nowhere"),
    "8 GB of nothing": _sparse,
    "a link to /dev/zero": lambda path: path.symlink_to("/dev/zero"),
}


def faults() -> Iterator[Fault]:
    """Yield faults of baselines."""
    yield _of("nothing wrong", _edited(lambda b: None), codes=(0,))
    for key in DROPPED:
        yield _of(f"without {key}", _edited(lambda b, key=key: b.pop(key)))
    for name, (key, value) in VALUES.items():
        yield _of(name, _edited(lambda b, key=key, value=value: b.update({key: value})))
    for value in NUMBERS:
        edit = lambda b, v=value: b["reference"]["blocks"][0][0]["mean"].__setitem__(0, v)  # noqa: E731
        yield _of(f"a colour of {value!r}", _edited(edit))
    for name, edit in EDITS.items():
        # Where blocks are others than now, that is moved, or an error.
        yield _of(name, _edited(edit), codes=(1, 2) if name == "fewer blocks" else (2,))
    for name, edit in MOVED.items():
        yield _of(name, _edited(edit), codes=(1,))
    for name, content in _texts().items():
        yield _of(f"in place of it: {name}", written({"b/b.json": content}))
    for name, make in PLACES.items():
        yield _of(f"in place of it: {name}", lambda folder, make=make: make(folder / "b/b.json"))
    yield from _together()


def _together() -> Iterator[Fault]:
    broken = written({"b/b.json": "nothing"})
    whole = written({f"b/{BESIDE}": WHOLE.read_bytes()})
    moved = then(_edited(MOVED["another mean"]), lambda f: (f / "b/b.json").rename(f / "b/c.json"))
    yield _of("a broken one beside a whole", then(broken, whole))
    yield _of("a broken one beside one that moved", then(moved, broken))
    yield _of("one that moved beside a whole", then(moved, whole), codes=(1,))
    words = ("check", "b", "--update", "-o", "out")
    yield Fault("an update of a broken one", words, "b.json", (2,), then(_folder, broken))
    words = ("check", "b/b.json", "--update", "--scene", "a.xml", "--spp", "8")
    pipe = then(_folder, written({"a.xml": SCENE}), lambda f: os.mkfifo(f / "b/b.json"))
    yield Fault("an update in place of a pipe", words, "regular|b.json", (2,), pipe)


def _of(name: str, prepare, codes: tuple[int, ...] = (2,)) -> Fault:
    words = (*CHECK, "--timeout", "40")
    message = "b.json|not checked" if codes == (2,) else ""
    return Fault(name, words, message, codes, then(_folder, prepare), (CHECKED,), (CHECKED,))


def _folder(folder: Path) -> None:
    written(SURROUNDINGS)(folder)
    os.mkfifo(folder / "b/pipe.xml")
    os.mkfifo(folder / "b/pipe.exr")


def _edited(edit: Edit) -> Callable[[Path], None]:
    def write(folder: Path) -> None:
        baseline = json.loads(WHOLE.read_text(encoding="utf-8"))
        edit(baseline)
        (folder / "b/b.json").write_text(json.dumps(baseline))

    return write
