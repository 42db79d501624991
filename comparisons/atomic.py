"""Files that are written atomically: beside their place, and then moved there.

What is half written has a name that says whose it is, ``.NAME.HOST.PID.fotismos-partial``: only
what a process of this machine left that is no longer alive is ever cleared away.
"""

import os
import platform
import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

HOST = re.sub(r"[^A-Za-z0-9-]", "-", platform.node()) or "unknown"

LEFT = re.compile(r"\.(?P<name>.+)\.(?P<host>[A-Za-z0-9-]+)\.(?P<pid>\d+)\.fotismos-(?P<kind>\w+)")


def beside(path: Path, kind: str = "partial") -> Path:
    """Return where this process keeps something that is about to stand at ``path``, or stood."""
    return path.with_name(f".{path.name}.{HOST}.{os.getpid()}.fotismos-{kind}")


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a file to write to, and put it in the place of ``path`` if the block succeeds.

    Raises ``OSError`` where the place cannot be written to; nothing half written is left.
    """
    partial = beside(path)
    try:
        yield partial
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


def write(path: Path, content: str | bytes) -> None:
    """Write bytes, or text as UTF-8."""
    with replacing(path) as partial:
        partial.write_bytes(content.encode() if isinstance(content, str) else content)


def abandoned(folder: Path, kind: str = "partial") -> Iterator[tuple[Path, Path]]:
    """Yield what dead processes of this machine left in a folder, and what it was to stand at."""
    for path in sorted(folder.iterdir()):
        found = LEFT.fullmatch(path.name)
        if found is None or (found["kind"], found["host"]) != (kind, HOST):
            continue
        if not _is_alive(int(found["pid"])):
            yield path, folder / found["name"]


def remove(path: Path) -> None:
    """Delete a file, a link or a folder that is known to be the project's."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def _is_alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True
