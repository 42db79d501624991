"""Commands that meet each other: in one folder, at one moment, or after one that died."""

import json
import os
import socket
import subprocess
from collections.abc import Iterator
from pathlib import Path

from tests.faults.declared.disk import LIMITED
from tests.faults.declared.words import STUDY
from tests.faults.fault import RESULTS, Fault, compare, then, written
from tests.small_scene import SCENE

SMALL = "--spp 4 --resolution 16x16"
HELD = "another command writes there"
SCENES = written({
    "a.xml": SCENE, "b.xml": SCENE, "p/a.xml": SCENE, "q/a.xml": SCENE, "s.toml": STUDY,
})  # fmt: skip

BOTH = (
    "{ {first}; echo $? >one; } & { {second}; echo $? >two; } & wait; one=$(cat one) two=$(cat two)"
)
# One at least is done; of the other the exit code and its message stand for both.
END = "; [ $one = 0 ] || [ $two = 0 ] || exit 99; exit $((one + two))"


def _at_once(first: str, second: str, wait_s: float = 0) -> str:
    words = f'sleep {wait_s}; "$@" {second}' if wait_s else f'"$@" {second}'
    return BOTH.replace("{first}", f'"$@" {first}').replace("{second}", words) + END


PAIRS = {
    "one scene": ("compare a.xml -o out", "compare a.xml -o out"),
    "two scenes": ("compare a.xml -o out", "compare b.xml -o out"),
    "two of one name": ("compare p/a.xml -o out", "compare q/a.xml -o out"),
    "comparison and cost": ("compare a.xml -o out", "cost a.xml -o out --rounds 2"),
    "comparison and fit": ("compare a.xml -o out", "fit a.xml -o out --form phong"),
    "two studies": ("study s.toml -o out", "study s.toml -o out"),
    "one folder by two ways": ("compare a.xml -o out", "compare b.xml -o ./p/../out"),
    "one folder within the other": ("compare a.xml -o out", "compare b.xml -o out/inner"),
    "two folders": ("compare a.xml -o out", "compare a.xml -o other"),
}
"""What two commands do; only in the same folder does one of them have to wait."""

APART = {"one folder within the other", "two folders"}


def faults() -> Iterator[Fault]:
    """Yield faults of commands that meet."""
    for name, pair in PAIRS.items():
        first, second = (w if w.startswith("study") else f"{w} {SMALL}" for w in pair)
        for wait_s in (0, 2):
            codes = (0,) if name in APART else (0, 2)
            later = f", {wait_s} s later" if wait_s else ""
            yield Fault(f"{name} at once{later}", (), HELD, codes, SCENES, ("out/*",),
                        shell=_at_once(first, second, wait_s))  # fmt: skip
    yield from _after_each_other()
    yield from _locks()


