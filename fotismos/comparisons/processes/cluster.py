"""Spreading tasks over the workers of a running Dask cluster, the way beyond one machine.

It replaces a :class:`fotismos.comparisons.processes.pool.Pool`. Dask gives the tasks of a lost
worker to another. A lost scheduler ends the run, and the next run resumes there. Dask offers
neither progress nor one process per task: time limits do not apply here, and changes that a script
makes in its worker persist.
"""

import logging
from collections.abc import Callable, Iterable
from concurrent.futures import Future
from itertools import islice
from threading import Lock
from typing import Any
from uuid import uuid4

from fotismos.comparisons.processes.pool import Ended, Pool, Task, Told, once, silent
from fotismos.heuristic import program
from fotismos.heuristic.errors import FotismosError, InstallationError, LostProcessError

NEEDED = ("dask", "distributed")
"""The extra `cluster` of pyproject.toml."""

AHEAD = 4
"""Tasks queued per worker: enough to keep it busy, few enough to lose little."""

TIMEOUT = 20
"""Seconds in which a scheduler must answer."""

_one_at_a_time = Lock()


def work(set_up: Callable[[], object], function: Callable[..., Any], *arguments: Any) -> Any:
    """Do a task in a worker, one at a time per process: Mitsuba uses all threads."""
    with _one_at_a_time:
        once(set_up)
        return function(*arguments)


class Cluster(Pool):
    """Does tasks on a Dask cluster, as a pool does in processes here.

    ``set_up`` is called once in each worker, before its first task. It must be picklable, and
    equal to its pickled copies.
    """

    def __init__(self, client: Any, set_up: Callable[[], object]) -> None:
        self._client = client
        self._set_up = set_up

    def start(self) -> None:
        """Do nothing: workers run already."""

    def end(self) -> None:
        """Release all tasks."""
        self._client.close()

    def each(self, tasks: Iterable[Task], told: Told = silent) -> Ended:
        """Do tasks, see :class:`Runner`; they tell nothing. A lost scheduler raises here."""
        from distributed import as_completed
        from distributed.client import FutureCancelledError

        waiting = iter(tasks)
        by_key = dict[str, Task]()

        def submit(some: Iterable[Task]) -> list[Any]:
            futures = []
            for task in some:
                arguments = (*task.arguments, silent) if task.tells else task.arguments
                # Dask treats tasks with equal keys as one, whoever submits them.
                key = f"{task.name}-{uuid4()}"
                futures.append(
                    self._client.submit(work, self._set_up, task.function, *arguments, key=key)
                )
                by_key[key] = task
            return futures

        workers = max(1, len(self._client.scheduler_info(n_workers=-1)["workers"]))
        queue = as_completed(submit(islice(waiting, AHEAD * workers)))
        for future in queue:
            task = by_key.pop(future.key)
            outcome = Future[Any]()
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
                reason = f"{task.name}: {type(error).__name__}: {error}"
                outcome.set_exception(LostProcessError(reason))
            yield task, outcome
            queue.update(submit(islice(waiting, 1)))


def connected(address: str, set_up: Callable[[], object] = tuple) -> Cluster:
    """Return the Dask cluster whose scheduler is at an address, such as ``tcp://host:8786``.

    ``InstallationError`` if the extra is not installed, or the scheduler does not answer.
    """
    try:
        import distributed  # only an extra brings it
    except ImportError as error:
        raise InstallationError(
            f"a cluster needs Dask, which is not installed. Run: {program.installation(*NEEDED)}"
        ) from error
    try:
        client = distributed.Client(address, timeout=TIMEOUT)
    except (OSError, ValueError) as error:
        raise InstallationError(
            f"no Dask scheduler answers at {address}: {error}. Start one with `dask scheduler`, and"
            " workers with `dask worker ADDRESS --nthreads 1`, where fotismos is installed."
        ) from error
    # Messages about lost workers and schedulers are Dask's own affair.
    for name in ("distributed", "distributed.client"):
        logging.getLogger(name).setLevel(logging.CRITICAL)
    return Cluster(client, set_up)
