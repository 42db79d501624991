"""The declarations of effects: found, ordered, complete, and the same wherever they are."""

import copy
import pickle
import re

import pytest

from reference.effects import EFFECTS, kernel_terms, labelled
from reference.effects.effect import PARTS
from reports.charts.theme import EFFECT_COLOURS

TERMS = {kernel_terms.EMISSION, kernel_terms.AMBIENT, kernel_terms.DIFFUSE, kernel_terms.SPECULAR}


def test_effects_keep_their_order():
    assert [effect.label for effect in EFFECTS] == [
        "emission",
        "ambient",
        "diffuse",
        "specular",
        "distance attenuation",
        "spot cone",
        "polygon interpolation",
        "occlusion",
        "microfacets and Fresnel",
        "extended lights",
        "environment",
        "interreflection",
        "transmission",
        "spectral",
    ]
    assert len({effect.order for effect in EFFECTS}) == len(EFFECTS)


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.label)
def test_an_effect_stays_the_same_through_copies_and_processes(effect):
    assert labelled(effect.label) is effect
    assert pickle.loads(pickle.dumps(effect)) is effect
    assert copy.deepcopy(effect) is effect
    assert {effect, copy.copy(effect)} == {effect}


def test_every_effect_that_tells_the_halves_apart_has_a_part_and_a_colour_of_its_own():
    apart = set(EFFECTS) - TERMS
    assert {effect for effect in EFFECTS if effect.colour} == apart
    assert {effect for effect in EFFECTS if effect.part} == apart
    assert {effect.part for effect in apart} == set(PARTS)
    assert list(EFFECT_COLOURS) == [effect.label for effect in EFFECTS if effect in apart]
    assert len(set(EFFECT_COLOURS.values())) == len(EFFECT_COLOURS)
    assert all(re.fullmatch("#[0-9a-f]{6}", colour) for colour in EFFECT_COLOURS.values())


def test_what_is_grafted_or_left_out_also_says_where_the_halves_differ():
    nowhere = kernel_terms.EMISSION.differs
    for effect in EFFECTS:
        assert (effect.differs is not nowhere) is bool(effect.graft or effect.without), effect
        assert effect.graft or not effect.glow, effect
