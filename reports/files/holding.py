"""One command at a time in an output folder: a lock that the system releases with its process."""

import errno
import json
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path

from filelock import FileLock, Timeout

from comparisons import atomic
from heuristic.errors import OutputError
from reports.files import listing

LOCK = ".fotismos-lock"

PATIENCE_S = 0.5
"""Seconds to wait for a command that is just ending."""

WITHOUT_LOCKS = {errno.ENOSYS, errno.ENOLCK, errno.EOPNOTSUPP}
"""Errors of file systems without locks, where no command is kept out."""


@contextmanager
def held(folder: Path, command: str) -> Iterator[None]:
    """Keep other commands out of a folder while the block runs.

    ``command`` names this one in their error message. If nothing is made in the folder, the lock
    leaves no trace.

    Raises
    ------
    OutputError
        If another process holds the folder, which is named, or it cannot be written to.
    """
    path = folder / LOCK
    for own in (path, folder / listing.MARK):
        with atomic.explained(own):
            if os.path.lexists(own) and (own.is_symlink() or not own.is_file()):
                raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST))
    lock = FileLock(path, PATIENCE_S, fallback_to_soft=False, preserve_lock_file=True)
    with atomic.explained(path):
        try:
            lock.acquire()
        except Timeout:
            raise OutputError(_held_by_another(folder)) from None
        except OSError as error:
            if error.errno not in WITHOUT_LOCKS:
                raise
    try:
        with atomic.explained(path):
            path.write_text(_holder(command), encoding="utf-8")
        yield
    finally:
        if listing.read(folder).is_empty():
            with suppress(OSError):
                for name in (listing.MARK, LOCK):
                    (folder / name).unlink(missing_ok=True)
        lock.release()


def _holder(command: str) -> str:
    since = datetime.now().astimezone().isoformat(" ", "seconds")
    return json.dumps({"pid": os.getpid(), "host": atomic.HOST, "since": since, "command": command})


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
