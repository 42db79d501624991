"""Memory and open files over a long batch: 300 scenes in one command, its processes watched."""

import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from tests.interruptions import marked
from tests.small_scene import SCENE

ROOT = Path(__file__).parents[2]

SCENES = 300
LOOK_S = 0.5


def run(rounds: int) -> list[dict]:
    """Print, and return, what the processes of a batch hold after so many scenes each."""
    with tempfile.TemporaryDirectory() as folder:
        looks = _watched(Path(folder))
    print("| scenes done | command, MiB | open files | renders, MiB | open files |")
    print("|---:|---:|---:|---:|---:|")
    for look in looks:
        print("| {done} | {command} | {command_files} | {worker} | {worker_files} |".format(**look))
    return looks


def _watched(folder: Path) -> list[dict]:
    """Compare the scenes, and look whenever another thirtieth of them is done."""
    scenes = folder / "scenes"
    scenes.mkdir()
    for number in range(SCENES):
        # Each of a colour of its own, so that none is like another.
        scene = SCENE.replace("0.2, 0.3, 0.5", f"0.2, 0.3, {0.2 + number / 1000}")
        (scenes / f"{number:03}.xml").write_text(scene, encoding="utf-8")
    mark = f"batch {os.getpid()}"
    words = ["compare", scenes, "-o", folder / "out", "--spp", 8, "--resolution", "16x16", "-q"]
    process = subprocess.Popen(
        [sys.executable, "-P", "-m", "reports", *map(str, words)],
        env=os.environ | {"PYTHONPATH": str(ROOT), "FOTISMOS_MARK": mark},
        stdout=subprocess.DEVNULL,
    )
    looks, step = [], SCENES // 10
    while process.poll() is None:
        time.sleep(LOOK_S)
        done = sum(1 for _ in folder.glob("out/*/view.json"))
        if done >= step * (len(looks) + 1):
            # The process that renders holds the most; the others are helpers of Python's.
            held = sorted((_held(pid) for pid in marked(mark) if pid != process.pid), reverse=True)
            own = _held(process.pid)
            looks.append(
                {"done": done, "command": own[0], "command_files": own[1]}
                | {"worker": held[0][0], "worker_files": held[0][1]}
            )
    assert process.returncode == 0
    return looks


def _held(pid: int) -> tuple[int, int]:
    """Return a process's resident memory in MiB, and the number of its open files."""
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
        files = len(os.listdir(f"/proc/{pid}/fd"))
    except OSError:  # it has ended meanwhile
        return 0, 0
    return pages * os.sysconf("SC_PAGE_SIZE") >> 20, files
