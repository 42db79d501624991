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
    with ending(processes):
        yield start(processes)


@contextmanager
def ending(processes):
    """End the processes in a list after the block."""
    try:
        yield
    finally:
        for process in reversed(processes):
            process.kill()
            process.wait()


def command(*words):
    """Start a command of fotismos, whose output and messages are read later."""
    return _python("-m", "reports", *words, stdout=subprocess.PIPE, stderr=subprocess.PIPE)


def _started(*words):
    null = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    return _python("-c", "from dask.__main__ import main; main()", *words, **null)


def _python(*words, **streams):
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    program = [sys.executable, *map(str, words)]
    return subprocess.Popen(program, cwd=ROOT, env=environment, text=True, **streams)


def _free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]
