"""The glossary: what the page must explain has a sentence."""

from comparisons.cost import rungs
from reference.effects import EFFECTS
from reports import glossary


def test_effects_and_methods_have_their_sentence():
    known = glossary.meanings()
    priced = {effect.label for effect in EFFECTS if effect.colour}
    built_in = {rung.name for rung in rungs._own(rungs.DEPTHS)}
    assert priced | built_in <= set(known)


def test_no_name_has_two_meanings():
    names = [name for terms in glossary.GROUPS.values() for names in terms for name in names]
    assert len(names) == len({name.lower() for name in names})
