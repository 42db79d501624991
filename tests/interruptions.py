"""Commands that are interrupted at random moments, and what is left of them.

``python -m tests.interruptions COMMAND COUNT [SEED]`` interrupts one so many times and prints what
came of it.
"""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import uuid
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from random import Random

import OpenEXR
import pyarrow.parquet
from PIL import Image

from tests.programs import ROOT
from tests.small_scene import SCENE

SIZE = ("--resolution", "48x48")
SCENES = {"a": SCENE, "b": SCENE.replace("0.2, 0.3, 0.5", "0.5, 0.3, 0.2")}
STUDY = """
[[part]]
name = "sharpness"
scene = "lobe"
[part.parameters]
alpha = [0.1, 0.4]
light_angle = { from = 0, to = 60, steps = 3 }
"""
REPORT = """
if __name__ != "__main__":  # in the process that renders
    import heuristic
    from comparisons.hard import collection

    collection.CASES = collection.CASES[::20]
else:
    from comparisons.gallery import builtin
    for name in set(builtin.SCENES) - {"fig-8-9", "lambert-sphere"}:
        del builtin.SCENES[name]
    from reports.commands import report
    report.VERIFIED_AT = (24, 24)
    from reports.__main__ import main
    main()
"""
"""The command line with two built-in scenes, few hard cases, and plans verified at a small size."""

TIMES = {"command", "equal_error", "equal_time", "machine", "pareto", "stages", "time"}
"""Keys under which records have times and what follows from them, and where a command wrote."""

MESSAGES = ("Traceback", "Fatal", "Segmentation", "core dumped", "terminate called")


@dataclass(frozen=True)
class Command:
    """A command to interrupt: its words for a folder of scenes and one for results."""

    words: Callable[[Path, Path], list]
    module: bool = True


COMMANDS = {
    "compare": Command(lambda own, out: ["compare", own / "a.xml", own / "b.xml", "-o", out, *SIZE,
                                         "--spp", 16]),
    "compare without causes": Command(lambda own, out: [*COMMANDS["compare"].words(own, out),
                                                        "--no-why"]),
    "report": Command(lambda own, out: ["report", "-o", out, *SIZE, "--spp", 16], module=False),
    "cost": Command(lambda own, out: ["cost", own / "a.xml", "-o", out, *SIZE, "--rounds", 2,
                                      "--spp", 8]),
    "fit": Command(lambda own, out: ["fit", own / "a.xml", own / "b.xml", "-o", out, *SIZE,
                                     "--spp", 8, "--form", "phong", "--loss", "linear"]),
    "study": Command(lambda own, out: ["study", own / "small.toml", "-o", out]),
    "check": Command(lambda own, out: ["check", out, "--update", "--scene", own / "a.xml",
                                       "--scene", own / "b.xml", *SIZE, "--spp", 16]),
}  # fmt: skip


def prepare(own: Path) -> Path:
    """Write what the commands read to a folder."""
    own.mkdir()
    for name, scene in SCENES.items():
        # The same bits in every rendering: other filters add up samples in any order.
        boxed = scene.replace("</film>", '<rfilter type="box"/></film>')
        (own / f"{name}.xml").write_text(boxed, encoding="utf-8")
    (own / "small.toml").write_text(STUDY, encoding="utf-8")
    (own / "report.py").write_text(REPORT, encoding="utf-8")
    return own


