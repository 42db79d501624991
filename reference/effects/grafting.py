"""Nodes of one scene's graph copied into another's."""

import mitsuba as mi

from reference.scene.graph import Graph, Reference


def graft(graph: Graph, other: Graph, index: int) -> int:
    """Copy a node of another graph, and all that it refers to, and return its index here."""
    props = mi.Properties(other.props(index))
    for key, value in list(props.items()):
        if isinstance(value, Reference):
            props[key] = Reference(graft(graph, other, value.index()))
    return graph.add(other.kind(index), props)
