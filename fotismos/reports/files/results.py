"""Folders of results: whose they are, and how files get into them.

fotismos promises this, and no more: a folder is its own if it has the mark ``.fotismos``. In it,
each file is replaced atomically. Nothing in a folder without the mark is overwritten or deleted.
The output folder itself may hold files of others: its mark lists the files that fotismos wrote
there, with digests, and nothing else in it is overwritten. One command at a time writes to a
folder, and it tidies no folder that another one has locked. A scene's record is removed first and
written last (:mod:`fotismos.reports.run.scene_files`): without it, the scene is unfinished, and
begins again.
"""

import errno
import hashlib
import json
import os
import platform
import re
import unicodedata
from collections.abc import Iterable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from datetime import datetime
from itertools import chain, count
from pathlib import Path
from time import perf_counter
from typing import Annotated

import msgspec
from filelock import FileLock, Timeout
from msgspec import Meta

from fotismos.comparisons import atomic
from fotismos.heuristic.errors import InputError, OutputError
from fotismos.reference.records import VERSION, Machine, Record, Versions

START = perf_counter()

MARK = ".fotismos"
LOCK = ".fotismos-lock"

PAGE = "index.html"
DETAILS = "details.html"
RUN = "run.json"
TABLES = "tables"
FIGURES = "figures"

RESERVED = {
    PAGE, DETAILS, RUN, TABLES, FIGURES, "assets", "audit", "check", "cost", "departures", "export",
    "fit", "study",
}  # fmt: skip
"""Names that no scene's folder may have."""

LONGEST = 100
"""Bytes of a scene folder's name."""

PATIENCE_S = 0.5
"""Seconds to wait for a command that is just ending."""

ASSIGNING_S = 10.0
"""Seconds to wait for commands that are choosing their folders, which takes milliseconds."""

PARTIAL_NAME = re.compile(rf"\..+\.\d+{re.escape(atomic.PARTIAL)}")
"""Names of partial files, see :func:`fotismos.comparisons.atomic.replacing`."""

WITHOUT_LOCKS = {errno.ENOSYS, errno.ENOLCK, errno.EOPNOTSUPP}
"""Errors of file systems without locks, where no command is kept out."""


class Failure(Record):
    """A scene that could not be compared; ``scene`` is the folder for its results."""

    scene: str
    error: str


class RunRecord(Record):
    """What one command did, besides the records of its scenes: ``run.json``."""

    command: str
    stages: Annotated[
        dict[str, float],
        Meta(description="Wall time in seconds, summed over simultaneous processes."),
    ]
    failures: tuple[Failure, ...]
    machine: Machine
    versions: Versions
    record_version: int = VERSION


# --- The folder of a command -----------------------------------------------------------------


@contextmanager
def hold(
    folder: str | Path,
    command: str,
    names: Sequence[str] = (PAGE, DETAILS, RUN),
    patience: float = PATIENCE_S,
) -> Iterator[Path]:
    """Make or take a folder, and keep other commands out of it while the block runs.

    ``command`` names this one to others. It writes files of these ``names``, beside which the
    folder may hold files of others; without names the folder holds nothing else. A command that
    writes nothing leaves no trace. ``patience`` is in seconds.
    """
    folder = Path(folder)
    # A soft lock is a mere file, which a killed process leaves behind.
    lock = FileLock(folder / LOCK, patience, fallback_to_soft=False, preserve_lock_file=True)
    # The innermost folder first: in this order they can be removed again.
    missing = [path for path in (folder, *folder.parents) if not os.path.lexists(path)]
    with atomic.explained(folder / LOCK):
        while not _acquires(lock, folder):
            pass
    try:
        with atomic.explained(folder):
            holder = {"pid": os.getpid(), "host": platform.node(), "command": command}
            holder["since"] = datetime.now().astimezone().isoformat(" ", "seconds")
            (folder / LOCK).write_text(json.dumps(holder), encoding="utf-8")
            own(folder, *names)
            _require_made(folder, names)
            _tidy(folder)
        yield folder
    finally:
        with suppress(OSError):
            _tidy(folder)
            if is_own(folder) and not _is_used(folder, names):
                (folder / MARK).unlink()
            if not is_own(folder):
                (folder / LOCK).unlink()
            # The first folder that is not empty ends the loop, and `suppress` the error.
            for path in missing if names else [folder, *missing[1:]]:
                path.rmdir()  # fails if it is not empty
        lock.release()


