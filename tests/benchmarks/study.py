"""How a study spreads: the same rendered points in one process, and over 1, 2 and 4 Dask workers.

Speed-up is against one process with one thread; efficiency is speed-up over the number of cores
used. Dask's workers are warm, as in a long study: each has done some points before. The pool of
processes is started within its time, as a user waits for it.
"""

from contextlib import contextmanager
from statistics import median
from time import perf_counter

from rich.console import Console
from rich.table import Table

from comparisons.processes import pool  # isort: skip
from comparisons.processes import cluster  # isort: skip
from comparisons.study import design, point, running  # isort: skip  it finds LLVM first

import drjit as dr

from reports import jobs

POINTS = 96
WORKERS = (1, 2, 4)
STUDY = """
[[part]]
scene = "sphere"
[part.parameters]
alpha = [0.1, 0.2, 0.3, 0.4]
light_angle = {{ from = 0, to = 90, steps = {steps} }}
"""


def run(rounds):
    """Print a row for each way, and return the numbers."""
    (part,) = design.parse(STUDY.format(steps=POINTS // 4)).parts
    blocks = point.blocks(part)
    cores = pool.cores()
    ways = [
        ("one process, 1 thread", 1, _here(1)),
        (f"one process, {cores} threads", cores, _here(cores)),
        (f"{cores} processes, 1 thread each", cores, _pool(cores)),
        *((f"Dask, workers: {n}", cores, _cluster(n)) for n in WORKERS),
    ]
    rows = []
    for name, used, way in ways:
        with way as spread:
            _time(spread, blocks[::4])  # warm
            times = [_time(spread, blocks) for _ in range(max(1, min(rounds, 3)))]
        rows.append({"way": name, "cores": used, "median_s": median(times)})
    for row in rows:
        row["speed_up"] = rows[0]["median_s"] / row["median_s"]
        row["efficiency"] = row["speed_up"] / row["cores"]
    _print(rows)
    return rows


@contextmanager
def _here(threads):
    before = dr.thread_count()
    dr.set_thread_count(threads)
    yield running.processes(1)
    dr.set_thread_count(before)


@contextmanager
def _cluster(workers):
    with cluster.local(workers, jobs.Ready.among(workers)) as of_ours:
        yield running.workers_of(of_ours)


@contextmanager
def _pool(count):
    yield running.processes(count)


def _time(spread, blocks):
    begin = perf_counter()
    done = list(spread(blocks))
    seconds = perf_counter() - begin
    assert len(done) == len(blocks)
    return seconds


def _print(rows):
    table = Table(title=f"A study of {POINTS} rendered points")
    for heading in ("way", "cores", "time", "a point", "speed-up", "efficiency"):
        table.add_column(heading, justify="left" if heading == "way" else "right")
    for row in rows:
        table.add_row(
            row["way"],
            f"{row['cores']}",
            f"{row['median_s']:.1f} s",
            f"{row['median_s'] / POINTS * 1e3:.0f} ms",
            f"{row['speed_up']:.2f}",
            f"{row['efficiency']:.0%}",
        )
    Console().print(table)
