"""Spreading a study over processes with Dask: a cluster that runs already, or one made for it.

Rows come back to the process that asked for them, which keeps them; workers share no files. Dask
gives the points of a lost worker to another. A scheduler that is lost ends the run, and the next
run goes on where it ended.
"""

import logging
import shlex
import sys
from contextlib import contextmanager
from itertools import count, islice
from threading import Lock

from comparisons.pool import cores
from comparisons.study import point
from heuristic import backend
from heuristic.errors import InstallationError, LostProcessError

NEEDED = ("dask", "distributed")
"""The extra `cluster` of pyproject.toml."""

ALLOWED_FAILURES = 30
"""Workers that may die with a point before the point itself is blamed, in a cluster of ours."""

AHEAD = 4
"""Blocks in hand for each worker: enough to keep it busy, few enough to lose little."""

TIMEOUT = 20
"""Seconds in which a scheduler must answer."""

_one_at_a_time = Lock()


def rows(block, threads):
    """Do one block in a worker; one at a time in a process, since Mitsuba uses its threads."""
    with _one_at_a_time:
        if threads:
            backend.use_threads(threads)
        return point.rows(block)


@contextmanager
def local(workers):
    """Make a Dask cluster of separate processes on this machine, which share its cores.

    Gives what :func:`comparisons.study.running.run` takes as ``spread``.

    Raises
    ------
    InstallationError
        When the extra is not installed.
    """
    distributed = _distributed()
    import dask

    threads = max(1, cores() // workers)
    with (
        _quiet(),
        dask.config.set({"distributed.scheduler.allowed-failures": ALLOWED_FAILURES}),
        distributed.LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            dashboard_address=None,
            silence_logs=logging.CRITICAL,
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield lambda blocks: spread(client, blocks, threads)


@contextmanager
def connected(address):
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
            " workers with `dask worker ADDRESS --nthreads 1`, in an environment that has fotismos."
        ) from error
    with _quiet(), client:
        yield lambda blocks: spread(client, blocks, None)


def spread(client, blocks, threads):
    """Do blocks on a cluster; yields ``(block, rows)`` as they are finished.

    Raises
    ------
    LostProcessError
        When the scheduler is lost.
    """
    from distributed import as_completed
    from distributed.client import FutureCancelledError

    waiting, hands, tries = iter(blocks), {}, count()

    def submit(some):
        futures = []
        for block in some:
            future = client.submit(rows, block, threads, key=f"{block.key}-{next(tries)}")
            hands[future.key] = block
            futures.append(future)
        return futures

    workers = max(1, len(client.scheduler_info(n_workers=-1)["workers"]))
    queue = as_completed(submit(islice(waiting, AHEAD * workers)))
    for future in queue:
        block = hands.pop(future.key)
        try:
            result = future.result()
        except FutureCancelledError as error:
            if client.status != "running":
                raise LostProcessError(
                    "the Dask scheduler is gone. All finished points are kept; run the same command"
                    " again, and it goes on from there."
                ) from error
            queue.update(submit([block]))  # its rows were lost with the worker that held them
            continue
        # A worker that died too often with it, or one that cannot import fotismos.
        except Exception as error:
            result = _failed(block, f"{type(error).__name__}: {error}")
        yield block, result
        queue.update(submit(islice(waiting, 1)))


def _failed(block, reason):
    return [
        {"part": block.part.name, "point": block.first + number, **values, "error": reason}
        for number, values in enumerate(block.points)
    ]


@contextmanager
def _quiet():
    """Keep Dask's own words on lost workers and schedulers from the user's terminal."""
    loggers = [logging.getLogger(name) for name in ("distributed", "distributed.client")]
    before = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        for logger, level in zip(loggers, before, strict=True):
            logger.setLevel(level)


def _distributed():
    try:
        import distributed
    except ImportError as error:
        raise InstallationError(
            "a cluster needs Dask, which is not installed. Do:"
            f" {shlex.join([sys.executable, '-m', 'pip', 'install', *NEEDED])}"
        ) from error
    return distributed
