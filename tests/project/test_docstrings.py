"""The examples in docstrings run as they are printed, with the results that they print."""

import doctest
import importlib

import pytest

from tests.shared.programs import ROOT


def with_examples():
    """The names of all modules that hold an example."""
    for path in sorted((ROOT / "fotismos").rglob("*.py")):
        if ">>>" in path.read_text():
            yield ".".join(path.relative_to(ROOT).with_suffix("").parts)


@pytest.mark.parametrize("name", list(with_examples()))
@pytest.mark.usefixtures("rgb")
def test_examples_run_as_printed(name):
    failed, tried = doctest.testmod(importlib.import_module(name))
    assert tried
    assert not failed