def _after_each_other() -> Iterator[Fault]:
    both = ("out/a/comparison.json", "out/a-2/comparison.json")
    runs = f'"$@" compare p/a.xml -o out {SMALL} && exec "$@" compare q/a.xml -o out {SMALL}'
    yield Fault("two of one name, one after the other", (), "", (0,), SCENES, both, shell=runs)
    runs = f'"$@" cost a.xml -o out --rounds 2 {SMALL} && exec "$@" fit a.xml -o out {SMALL}'
    places = ("out/cost/a/cost.json", "out/fit/a/fit.json")
    yield Fault("cost and fit, one after the other", (), "", (0,), SCENES, places, shell=runs)
    prepare = then(SCENES, written({"cost.xml": SCENE, "index.xml": SCENE}))
    places = ("out/cost/*/cost.json", "out/cost-2/comparison.json")
    runs = f'"$@" cost a.xml -o out --rounds 2 {SMALL} && exec "$@" compare cost.xml -o out {SMALL}'
    yield Fault("a scene of a command's name", (), "", (0,), prepare, places, shell=runs)
    prepare = then(SCENES, written({"a.toml": STUDY}))
    runs = f'"$@" study a.toml -o out --processes 1 && exec "$@" compare a.xml -o out {SMALL}'
    places = ("out/study/a/*.parquet", "out/a/comparison.json")
    yield Fault("a study and a scene of one name", (), "", (0,), prepare, places, shell=runs)
    made = '"$@" check {} --update --scene a.xml --spp 8'
    runs = f"{made.format('b')} & {made.format('c')}; wait"
    yield Fault("two updates at once", (), "", (0,), SCENES, ("b/a.json", "c/a.json"), shell=runs)
    runs = f'for i in 1 2 3 4; do "$@" compare a.xml -o out {SMALL} & done; wait'
    yield Fault("four at once", (), None, (0,), SCENES, RESULTS, shell=runs)
    runs = f'"$@" compare a.xml b.xml -o out {SMALL} & sleep 6; rm -r out/a out/run.json; wait'
    yield Fault(
        "results deleted meanwhile", (), None, (0,), SCENES, ("out/index.html",), shell=runs
    )
    runs = (
        f'"$@" compare a.xml b.xml -o out {SMALL} & p=$!; sleep 4; mv out away; wait $p; {{back}}'
    )
    # What is the user's goes back to where it was.
    runs = runs.replace("{back}", "c=$?; mkdir -p out; cp away/mine.txt out; exit $c")
    yield Fault("the folder moved away meanwhile", (), "out", (0, 1, 2), SCENES, shell=runs,
                ours=("out", "out/*"))  # fmt: skip
    runs = f'"$@" compare a.xml b.xml -o out {SMALL} & p=$!; sleep 3; rm b.xml; wait $p'
    yield Fault("a scene deleted meanwhile", (), "b", (0, 1, 2), SCENES,
                shell=runs, ours=("b.xml",))  # fmt: skip


def _dead() -> int:
    ended = subprocess.Popen(["true"])
    ended.wait()
    return ended.pid


def _lock(pid: int, host: str):
    content = json.dumps({"pid": pid, "host": host, "since": "long ago", "command": "compare"})
    return then(SCENES, written({"out/.fotismos-lock": content}))


def _left(kind: str, pid: int, host: str):
    """Return what writes what a process leaves that is killed while it writes."""

    def write(folder: Path) -> None:
        for name in ("index.html", "a"):
            place = folder / f"out/.{name}.{host}.{pid}.fotismos-{kind}"
            place.parent.mkdir(exist_ok=True)
            place.mkdir() if name == "a" else place.write_text("half")

    return then(SCENES, write)


def _locks() -> Iterator[Fault]:
    """Yield what a command finds that others left, dead or alive."""
    host, ours = socket.gethostname(), ("out/.*",)
    for name, pid, place in (
        ("a dead process", _dead(), host), ("a process that lives", os.getpid(), host),
        ("a process of another machine", 1, "elsewhere"), ("no process", -1, host),
    ):  # fmt: skip
        yield Fault(f"a lock of {name}", compare(), "", (0,), _lock(pid, place), RESULTS, ours=ours)
        for kind in ("partial", "old"):
            left = _left(kind, abs(pid), place)
            own = ours if "dead" in name else (".fotismos-lock",)
            yield Fault(f"{kind} files of {name}", compare(), "", (0,), left, RESULTS, ours=own)
    hold = ("python3 -c 'import fcntl, sys, time; f = open(\"out/.fotismos-lock\", \"w\");"
            " fcntl.flock(f, fcntl.LOCK_EX); time.sleep(60)' & p=$!; sleep 1; ")  # fmt: skip
    for command in ("compare", "cost", "fit", "study"):
        yield Fault(f"a folder that is held, for {command}", LIMITED[command], HELD, (2,), SCENES,
                    shell=hold + '"$@"; c=$?; kill $p; exit $c')  # fmt: skip
