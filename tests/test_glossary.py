"""The glossary: what the page must explain has a sentence."""

from comparisons.cost.methods import BUILT_IN
from reference.planning.effects import EFFECTS
from reports import glossary


def test_effects_and_methods_have_their_sentence():
    known = glossary.meanings()
    effects = {effect.label for effect in EFFECTS if effect.colour}
    assert effects | {method.name for method in BUILT_IN} <= set(known)


def test_no_name_has_two_meanings():
    names = [name for terms in glossary.GROUPS.values() for names in terms for name in names]
    assert len(names) == len({name.lower() for name in names})
