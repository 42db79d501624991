"""The phong material that is nearest to each of Mitsuba's BSDFs: one rule per plugin.

A rule is one function, declared by :func:`reference.pairing.nearest.material.rule`.

- :mod:`reference.pairing.nearest.simple`: ``diffuse``, ``roughplastic``, ``plastic``,
  ``conductor``, ``roughconductor``, ``principled``, ``null``, ``dielectric``, ``roughdielectric``
  and ``thindielectric``;
- :mod:`reference.pairing.nearest.wrapped`: ``twosided``, ``mask``, ``blendbsdf``, ``bumpmap`` and
  ``normalmap``;
- :func:`reference.pairing.nearest.probe.nearest`: any other, including a user's.
"""

from importlib import import_module
from pkgutil import iter_modules

from reference.pairing.factors import Convention
from reference.pairing.nearest import probe
from reference.pairing.nearest.material import RULES, Context, Nearest, Rule
from reference.scene.graph import Graph

for _found in iter_modules(__path__):
    import_module(f"{__name__}.{_found.name}")  # declares its rules

WRAPPERS = tuple(plugin for plugin, rule in RULES.items() if rule.wraps)


def rule_of(plugin: str) -> Rule:
    """Return the rule of a BSDF, by the name of its plugin."""
    return RULES.get(plugin, Rule(probe.nearest))


def nearest_of(
    graph: Graph, index: int, convention: Convention, found: dict[int, Nearest] | None = None
) -> Nearest:
    """Return the :class:`Nearest` material of a BSDF node.

    ``found``, if given, receives it and those of nested nodes, by index.
    """
    found = {} if found is None else found

    def nearest(inner: int) -> Nearest:
        if inner not in found:
            rule = rule_of(graph.plugin(inner))
            found[inner] = rule.nearest(Context(graph, convention, nearest), inner)
        return found[inner]

    return nearest(index)
