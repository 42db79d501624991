"""Spreading tasks over processes with Dask: on a running cluster, or on one made for the run.

It replaces a :class:`comparisons.processes.pool.Pool`. Dask gives the tasks of a lost worker to
another. A lost scheduler ends the run, and the next run resumes there. Dask offers neither progress
nor one process per task: time limits do not apply here, and changes that a script makes in its
worker persist.
"""

import logging
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from itertools import islice
from threading import Lock
from typing import Any
from uuid import uuid4

from comparisons.processes.worker import Task
from heuristic import program
from heuristic.errors import FotismosError, InstallationError, LostProcessError

NEEDED = ("dask", "distributed")
"""The extra `cluster` of pyproject.toml."""

ALLOWED_FAILURES = 30
"""Workers that may die during a task before it fails, in a cluster that this process made."""

AHEAD = 4
"""Tasks queued per worker: enough to keep it busy, few enough to lose little."""

TIMEOUT = 20
"""Seconds in which a scheduler must answer."""

Prepare = Callable[[], object]

_one_at_a_time = Lock()
_prepared: list[Prepare] = []


def done(prepare: Prepare, function: Callable[..., Any], arguments: tuple, *more: Any) -> Any:
    """Do a task in a worker, one at a time per process: Mitsuba uses all threads."""
    with _one_at_a_time:
        while prepare not in _prepared:
            prepare()
            _prepared.append(prepare)
        return function(*arguments, *more)


def silent(*told: object) -> None:
    """Discard progress."""


class Cluster:
    """Does tasks on a Dask cluster, as a pool does in processes here.

    Parameters
    ----------
    client
        A connected Dask client.
    prepare
        Called once in each worker, before its first task. It must be picklable, and equal to its
        pickled copies.
    """

    def __init__(self, client: Any, prepare: Prepare) -> None:
        self._client, self._prepare = client, prepare

    def start(self) -> None:
        """Do nothing: workers run already."""

    def end(self) -> None:
        """Release all tasks."""
        self._client.close()

    def do(self, task: Task) -> Any:
        """Do one task, and return what it returned, or raise what it raised."""
        ((_, outcome),) = self.each([task])
        return outcome.result()

    def each(self, tasks: Iterable[Task]) -> Iterator[tuple[Task, Future[Any]]]:
        """Do tasks; yield each with its outcome when it finishes.

        The outcome returns what the function returned, or raises the `FotismosError` that it
        raised, or a `LostProcessError` for any other exception.

        Raises
        ------
        LostProcessError
            When the scheduler is lost.
        """
        from distributed import as_completed
        from distributed.client import FutureCancelledError

        waiting = iter(tasks)
        given: dict[str, Task] = {}

        def submit(some: Iterable[Task]) -> list[Any]:
            futures = [self._submitted(task) for task in some]
            given.update({future.key: task for future, task in futures})
            return [future for future, _ in futures]

        workers = max(1, len(self._client.scheduler_info(n_workers=-1)["workers"]))
        queue = as_completed(submit(islice(waiting, AHEAD * workers)))
        for future in queue:
            task, outcome = given.pop(future.key), Future[Any]()
            try:
                outcome.set_result(future.result())
            except FutureCancelledError as error:
                if self._client.status != "running":
                    raise LostProcessError(
                        "the Dask scheduler is gone. All finished work is kept: run the same"
                        " command again to resume."
                    ) from error
                queue.update(submit([task]))  # its result was lost with the worker that held it
                continue
            except FotismosError as error:
                outcome.set_exception(error)
            # Its workers died too often, or cannot import fotismos.
            except Exception as error:
                told = f"{task.name}: {type(error).__name__}: {error}"
                outcome.set_exception(LostProcessError(told))
            yield task, outcome
            queue.update(submit(islice(waiting, 1)))

    def _submitted(self, task: Task) -> tuple[Any, Task]:
        more = () if task.progress is None else (silent,)
        # Dask treats tasks with equal keys as one, whoever submits them.
        key = f"{task.name}-{uuid4()}"
        arguments = self._prepare, task.function, task.arguments, *more
        return self._client.submit(done, *arguments, key=key), task


@contextmanager
def local(workers: int, prepare: Prepare = tuple) -> Iterator[Cluster]:
    """Make a Dask cluster of separate processes on this machine, which share its cores.

    Raises
    ------
    InstallationError
        When the extra is not installed.
    """
    distributed = _distributed()
    import dask

    with (
        _quiet(),
        dask.config.set({"distributed.scheduler.allowed-failures": ALLOWED_FAILURES}),
        distributed.LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            dashboard_address=None,
            scheduler_kwargs={"dashboard_address": ":0"},  # a free port for the rest of it
            silence_logs=logging.CRITICAL,
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield Cluster(client, prepare)


@contextmanager
def connected(address: str, prepare: Prepare = tuple) -> Iterator[Cluster]:
    """Use the Dask cluster whose scheduler is at an address, such as ``tcp://host:8786``.

    Raises
    ------
    InstallationError
        When the extra is not installed, or the scheduler does not answer.
    """
    distributed = _distributed()
    try:
        client = distributed.Client(address, timeout=TIMEOUT)
    except (OSError, ValueError) as error:
        raise InstallationError(
            f"no Dask scheduler answers at {address}: {error}. Start one with `dask scheduler`, and"
            " workers with `dask worker ADDRESS --nthreads 1`, where fotismos is installed."
        ) from error
    with _quiet(), client:
        yield Cluster(client, prepare)


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep Dask's messages about lost workers and schedulers out of the terminal."""
    loggers = [logging.getLogger(name) for name in ("distributed", "distributed.client")]
    before = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        for logger, level in zip(loggers, before, strict=True):
            logger.setLevel(level)


def _distributed() -> Any:
    try:
        import distributed
    except ImportError as error:
        raise InstallationError(
            f"a cluster needs Dask, which is not installed. Run: {program.installation(*NEEDED)}"
        ) from error
    return distributed
