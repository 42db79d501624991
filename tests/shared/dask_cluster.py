"""A Dask cluster of one worker, as somebody else has started it."""

import os
import socket
import subprocess
import sys
from contextlib import contextmanager

from tests.shared.programs import ROOT


@contextmanager
def running():
    """Give the address of a cluster that is there while the block runs."""
    address = f"tcp://127.0.0.1:{(port := _free_port())}"
    processes = [
        _started("scheduler", "--host", "127.0.0.1", "--port", port, "--no-dashboard"),
        _started("worker", address, "--nthreads", 1, "--no-dashboard"),
    ]
    try:
        yield address
    finally:
        for process in reversed(processes):
            process.kill()
            process.wait()


def _started(*words):
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    program = [sys.executable, "-c", "from dask.__main__ import main; main()", *map(str, words)]
    null = subprocess.DEVNULL
    return subprocess.Popen(program, cwd=ROOT, env=environment, stdout=null, stderr=null)


def _free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]
