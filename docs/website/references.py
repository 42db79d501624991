"""Resolves references to names that are documented where they are defined, not imported."""

from pydoc import locate

from docutils.nodes import Element
from sphinx.addnodes import pending_xref
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment
from website.api_pages import ROOMS


def setup(app: Sphinx) -> dict[str, bool]:
    """Register with Sphinx."""
    app.connect("missing-reference", resolved)
    return {"parallel_read_safe": True}


def resolved(
    app: Sphinx, env: BuildEnvironment, node: pending_xref, text: Element
) -> Element | None:
    """Return a link to one of our names, plain text for another project's, None for no name."""
    if node.get("refdomain") != "py":
        return None
    target = node["reftarget"]
    found = locate(f"{node.get('py:module')}.{target}") or locate(target)
    home = getattr(found, "__module__", None) or ""
    if home.partition(".")[0] not in ROOMS:
        return text if found else None  # the sites of others are not at hand offline
    name = f"{home}.{found.__qualname__}"
    page = node["refdoc"]
    return env.domains["py"].resolve_xref(env, page, app.builder, "obj", name, node, text)
