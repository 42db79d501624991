"""Running a command into a fault, and judging what came of it."""

import os
import re
import subprocess
import sys
import tempfile
import threading
import time
import uuid
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from comparisons import atomic
from tests.faults.fault import Fault, Sent
from tests.interruptions import MESSAGES, ROOT, marked, orphans, torn

LIMIT_S = 120.0
"""Seconds after which a command hangs."""

KILLED = -9


@dataclass(frozen=True)
class Trial:
    """What came of a fault. ``code`` is None where the command had to be killed."""

    kind: str
    fault: str
    code: int | None
    said: str
    seconds: float
    is_expected: bool
    has_traceback: bool
    hangs: bool
    is_silent: bool
    orphans: int
    lost: tuple[str, ...]
    notes: tuple[str, ...]

    @property
    def is_good(self) -> bool:
        """Tell whether nothing is wrong."""
        return self.is_expected and not (
            self.has_traceback or self.hangs or self.is_silent or self.orphans or self.lost
        )


def run(kind: str, fault: Fault) -> Trial:
    """Set a fault up in an empty folder, run the command, and judge."""
    mark = uuid.uuid4().hex
    with tempfile.TemporaryDirectory(prefix="fault-", ignore_cleanup_errors=True) as place:
        folder = Path(place, "here")
        folder.mkdir()
        (folder / "mine.txt").write_text("mine")
        fault.prepare(folder)
        if not os.path.lexists(folder / "out") or (folder / "out").is_dir():
            with suppress(OSError):
                (folder / "out").mkdir(exist_ok=True)
                (folder / "out/mine.txt").write_text("mine")
        before = _contents(folder)
        begin = time.monotonic()
        code, out, said = _ended(fault, folder, mark)
        seconds = time.monotonic() - begin
        left = orphans(mark)
        _end(mark)
        return _judged(kind, fault, folder, before, (code, out, said), seconds, len(left))


def _ended(fault: Fault, folder: Path, mark: str) -> tuple[int | None, str, str]:
    """Run the command; return its exit code, its output and its messages."""
    process = subprocess.Popen(
        ["sh", "-c", fault.shell, "sh", sys.executable, "-P", "-m", "reports", *fault.words],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(ROOT), "FOTISMOS_MARK": mark} | fault.environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        start_new_session=True,
    )
    told: dict[str, bytes] = {"out": b"", "err": b""}
    readers = [
        threading.Thread(target=_read, args=(stream, told, name), daemon=True)
        for name, stream in (("out", process.stdout), ("err", process.stderr))
    ]
    for reader in readers:
        reader.start()
    until = time.monotonic() + LIMIT_S
    for sent in fault.sent:
        _send(sent, process, folder, mark, until)
    try:
        code = process.wait(max(0.1, until - time.monotonic()))
    except subprocess.TimeoutExpired:
        code = None
        _end(mark)
        process.kill()
        process.wait()
    for reader in readers:
        reader.join(2.0)  # an orphan may keep the pipe open
    return code, *(told[name].decode(errors="backslashreplace") for name in ("out", "err"))


def _read(stream, told: dict[str, bytes], name: str) -> None:
    with stream:
        while part := stream.read1():
            told[name] = (told[name] + part)[-(2**20) :]


def _send(sent: Sent, process: subprocess.Popen, folder: Path, mark: str, until: float) -> None:
    """Send a signal once its moment has come, if the command is still running."""
    moment = time.monotonic() + sent.when if isinstance(sent.when, float) else None
    while process.poll() is None and time.monotonic() < until:
        has_come = time.monotonic() >= moment if moment else any(folder.glob(str(sent.when)))
        pid = process.pid if sent.to != "worker" else _worker(mark) if has_come else None
        if has_come and pid:
            with suppress(ProcessLookupError):
                (os.killpg if sent.to == "group" else os.kill)(pid, sent.number)
            return
        time.sleep(0.01)


def _worker(mark: str) -> int | None:
    for pid in marked(mark):
        with suppress(OSError):
            if b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes():
                return pid
    return None


def _end(mark: str) -> None:
    """End whatever a command has left."""
    for pid in marked(mark):
        with suppress(ProcessLookupError):
            os.kill(pid, 9)


def _contents(folder: Path) -> dict[str, object]:
    """Return what is below a folder: files with their bytes, links with where they lead."""
    found: dict[str, object] = {}
    for place, inner, names in os.walk(folder):
        for name in (*inner, *names):
            path = Path(place, name)
            key = str(path.relative_to(folder))
            try:
                if path.is_symlink():
                    found[key] = os.readlink(path)
                elif path.is_file():
                    is_large = path.stat().st_size > 2**26  # sparse ones
                    found[key] = path.stat().st_size if is_large else path.read_bytes()
                else:
                    found[key] = path.stat().st_mode & 0o170000
            except OSError as error:
                found[key] = str(error.errno)
    return found


def _judged(kind, fault, folder, before, ended, seconds, left) -> Trial:
    code, out, said = ended
    after = _contents(folder)
    lost = tuple(
        name
        for name, content in before.items()
        if after.get(name) != content and not _is_ours(Path(name), fault)
    )
    notes = tuple(_notes(fault, folder, code, said, before))
    # Before Python listens, Ctrl-C ends it in its own way.
    has_traceback = code != -2 and any(word in out + said for word in MESSAGES)
    passed = code == 0 and (0 not in fault.codes or any("is not there" in note for note in notes))
    mute = code not in (0, None) and fault.message is not None and not said.strip()
    return Trial(
        kind,
        fault.name,
        code,
        (said or out)[-600:].strip(),
        round(seconds, 1),
        not notes,
        has_traceback,
        code is None,
        passed or mute,
        left,
        lost,
        notes,
    )


def _is_ours(path: Path, fault: Fault) -> bool:
    """Tell whether a file may be replaced; those called mine never are."""
    return "mine" not in path.name and any(path.match(own) for own in fault.ours)


def _notes(fault: Fault, folder: Path, code: int | None, said: str, before: dict):
    """Yield what is not as it is expected."""
    if code not in fault.codes:
        yield f"exit code {code}, not {' or '.join(map(str, fault.codes))}"
    if (
        code
        and code != KILLED
        and fault.message
        and not re.search(fault.message, said, re.MULTILINE)
    ):
        yield f"message without {fault.message!r}"
    for pattern in (*(fault.results if code == 0 else ()), *fault.leaves):
        if not any(folder.glob(pattern)):
            yield f"{pattern} is not there"
    if (folder / "out").is_dir():
        known = {str(Path(name).relative_to("out")) for name in before if name[:4] == "out/"}
        yield from (
            f"torn: {each}" for each in torn(folder / "out") if each.split(":")[0] not in known
        )
    is_killed = any(sent.number == 9 and sent.to != "worker" for sent in fault.sent)
    for path in () if is_killed else folder.rglob(".*.fotismos-*"):
        partial = atomic.LEFT.fullmatch(path.name)
        if partial and str(path.relative_to(folder)) not in before:
            yield f"half written: {path.name}"
