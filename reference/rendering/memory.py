"""A check that memory is enough, before anything is rendered."""

from __future__ import annotations

import os
import resource
from collections.abc import Iterator
from contextlib import suppress
from math import isqrt
from pathlib import Path

from heuristic.errors import InputError

BYTES_A_PIXEL = 250
"""At the peak of a comparison, while it renders: `tests/benchmarks/scaling.py` measures it."""

BASE = 200 * 2**20
"""Memory that a comparison of any size takes, in addition to the process before it."""


def require(name: str, width: int, height: int) -> None:
    """Reject an image that does not fit into memory.

    Raises
    ------
    InputError
        With the memory needed, the memory free, and the largest image of the same shape that fits.
    """
    free = available()
    need = BASE + BYTES_A_PIXEL * width * height
    if free is None or need <= free:
        return
    fitting = largest(width, height, free)
    advice = (
        f"At most {fitting[0]}x{fitting[1]} pixels of this shape fit: give such a --resolution, or"
        if fitting
        else "Not even a small one fits:"
    )
    raise InputError(
        f"{name}: an image of {width}x{height} pixels needs {_gigabytes(need)} of memory, and"
        f" {_gigabytes(free)} are free. {advice} free some memory."
    )


def largest(width: int, height: int, free: int) -> tuple[int, int] | None:
    """Return width and height of the largest image of a shape within some bytes, or None."""
    pixels = max(free - BASE, 0) // BYTES_A_PIXEL
    wide = min(isqrt(pixels * width // height), width)
    high = min(wide * height // width, height)
    return (wide, high) if wide and high else None


def available() -> int | None:
    """Return the bytes that this process may still take; None if unknown.

    The least of: ``MemAvailable`` of ``/proc/meminfo`` (what programs can take without swapping);
    what the process's control group and those around it leave of ``memory.max`` (version 2) or
    ``memory.limit_in_bytes`` (version 1), without droppable pages of files; and what ``RLIMIT_AS``
    (``ulimit -v``) leaves.
    """
    return min([*_of_machine(), *_of_groups(), *_of_limit()], default=None)


def _of_machine() -> Iterator[int]:
    with suppress(OSError, ValueError):
        yield 1024 * _fields(Path("/proc/meminfo"))["MemAvailable:"]


def _of_groups() -> Iterator[int]:
    root = Path("/sys/fs/cgroup")
    with suppress(OSError, ValueError):
        for line in Path("/proc/self/cgroup").read_text(encoding="utf-8").splitlines():
            _, controllers, place = line.split(":", 2)
            if controllers not in ("", "memory"):
                continue
            top = root / controllers
            # Within a container the path may be the host's, and the top is the container's own.
            for folder in {top, *_upwards(top, top / place.lstrip("/"))}:
                yield from _left_in(folder)


def _upwards(top: Path, folder: Path) -> Iterator[Path]:
    while folder != top and top in folder.parents:
        yield folder
        folder = folder.parent


def _left_in(folder: Path) -> Iterator[int]:
    for limit, usage, cached in (
        ("memory.max", "memory.current", "inactive_file"),
        ("memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"),
    ):
        with suppress(OSError, ValueError):  # no such file, or the word "max"
            allowed, used = (int((folder / name).read_text()) for name in (limit, usage))
            yield max(allowed - used + _fields(folder / "memory.stat").get(cached, 0), 0)


def _of_limit() -> Iterator[int]:
    allowed, _ = resource.getrlimit(resource.RLIMIT_AS)
    if allowed != resource.RLIM_INFINITY:
        with suppress(OSError, ValueError):
            pages = int(Path("/proc/self/statm").read_text().split()[0])
            yield max(allowed - pages * os.sysconf("SC_PAGE_SIZE"), 0)


def _fields(file: Path) -> dict[str, int]:
    """Return the numbers of a file of lines that begin with a name and a number."""
    lines = (line.split() for line in file.read_text(encoding="utf-8").splitlines())
    return {words[0]: int(words[1]) for words in lines if len(words) > 1}


def _gigabytes(size: int) -> str:
    return f"{size / 1e9:.2g} GB" if size < 1e10 else f"{size / 1e9:.0f} GB"
