"""Python programs that tests run in a process of their own, and the command line in this one."""

import io
import os
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path
from unittest.mock import patch

from fotismos.reports.cli import main

ROOT = Path(__file__).parents[2]


def python(*words, cwd=ROOT, **variables):
    """Run Python with ``-c CODE`` or ``-m MODULE``, which finds the project, to its end."""
    environment = os.environ | {"PYTHONPATH": str(ROOT)} | variables
    command = [sys.executable, "-P", *map(str, words)]
    return subprocess.run(
        command, cwd=cwd, env=environment, capture_output=True, text=True, timeout=300
    )


def command_line(*words):
    """Run the command line in this process; return its exit code, output and messages."""
    streams = [io.TextIOWrapper(io.BytesIO(), "utf-8", write_through=True) for _ in range(2)]
    code = 0
    with (
        patch.object(sys, "argv", ["fotismos", *map(str, words)]),
        redirect_stdout(streams[0]),
        redirect_stderr(streams[1]),
    ):
        try:
            main()
        except SystemExit as leaving:
            code = leaving.code
    return code, *(stream.buffer.getvalue().decode("utf-8", "replace") for stream in streams)
