"""What commands have in common: their terminal and its options, and processes that render."""

import gc
import logging
import os
import shlex
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import click
from msgspec import Meta

from fotismos.comparisons.options import Declaration, Options, option
from fotismos.comparisons.processes.pool import HAS_GROUPS, Pool
from fotismos.heuristic import llvm, program
from fotismos.heuristic.errors import InputError
from fotismos.heuristic.program import cores
from fotismos.reports.terminal.parsing import FILE, OutputFolder, percentage
from fotismos.reports.terminal.words import echo, level, tell, tell_where


class Terminal(Declaration, frozen=True, kw_only=True):
    """What the command line asks beside the command itself: results, bounds, CI, processes.

    ``stated`` names the options that were typed, ``scenes`` the scenes of a command for several.
    """

    output: Annotated[
        Path,
        option(
            "Folder for the results",
            names=("-o", "--output"),
            type=OutputFolder(path_type=Path),
        ),
    ] = Path("out")
    as_json: Annotated[bool, option("Print JSON.", names=("--json",))] = False
    figures: Annotated[
        bool, option("Write figures for print, as SVG and PDF, to OUTPUT/figures.")
    ] = False
    fresh: Annotated[
        bool, option("Render all scenes again; without it, finished ones in OUTPUT are reused.")
    ] = False
    is_opened: Annotated[
        bool, option("Open the page in a browser as soon as it exists.", names=("--open",))
    ] = False
    within: Annotated[
        float,
        option(
            "Pixels differ visibly if ΔE2000 is above this: 1 to 10 in steps of 0.25.", metavar="DE"
        ),
    ] = 2
    max_visible: Annotated[
        float | None,
        option(
            "Exit code 1 unless at most this share of each scene's pixels differs visibly.",
            metavar="P%",
            type=percentage,
        ),
    ] = None
    junit: Annotated[Path | None, option("Write a JUnit XML file.", metavar="FILE", type=FILE)] = (
        None
    )
    summary: Annotated[
        Path | None,
        option(
            "Append a summary in Markdown, such as for a comment on a pull request.",
            metavar="FILE",
            type=FILE,
        ),
    ] = None
    timeout: Annotated[
        float,
        Meta(gt=0),
        option("End a scene that makes no progress for this long.", metavar="SECONDS"),
    ] = 1800
    workers: Annotated[
        Annotated[int, Meta(ge=0)] | None,
        option(
            "Processes that render at the same time, each with its share of the cores, and at most"
            " one per scene; 0 renders in the command's own process, as on Windows.",
            shown_default="one per core",
            metavar="N",
        ),
    ] = None
    scheduler: Annotated[
        str | None,
        option(
            "Use the Dask cluster with this scheduler, such as tcp://host:8786.", metavar="ADDRESS"
        ),
    ] = None
    scenes: tuple[str, ...] = ()
    stated: frozenset[str] = frozenset()

    @contextmanager
    def processes(self, tasks: int = 1) -> Iterator[Pool]:
        """Start the processes in which scenes are read and rendered, and end them at the end.

        They get ready while this process imports what the command needs, which takes as long.
        """
        with self.pool(tasks) as pool:
            pool.start()
            yield pool

    def show(self, record: Any, lines: Iterable[str], where: Path | None = None) -> None:
        """Print a record, if that was requested, or else its lines and where its page is."""
        if self.as_json:
            from fotismos.reference.records import to_json  # loaded late: help needs no NumPy

            click.echo(to_json(record), nl=False)
            return
        tell(lines)
        if where is not None:
            tell_where(where)

    def pool(self, tasks: int = 1) -> Pool:
        """Return processes or a cluster in which scenes are read and rendered.

        They are separate, since a scene may run its own code, and native code may crash or hang.
        There are at most as many as ``tasks``, ``workers`` or else cores. A Dask cluster has its
        own limits. With no workers, this process does it all.
        """
        if self.scheduler is None and (self.workers == 0 or not HAS_GROUPS):
            return Pool(0, ProcessSetup(level(), None))
        if self.scheduler is None:
            workers = min(self.workers or cores(), max(1, tasks))
            # Dr.Jit takes all cores by default: processes that run together share them.
            threads = max(1, cores() // workers) if workers > 1 else None
            return Pool(workers, ProcessSetup(level(), threads), self.timeout)
        if self.workers and self.workers > 1:
            raise click.UsageError("--workers and --scheduler exclude each other.")
        from fotismos.comparisons.processes import cluster  # loaded late: Dask is an extra

        set_up = ProcessSetup(
            level=level(), threads=None, folder=os.getcwd(), program=shlex.join(program.program())
        )
        return cluster.connected(self.scheduler, set_up)


def open_page(page: Path) -> None:
    """Open a page in the user's browser."""
    import webbrowser  # takes as long to import as a short command

    if not webbrowser.open(page.resolve().as_uri()):
        click.echo(f"fotismos: no browser was found to open {page}. Open it yourself.", err=True)


def command_line() -> str:
    """Return the command that the user gave, as a shell takes it."""
    return program.command(*sys.argv[1:])


@dataclass(frozen=True)
class ProcessSetup:
    """Sets a process up to render, as verbose as this one; a `folder` becomes its own.

    ``threads`` are Dr.Jit's, by default one per core; ``program`` begins printed commands.
    """

    level: int
    threads: int | None = None
    folder: str | None = None
    program: str | None = None

    def __call__(self) -> None:
        """Set this process up."""
        if self.program is not None:
            os.environ[program.VARIABLE] = self.program
        # Scenes and results are named relative to the user's folder.
        if self.folder is not None:
            try:
                os.chdir(self.folder)
            except OSError as error:
                raise InputError(
                    f"{self.folder}: {error.strerror}, on a worker of the cluster. Workers need the"
                    " same folders as this machine."
                ) from error
        llvm.check()
        llvm.use_threads(self.threads)

        # Unless verbose, a message is ignored: the record has the warnings that concern it.
        from fotismos.reference.scene.source import divert_messages

        divert_messages(partial(echo, err=True) if self.level > 0 else lambda _: None)
        if self.level > 0:
            logging.basicConfig(level=logging.INFO)
        # Part of start-up: what each scene needs.
        import fotismos.comparisons.compare
        import fotismos.comparisons.prepared  # noqa: F401

        gc.freeze()  # modules stay: garbage collections need not look at them


@dataclass(frozen=True)
class Job:
    """What a command does with each of its scenes.

    ``options`` say how to render; ``fresh`` renders finished scenes again; pixels differ
    visibly above the ΔE2000 ``within``. The methods of the scenes ``ladders`` are measured, too.
    A scene that is undecided takes ``patience`` times the samples.
    """

    options: Options
    figures: bool = False
    with_causes: bool = False
    fresh: bool = False
    within: float = 2.0
    ladders: frozenset[str] = frozenset()
    patience: int = 1
