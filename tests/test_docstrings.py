"""The examples in docstrings run as they are printed, with the results that they print."""

import doctest
import importlib
import inspect

import pytest

import heuristic
from comparisons.departure import metrics
from heuristic import terms
from reference.pairing import albedo, factors
from tests.programs import ROOT

ROOMS = ("heuristic", "reference", "comparisons", "reports")


def with_examples():
    """The names of all modules that hold an example."""
    for room in ROOMS:
        for path in sorted((ROOT / room).rglob("*.py")):
            if ">>>" in path.read_text(encoding="utf-8"):
                yield ".".join(path.relative_to(ROOT).with_suffix("").parts)


@pytest.mark.parametrize("name", list(with_examples()))
@pytest.mark.usefixtures("rgb")
def test_examples_run_as_printed(name):
    failed, tried = doctest.testmod(importlib.import_module(name))
    assert tried
    assert not failed


SHOWN_BY_EXAMPLE = (
    heuristic.Material,
    heuristic.shade,
    *(terms.diffuse, terms.specular, terms.attenuation, terms.clamped_attenuation),
    *(terms.normalisation, terms.spot_falloff),
    *(factors.alpha_of, factors.exponent_of, factors.specular_albedo),
    *(albedo.to_roughplastic, albedo.to_phong),
    *(metrics.delta_e_2000, metrics.log2_luminance_ratio),
)


@pytest.mark.parametrize("public", SHOWN_BY_EXAMPLE, ids=lambda public: public.__name__)
def test_what_users_call_has_an_example(public):
    assert ">>>" in inspect.getdoc(public)
