"""A Dask cluster of one worker, as somebody else has started it."""

import os
import socket
import subprocess
import sys
from contextlib import contextmanager

from tests.programs import ROOT


def start(processes):
    """Start a scheduler and a worker, which are added to a list, and return their address."""
    address = f"tcp://127.0.0.1:{(port := _free_port())}"
    options = ("--host", "127.0.0.1", "--port", port, "--no-dashboard")
    processes.append(_started("scheduler", *options))
    processes.append(_started("worker", address, "--nthreads", 1, "--no-dashboard"))
    return address


@contextmanager
def running():
    """Give the address of a cluster that is there while the block runs."""
    processes = []
    try:
        yield start(processes)
    finally:
        for process in reversed(processes):
            process.kill()
            process.wait()


def _started(*words):
    command = [sys.executable, "-c", "from dask.__main__ import main; main()", *map(str, words)]
    return subprocess.Popen(
        command,
        cwd=ROOT,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


def _free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]
