"""The declarations of effects: found, ordered, complete, and the same wherever they are."""

import copy
import pickle
import re

from reference.planning.effects import (
    AMBIENT,
    DIFFUSE,
    EFFECTS,
    EMISSION,
    PARTS,
    SPECULAR,
    labelled,
)
from reports.charts.theme import EFFECT_COLOURS

TERMS = {EMISSION, AMBIENT, DIFFUSE, SPECULAR}


def test_an_effect_stays_the_same_through_copies_and_processes():
    for effect in EFFECTS:
        assert labelled(effect.label) is effect
        assert pickle.loads(pickle.dumps(effect)) is effect
        assert copy.deepcopy(effect) is effect


def test_every_effect_that_tells_the_halves_apart_has_a_part_and_a_colour_of_its_own():
    apart = set(EFFECTS) - TERMS
    assert {effect for effect in EFFECTS if effect.colour} == apart
    assert {effect for effect in EFFECTS if effect.part} == apart
    assert {effect.part for effect in apart} == set(PARTS)
    assert list(EFFECT_COLOURS) == [effect.label for effect in EFFECTS if effect in apart]
    assert len(set(EFFECT_COLOURS.values())) == len(EFFECT_COLOURS)
    assert all(re.fullmatch("#[0-9a-f]{6}", colour) for colour in EFFECT_COLOURS.values())
