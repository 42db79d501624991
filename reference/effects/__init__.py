"""The effects of light, each declared once: :data:`reference.effects.enumeration.EFFECTS`.

An effect is an :class:`reference.effects.effect.Effect` at the top of a module of this folder,
which the enumeration finds by itself. Whatever lists effects reads it: plans, the scenes between
the halves, prices, parts of a departure, steps of a study, charts and pages. Code that needs one
effect in particular imports it from its module.
"""
