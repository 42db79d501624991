"""Lets Sphinx read our docstrings and signatures, and find names where they are defined."""

import ast
import re
from functools import cache
from importlib import import_module
from inspect import getsource, signature
from pydoc import locate
from typing import TypeVar, get_type_hints

from docutils.nodes import Element, document
from sphinx.addnodes import pending_xref
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment
from sphinx.util.inspect import stringify_signature


def setup(app: Sphinx) -> dict[str, bool]:
    """Register with Sphinx."""
    app.connect("doctree-read", qualify)
    app.connect("missing-reference", resolved)
    app.connect("autodoc-process-docstring", untyped, priority=400)  # before napoleon
    app.connect("autodoc-process-signature", plain)
    return {"parallel_read_safe": True}


def untyped(
    app: Sphinx, what: str, name: str, found: object, options: object, lines: list[str]
) -> None:
    """Keep napoleon from reading the words before a colon as the type of a value."""
    if what in ("attribute", "data", "property"):
        lines.insert(0, "\\ ")


def plain(
    app: Sphinx, what: str, name: str, found: object, options: object, text: str, returned: str
) -> tuple[str, str] | None:
    """Leave bounds to the records' schemas, and write ``...`` for what a factory makes."""
    if not text:
        return None
    if "Annotated[" in f"{text}{returned}":
        hints, full = get_type_hints(found), signature(found)
        values = [each.replace(annotation=hints[each.name]) for each in full.parameters.values()]
        result = hints.get("return", full.return_annotation)
        text, returned = (
            stringify_signature(full.replace(parameters=values, return_annotation=result)),
            "",
        )
    return re.sub(r"<\w+>", "...", text), returned


def qualify(app: Sphinx, page: document) -> None:
    """Give names that a module imports the name of the module that they are imported from."""
    for node in page.findall(pending_xref):
        if node.get("refdomain") == "py" and node.get("py:module"):
            names = imported(node["py:module"])
            first, dot, rest = node["reftarget"].partition(".")
            node["reftarget"] = f"{names.get(first, first)}{dot}{rest}"


@cache
def imported(module: str) -> dict[str, str]:
    """Return the full names of what a module imports from others, also for types alone."""
    names = {}
    for node in ast.walk(ast.parse(getsource(import_module(module)))):
        if isinstance(node, ast.ImportFrom):
            names |= {alias.name: f"{node.module}.{alias.name}" for alias in node.names}
        elif isinstance(node, ast.Import):
            names |= {alias.asname: alias.name for alias in node.names if alias.asname}
    return names


def resolved(
    app: Sphinx, env: BuildEnvironment, node: pending_xref, text: Element
) -> Element | None:
    """Return a link to one of our names, plain text for another project's, None for no name."""
    if node.get("refdomain") != "py":
        return None
    target = node["reftarget"]
    names = (f"{node.get('py:module')}.{target}", target)
    found = next((each for each in map(locate, names) if each is not None), None)
    home = getattr(found, "__module__", None) or ""
    if home.partition(".")[0] != "fotismos" or isinstance(found, TypeVar):
        return text if found is not None else None  # other projects' sites cannot be asked offline
    name = f"{home}.{getattr(found, '__qualname__', target)}"
    page = node["refdoc"]
    return env.domains["py"].resolve_xref(env, page, app.builder, "obj", name, node, text)