@contextmanager
def hold_results(
    folder: Path, subjects: Iterable[tuple[str, Path | None]], command: str
) -> Iterator[list[Path]]:
    """Make or take a folder below ``folder`` for each subject (:func:`assigned`), and hold these.

    Other commands may write to other folders below it at the same time.
    """
    with ExitStack() as held:
        with hold(folder, command, names=(), patience=ASSIGNING_S):
            places = [folder / name for name in assigned(folder, subjects)]
            for target in places:
                held.enter_context(hold(target, command, ()))
        yield places
    with suppress(OutputError), hold(folder, command, names=(), patience=ASSIGNING_S):
        pass  # if nothing was written, it goes


def _is_used(folder: Path, names: Sequence[str]) -> bool:
    """Return whether a held folder has results."""
    paths = [path for path in folder.iterdir() if path.name not in (MARK, LOCK)]
    return any(not names or path.name in names or is_own(path) for path in paths)


def _acquires(lock: FileLock, folder: Path) -> bool:
    """Make a folder and lock it; False if a command that ended removed it in between."""
    folder.mkdir(parents=True, exist_ok=True)
    _require_file(folder / LOCK)
    try:
        lock.acquire()
    except FileNotFoundError:
        return False
    except Timeout:
        raise OutputError(_held_by_another(folder)) from None
    except OSError as error:
        if error.errno not in WITHOUT_LOCKS:
            raise
    return True


def _held_by_another(folder: Path) -> str:
    try:
        holder = json.loads((folder / LOCK).read_text(encoding="utf-8"))
        who = "process {pid} on {host}, since {since}: {command}".format(**holder)
    except (OSError, ValueError, KeyError, TypeError):
        who = "an unknown process"
    return (
        f"{atomic.printable(folder)}: another command writes there ({who}). Wait until it ends, or"
        " choose another output folder with -o."
    )


def _tidy(folder: Path) -> None:
    """Delete partial files of killed commands, and folders in which only a mark is left.

    A folder with a lock belongs to another command, which may be running.
    """
    for path in folder.iterdir():
        if PARTIAL_NAME.fullmatch(path.name):
            path.unlink()
        elif not path.is_symlink() and is_own(path) and not os.path.lexists(path / LOCK):
            with suppress(OSError):  # an inaccessible folder does not hinder the others
                _tidy(path)
                if os.listdir(path) == [MARK]:
                    (path / MARK).unlink()
                    path.rmdir()


# --- Whose it is -----------------------------------------------------------------------------


def is_own(folder: Path) -> bool:
    """Return whether a folder has the mark of fotismos."""
    mark = folder / MARK
    return mark.is_file() and not mark.is_symlink()


def own(folder: Path, *names: str) -> Path:
    """Make a folder and mark it, unless it is marked.

    One that others made must be empty, or else lack the ``names`` that are to be written there.
    """
    with atomic.explained(folder / MARK):
        _require_file(folder / MARK)
        if is_own(folder):
            return folder
        if folder.is_symlink() or (folder.exists() and not folder.is_dir()):
            raise _not_ours(folder)
        folder.mkdir(exist_ok=True)
        there = names or [name for name in os.listdir(folder) if name != LOCK]
        for name in there:
            if os.path.lexists(folder / name):
                raise _not_ours(folder / name if names else folder)
        # Braces begin a list of files; an empty mark means that every file is its own.
        atomic.write(folder / MARK, "{}" if names else "")
    return folder


def _made(folder: Path) -> dict[str, list[str]] | None:
    """Return the digests of the files that fotismos wrote to a folder, by name.

    None if the folder is not shared with others: all files in it are its own, or none is.
    """
    text = (folder / MARK).read_bytes()[: 2**16] if is_own(folder) else b""
    if not text.startswith(b"{"):
        return None
    try:
        return msgspec.json.decode(text, type=dict[str, list[str]])
    except msgspec.DecodeError:  # damaged: nothing is known to be its own
        return {}


def _is_made(path: Path, made: dict[str, list[str]]) -> bool:
    """Return whether a file is as fotismos wrote it."""
    is_file = path.is_file() and not path.is_symlink()
    return is_file and digest_of(path) in made.get(path.name, ())


