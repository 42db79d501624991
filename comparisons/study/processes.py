"""Spreading a study over the cores of this machine: one process a core, with one thread each.

A small point is half Python and NumPy, which keep one core busy whatever Mitsuba's threads do;
several processes keep all of them busy.
"""

import multiprocessing
import os
import signal
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool

from comparisons.study import point
from heuristic.errors import LostProcessError

WORTH_A_PROCESS = 16
"""Blocks below which the start of a process costs more than it saves."""


def cores():
    """Return the number of cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def over(count):
    """Return what `study.run` takes as ``spread``, for a number of processes.

    Raises
    ------
    LostProcessError
        While it runs, when one of the processes is ended from outside.
    """

    def spread(blocks):
        workers = min(count, len(blocks) // WORTH_A_PROCESS + 1)
        if workers == 1:
            for block in blocks:
                yield block, point.rows(block)
            return
        # A fork would share the state of Dr.Jit's threads.
        context = multiprocessing.get_context("spawn")
        threads = max(1, cores() // workers)
        pool = ProcessPoolExecutor(workers, context, initializer=_begin, initargs=(threads,))
        try:
            futures = {pool.submit(point.rows, block): block for block in blocks}
            for future in as_completed(futures):
                yield futures[future], future.result()
        except BrokenProcessPool as error:
            raise LostProcessError(
                "a process of the study was ended, by a person or for want of memory. All finished"
                " points are kept; run the same command again, and it goes on from there."
            ) from error
        finally:
            pool.shutdown(cancel_futures=True)

    return spread


def _begin(threads):
    import drjit as dr

    # Ctrl-C is for the process that asked; it ends these.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    dr.set_thread_count(threads)
