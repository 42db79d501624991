"""``python -m tests.faults [KIND ...]``: run commands into faults, and print the table."""

import argparse
import json
import signal
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from importlib import import_module
from itertools import chain
from pathlib import Path

from tests.faults import table, trial
from tests.faults.fault import Fault

KINDS = {
    "words": ("words",),
    "bad scenes": ("values", "scenes", "files"),
    "scripts": ("scripts",),
    "baselines": ("baselines",),
    "disk and names": ("disk",),
    "kept results": ("kept",),
    "signals": ("signals",),
    "together": ("together",),
}
"""Kinds of faults, and the modules that declare them."""


def of_kind(kind: str) -> list[Fault]:
    """Return the faults of a kind.

    Raises
    ------
    ValueError
        For two faults of one name.
    """
    modules = [import_module(f"tests.faults.declared.{name}") for name in KINDS[kind]]
    faults = list(chain.from_iterable(module.faults() for module in modules))
    if len({fault.name for fault in faults}) < len(faults):
        names = [fault.name for fault in faults]
        raise ValueError(f"twice: {sorted({name for name in names if names.count(name) > 1})}")
    return faults


def trials(faults: list[tuple[str, Fault]], at_once: int = 2) -> Iterator[trial.Trial]:
    """Run faults, two at a time."""
    with ThreadPoolExecutor(at_once) as pool:
        yield from pool.map(lambda each: trial.run(*each), faults)


def _good(files: list[Path], faults: list[tuple[str, Fault]]) -> list[trial.Trial]:
    """Return those of earlier trials in which nothing was wrong."""
    declared = {(kind, fault.name) for kind, fault in faults}
    rows = (row for file in files for row in json.loads(file.read_text(encoding="utf-8")))
    found = {(row["kind"], row["fault"]): trial.Trial(**row) for row in rows}  # the last one counts
    return [each for key, each in found.items() if each.is_good and key in declared]


def main(words: list[str]) -> int:
    """Print the table; return 1 where something is wrong."""
    parser = argparse.ArgumentParser(prog="python -m tests.faults", description=__doc__)
    parser.add_argument("kinds", nargs="*", metavar="KIND", help=f"of {', '.join(KINDS)}")
    parser.add_argument("--list", action="store_true", help="name the faults, and run none")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all trials")
    parser.add_argument(
        "--again",
        type=Path,
        nargs="+",
        default=[],
        metavar="FILE",
        help="run what failed in these files of --json, and take the rest of them",
    )
    parser.add_argument("--only", default="", metavar="TEXT", help="faults whose names have it")
    parser.add_argument("--every", type=int, default=1, metavar="N", help="one of N faults alone")
    chosen = parser.parse_args(words)
    if unknown := set(chosen.kinds) - set(KINDS):
        parser.error(f"no kind: {', '.join(sorted(unknown))}")
    faults = [(k, f) for k in chosen.kinds or KINDS for f in of_kind(k) if chosen.only in f.name]
    faults = faults[:: chosen.every]
    # A shell lets what it starts in the background ignore them, and so would all that is tried.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    if chosen.list:
        print(*(f"{kind}: {fault.name}" for kind, fault in faults), sep="\n")
        print(len(faults))
        return 0
    done = _good(chosen.again, faults)
    known = {(each.kind, each.fault) for each in done}
    for found in trials([(kind, each) for kind, each in faults if (kind, each.name) not in known]):
        done.append(found)
        print("." if found.is_good else f"\n{next(table.failures([found]))}", end="",
              file=sys.stderr, flush=True)  # fmt: skip
        if chosen.json:
            rows = [asdict(each) for each in done]
            chosen.json.write_text(json.dumps(rows, indent=1, ensure_ascii=False))
    print(file=sys.stderr)
    done.sort(key=lambda each: [*KINDS].index(each.kind))
    print(*table.lines(done), "", *table.failures(done), sep="\n")
    return int(not all(each.is_good for each in done))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