def start(name: str, own: Path, out: Path, mark: str) -> subprocess.Popen:
    """Start a command; all processes that come of it have ``mark`` in their environment."""
    command = COMMANDS[name]
    program = ["-m", "reports"] if command.module else [own / "report.py"]
    return subprocess.Popen(
        [sys.executable, "-P", *program, *map(str, command.words(own, out))],
        env=os.environ | {"PYTHONPATH": str(ROOT), "FOTISMOS_MARK": mark},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def marked(mark: str) -> list[int]:
    """Return the processes that a command has left."""
    found = []
    for place in Path("/proc").iterdir():
        if place.name.isdecimal():
            try:
                environment = (place / "environ").read_bytes()
                state = (place / "stat").read_text().rpartition(")")[2].split()[0]
            except (OSError, IndexError):
                continue
            if mark.encode() in environment and state != "Z":
                found.append(int(place.name))
    return found


def orphans(mark: str, seconds: float = 5.0) -> list[int]:
    """Return the processes that are still there after so long."""
    until = time.monotonic() + seconds
    while (left := marked(mark)) and time.monotonic() < until:
        time.sleep(0.02)
    return left


def torn(out: Path) -> list[str]:
    """Return the files below a folder that cannot be read as what their names say."""
    found = []
    for path in sorted(out.rglob("*")) if out.exists() else ():
        if path.is_file() and not path.name.startswith("."):
            try:
                _read(path)
            except Exception as error:  # whatever a torn file brings about
                found.append(f"{path.relative_to(out)}: {error}")
    return found


def _read(path: Path) -> None:
    if path.suffix == ".json":
        json.loads(path.read_text(encoding="utf-8"))
    elif path.suffix == ".png":
        with Image.open(path) as picture:
            picture.load()
    elif path.suffix == ".exr":
        with OpenEXR.File(str(path), separate_channels=True) as file:
            assert file.channels()
    elif path.suffix == ".parquet":
        pyarrow.parquet.read_table(path)
    elif path.suffix in (".html", ".svg"):
        assert path.read_text(encoding="utf-8").rstrip().endswith(("</html>", "</svg>"))


def results(out: Path) -> dict[str, object]:
    """Return all that a command wrote, but for times and what shows them."""
    found = {}
    for path in sorted(out.rglob("*")):
        place = path.relative_to(out).as_posix()
        if path.is_dir() or path.name in (".fotismos-lock", "run.json", "index.html", "view.json"):
            continue
        if path.suffix == ".json":
            found[place] = _without_times(json.loads(path.read_text(encoding="utf-8")))
        elif path.suffix == ".parquet":
            table = pyarrow.parquet.read_table(path)
            kept = [name for name in table.column_names if not _is_time(name)]
            found[place] = table.select(kept).to_pylist()
        elif path.suffix in (".exr", ".png"):
            found[place] = path.read_bytes()
        else:
            found[place] = "is there"
    return found


def _is_time(name: str) -> bool:
    return name in TIMES or name.endswith(("_s", "seconds"))


def _without_times(value: object) -> object:
    if isinstance(value, dict):
        return {k: _without_times(v) for k, v in value.items() if not _is_time(k)}
    if isinstance(value, list):
        return [_without_times(one) for one in value]
    return value


@dataclass(frozen=True)
class Trial:
    """One interruption: the signal, when it came, the exit code, and all that was wrong."""

    number: int
    moment: float
    code: int
    faults: tuple[str, ...]


def interrupt(name: str, own: Path, whole: dict, seconds: float, random: Random) -> Trial | None:
    """Interrupt a command at a random moment, and run it once more to its end.

    None where it had ended before.
    """
    number = random.choice((signal.SIGINT, signal.SIGTERM))
    to_all, moment, mark = random.random() < 0.5, random.uniform(0, seconds), uuid.uuid4().hex
    # Beside the whole one, since baselines name their scenes as seen from their folder.
    with _folder(own.parent / mark) as out:
        process = start(name, own, out, mark)
        time.sleep(moment)
        if process.poll() is not None:
            process.communicate()
            return None
        (os.killpg if to_all else os.kill)(process.pid, number)
        try:
            _, messages = process.communicate(timeout=60)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            process.communicate()
            return Trial(number, moment, 0, ("hangs",))
        faults = [f"orphan {pid}" for pid in orphans(mark)]
        faults += torn(out)
        # Python has not begun to listen: a shell says 130 and 143 then, too.
        if process.returncode not in (0, 128 + number, -number):
            faults.append(f"exit code {process.returncode}")
        if process.returncode != -number:
            faults += [messages[-2000:] for word in MESSAGES if word in messages]
        again = start(name, own, out, mark)
        _, messages = again.communicate(timeout=600)
        if again.returncode:
            faults.append(f"run again: {again.returncode}, {messages[-300:]}")
        elif (found := results(out)) != whole:
            faults += [f"differs: {k}" for k in {*found, *whole} if found.get(k) != whole.get(k)]
    return Trial(number, moment, process.returncode, tuple(faults))


@contextmanager
def _folder(path: Path) -> Iterator[Path]:
    try:
        yield path
    finally:
        shutil.rmtree(path, ignore_errors=True)


def trials(name: str, count: int, seed: int = 0) -> Iterator[Trial]:
    """Interrupt a command at so many random moments between its start and its end, one by one."""
    with tempfile.TemporaryDirectory() as folder:
        own, random = prepare(Path(folder, "scenes")), Random(f"{name} {seed}")
        out, seconds = Path(folder, "whole"), []
        for _ in range(2):  # the second finds its kernels, as all others will
            shutil.rmtree(out, ignore_errors=True)
            begin = time.perf_counter()
            process = start(name, own, out, "whole")
            _, messages = process.communicate(timeout=900)
            assert process.returncode == 0, messages
            seconds.append(time.perf_counter() - begin)
        whole = results(out)
        length, done = seconds[-1], 0
        while done < count:
            trial = interrupt(name, own, whole, length, random)
            if trial is None:  # other machines' loads make a command longer and shorter
                length *= 0.9
                continue
            done += 1
            yield trial


def main(name: str, count: str, seed: str = "0") -> None:
    """Print every fault as it shows, and then what came of interrupting a command."""
    # A shell lets what it starts in the background ignore it, and so would all that is tried here.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    codes, faults = Counter(), 0
    for trial in trials(name, int(count), int(seed)):
        codes[trial.code] += 1
        if trial.faults:
            faults += 1
            told = f"{signal.Signals(trial.number).name} after {trial.moment:.2f} s"
            print(f"{name}, {told}: {trial.faults}", flush=True)
        print(f"{name}: {codes.total()} interruptions, {dict(codes)}, faults {faults}", flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
