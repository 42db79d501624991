"""The registry of what can be declared: own names, names from outside, entry points."""

from dataclasses import dataclass
from types import SimpleNamespace

import pytest

from heuristic.declared import Declared
from heuristic.errors import InputError


@dataclass(frozen=True)
class Toy:
    name: str
    number: int = 0


@pytest.fixture
def toys(monkeypatch):
    """A registry with one toy of its own and one entry point, which counts how often it loads."""
    loads = []

    def load():
        loads.append(1)
        return Toy("installed")

    entry = SimpleNamespace(name="installed", value="package:TOY", load=load)
    monkeypatch.setattr("heuristic.declared.entry_points", lambda group: [entry])
    found = Declared("toy", "fotismos.toys")
    found.own(Toy("own"))
    return found, loads


def test_installed_packages_are_loaded_once_and_stand_last(toys):
    found, loads = toys
    assert (found["own"], loads) == (Toy("own"), [])
    found.declare(Toy("mine"))
    assert list(found) == ["own", "mine", "installed"]
    assert (len(found), "none" in found, loads) == (3, False, [1])
    assert found.built_in == ("own",)


def test_own_names_are_refused_and_others_replaced(toys):
    found, _ = toys
    with pytest.raises(InputError, match="toy 'own' is already declared"):
        found.declare(Toy("own", 1))
    for number in (1, 2):
        found.declare(Toy("mine", number))
    assert found["mine"].number == 2
