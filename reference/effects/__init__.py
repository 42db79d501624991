"""The effects of light, each declared once: :data:`EFFECTS`.

An effect is an :class:`reference.effects.effect.Effect` at the top of a module of this folder,
which is found automatically. Code that lists effects reads :data:`EFFECTS`: plans, the scenes
between the halves, prices, parts of a departure, steps of a study, charts and pages. Code that
needs one particular effect imports it from its module.
"""

from importlib import import_module
from pkgutil import iter_modules

from reference.effects.effect import Effect

_modules = [import_module(f"{__name__}.{found.name}") for found in iter_modules(__path__)]
_found = {e for module in _modules for e in vars(module).values() if isinstance(e, Effect)}

EFFECTS: tuple[Effect, ...] = tuple(sorted(_found, key=lambda effect: effect.order))
"""All effects in their order."""


def labelled(label: str) -> Effect:
    """Return the effect with a label."""
    return next(effect for effect in EFFECTS if effect.label == label)