def digest_of(path: Path) -> str:
    """Return the SHA-256 of a file, in hexadecimal digits."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _require_made(folder: Path, names: Sequence[str]) -> None:
    """Require that the files of these names, where there are any, are as fotismos wrote them."""
    there = [folder / name for name in names if os.path.lexists(folder / name)]
    made = _made(folder)
    if names and made is None:  # the mark of 0.3, for which they were all its own
        made = {path.name: [digest_of(path)] for path in there if path.is_file()}
        atomic.write(folder / MARK, json.dumps(made))
    for path in there:
        if not _is_made(path, made or {}):
            raise _not_ours(path)


def _not_ours(path: Path) -> InputError:
    if path.is_symlink():
        return InputError(
            f"{atomic.printable(path)}: this is a symbolic link, to {os.readlink(path)!r}, and is"
            " not followed. Give the folder itself with -o, or move the link away."
        )
    fault = "folder was not made by fotismos"
    if not path.is_dir():
        fault = "file was not made by fotismos, or was changed since"
    return InputError(
        f"{atomic.printable(path)}: this {fault}. Move it away, or choose another output folder"
        " with -o."
    )


def _require_file(path: Path) -> None:
    if os.path.lexists(path) and (path.is_symlink() or not path.is_file()):
        raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST))


# --- Files -----------------------------------------------------------------------------------


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a file to write to, which replaces ``path`` at the end."""
    folder = path.parent
    made = _made(folder)
    is_free = is_own(folder) if made is None else _is_made(path, made)
    if os.path.lexists(path) and not is_free:
        raise _not_ours(path)
    with atomic.replacing(path) as partial:
        yield partial
        if made is not None:  # noted first: a process may end before the file is replaced
            made[path.name] = [*made.get(path.name, [])[-1:], digest_of(partial)]
            atomic.write(folder / MARK, json.dumps(made))


def write(path: Path, content: str | bytes) -> None:
    """Write bytes, or text as UTF-8, see :func:`replacing`."""
    with replacing(path) as partial:
        partial.write_bytes(atomic.encoded(content))


def clear(folder: Path, names: Iterable[str]) -> None:
    """Delete files of a marked folder."""
    if is_own(folder):
        with atomic.explained(folder):
            for name in names:
                (folder / name).unlink(missing_ok=True)


# --- The folder of a scene -------------------------------------------------------------------


def assigned(folder: Path, subjects: Iterable[tuple[str, Path | None]]) -> list[str]:
    """Make and mark a folder for each subject: a name, and its file if it has one.

    A folder belongs to one subject, which its mark names, also in later commands.
    """
    owners = {path.name: _subject_of(path) for path in sorted(folder.iterdir()) if is_own(path)}
    chosen: list[str] = []
    for name, file in subjects:
        # Relative, so that the folder and the file may move together.
        path = file and os.path.relpath(file.resolve(), folder.resolve())
        subject = f"of: {path or f'built-in {name}'}"
        places = [candidate for candidate, of in owners.items() if of == subject]
        free = (candidate for candidate in _candidates(name) if not _subject_of(folder / candidate))
        candidate = next(candidate for candidate in chain(places, free) if candidate not in chosen)
        own(folder / candidate)
        if owners.get(candidate) != subject:
            atomic.write(folder / candidate / MARK, os.fsencode(subject))
        chosen.append(candidate)
    return chosen


def _candidates(name: str) -> Iterator[str]:
    # Some file systems store accents in one form, and do not tell upper from lower case.
    composed = unicodedata.normalize("NFC", name)
    plain = "".join(c if c.isalnum() or c in "-_." else "-" for c in composed)
    # File systems count bytes, so a character at the end may be cut, and is dropped. A dot at the
    # start would hide the folder.
    plain = plain.encode(errors="replace")[:LONGEST].decode(errors="ignore").strip(".") or "scene"
    if plain.casefold() not in RESERVED:
        yield plain
    yield from (f"{plain}-{number}" for number in count(2))


def _subject_of(target: Path) -> str:
    """Return the subject that a mark names; empty for none, as in a mark of 0.2."""
    text = os.fsdecode((target / MARK).read_bytes()[: 2**16]) if is_own(target) else ""
    return text if text.startswith("of: ") else ""
