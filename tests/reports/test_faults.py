"""Commands, each in a process of its own, that meet something broken or are interrupted."""

import os
import re
import shutil
import signal
import subprocess
import sys
import time
import uuid
from pathlib import Path
from random import Random

import pytest

from tests.shared.outputs import results
from tests.shared.programs import ROOT
from tests.shared.small_scene import SCENE

pytestmark = pytest.mark.thorough

SMALL = ("--spp", "8", "--resolution", "16x16", "--no-why", "-o", "out")
COMPARE = ("compare", "a.xml", *SMALL)
STUDY = """[[part]]
scene = "lobe"
[part.parameters]
alpha = { from = 0.1, to = 0.8, steps = 4 }
"""
RIGHTS = "exec setpriv --bounding-set -dac_override,-dac_read_search,-fowner "
"""Rights of files hold for root, too."""

FAULTS = (
    ("a script that exits", ("compare", "exit.py", *SMALL), "", 2, "exit.py"),
    ("no scene, and a script that is killed", ("compare", "text.xml", "kill.py", *SMALL), "", 2,
     "2 of 2 scenes failed, among them: text"),
    ("no time", (*COMPARE, "--timeout", "1e-9"), "", 1, "made no progress"),
    ("no rights", COMPARE, f"mkdir out; chmod 555 out; {RIGHTS}", 2, "denied"),
    ("a full disk", COMPARE, "ulimit -f 4;", 2, "File too large"),
)  # fmt: skip
"""Name, words, what a shell does before, exit code, and what the message has."""


def started(folder, words, shell="", mark=""):
    """Start a command, marked so that all processes that come of it can be found."""
    return subprocess.Popen(
        ["sh", "-c", f'{shell} "$@"', "sh", sys.executable, "-P", "-m", "fotismos.reports", *words],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT), "FOTISMOS_MARK": mark},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        start_new_session=True,
    )


def orphans(mark):
    """Return the processes that are still there after some seconds."""
    until = time.monotonic() + 5
    while time.monotonic() < until:
        left = []
        for place in Path("/proc").glob("[0-9]*"):
            try:
                is_zombie = (place / "stat").read_text().rpartition(")")[2].split()[0] == "Z"
                if mark.encode() in (place / "environ").read_bytes() and not is_zombie:
                    left.append(place.name)
            except (OSError, IndexError):
                continue
        if not left:
            break
        time.sleep(0.05)
    return left


@pytest.fixture
def folder(tmp_path):
    boxed = SCENE.replace("</film>", '<rfilter type="box"/></film>')
    scripts = {"exit": "import sys\nsys.exit(3)", "kill": "import os\nos.kill(os.getpid(), 9)"}
    files = {"a.xml": boxed, "text.xml": "no scene", "mine.txt": "mine"}
    files |= {"s.toml": STUDY} | {f"{name}.py": text for name, text in scripts.items()}
    for name, text in files.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    return tmp_path


@pytest.mark.guarantee(
    "runs", "A fault ends with a message: no traceback, no orphan, no file lost."
)
def test_each_fault_is_one_message(folder):
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    for name, words, shell, code, message in FAULTS:
        mark = uuid.uuid4().hex
        process = started(folder, words, shell, mark)
        printed, _ = process.communicate(timeout=120)
        assert process.returncode == code, (name, process.returncode, printed)
        assert re.search(message, printed), (name, printed)
        assert "Traceback" not in printed, (name, printed)
        assert not orphans(mark), name
        shutil.rmtree(folder / "out", ignore_errors=True)
        assert {path.name: path.read_bytes() for path in folder.iterdir()} == before, name


@pytest.mark.guarantee(
    "runs", "After Ctrl-C or SIGTERM the same command goes on, with the same results."
)
@pytest.mark.parametrize("words", [COMPARE, ("study", "s.toml", "-o", "out")], ids=lambda w: w[0])
def test_an_interrupted_command_goes_on(words, folder):
    def finish():
        process = started(folder, words)
        printed, _ = process.communicate(timeout=300)
        assert process.returncode == 0, printed
        return results(folder / "out")

    begin = time.perf_counter()
    whole = finish()
    seconds = time.perf_counter() - begin  # the others find its kernels, and take less
    shutil.rmtree(folder / "out")
    random = Random(words[0])
    for number in (signal.SIGINT, signal.SIGTERM):
        mark = uuid.uuid4().hex
        process = started(folder, words, "exec", mark)
        time.sleep(random.uniform(0.2, 0.6) * seconds)
        process.send_signal(number)
        printed, _ = process.communicate(timeout=60)
        assert process.returncode in (0, 128 + number, -number), printed
        assert "Traceback" not in printed or process.returncode == -number
        assert not orphans(mark)
    assert finish() == whole
