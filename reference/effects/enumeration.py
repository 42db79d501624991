"""All effects in their order, found in the modules of this folder."""

from importlib import import_module
from pkgutil import iter_modules

import reference.effects
from reference.effects.effect import Effect


def _found() -> tuple[Effect, ...]:
    modules = [
        import_module(f"{reference.effects.__name__}.{module.name}")
        for module in iter_modules(reference.effects.__path__)
        if module.name != __name__.rpartition(".")[2]
    ]
    effects = {
        value for module in modules for value in vars(module).values() if isinstance(value, Effect)
    }
    return tuple(sorted(effects, key=lambda effect: effect.order))


EFFECTS = _found()


def labelled(label: str) -> Effect:
    """Return the effect of a label."""
    return next(effect for effect in EFFECTS if effect.label == label)
