"""A digest of everything in a scene, which identifies its results."""

import hashlib
from collections.abc import Iterator
from typing import Any

import mitsuba as mi
import numpy as np

from heuristic.errors import InputError
from reference.scene.graph import Reference
from reference.scene.source import Source


def digest(source: Source) -> str:
    """Return a digest of a scene in the current variant, and of every file that it reads.

    It holds the graph with all values at full precision, objects that a script made, and the
    content of :meth:`Source.files`. Environment variables, the clock and random numbers used by a
    script count as far as they show in the graph.

    Raises
    ------
    InputError
        If the scene or one of its files cannot be read.
    """
    found = hashlib.sha256()
    graph = source.parse()
    for index in graph.nodes_in_use():
        props = graph.props(index)
        found.update(f"{index} {props.plugin_name()} {props.id()}\0".encode())
        for key, value in props.items():
            for part in _parts(value):
                found.update(f"{key} {len(part)} ".encode() + part)
    for path in source.files():
        try:
            with path.open("rb") as file:
                found.update(hashlib.file_digest(file, "sha256").digest())
        except OSError as error:
            raise InputError(
                f"{source.name}: {path}: {error.strerror or error}. The scene names this file:"
                " ensure that it can be read."
            ) from error
    return found.hexdigest()


def _parts(value: Any) -> Iterator[bytes]:
    """Yield a property's value as bytes; printed, floats are rounded and arrays shortened."""
    if value is None or isinstance(value, (bool, int, float, str)):
        yield repr(value).encode("utf-8", "surrogateescape")
    elif isinstance(value, Reference):
        yield f"node {value.index()}".encode()
    elif hasattr(value, "wavelengths"):
        yield repr((list(value.wavelengths), list(value.values))).encode()
    elif hasattr(value, "matrix"):
        yield np.array(value.matrix).tobytes()
    elif hasattr(value, "__array__") or hasattr(value, "__array_interface__"):
        array = np.array(value)
        yield f"{array.dtype} {array.shape}".encode()
        yield array.tobytes()
    else:
        yield str(value).encode()
        if isinstance(value, mi.Object):
            for name, inner in mi.traverse(value).items():
                yield name.encode()
                yield from _parts(inner)
