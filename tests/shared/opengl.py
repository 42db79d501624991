"""Whether shaders in GLSL can be run here."""

import pytest

from fotismos.heuristic.errors import InstallationError
from fotismos.heuristic.glsl.opengl import context


def without_opengl():
    """Return why no shader can be run here; empty where one can."""
    try:
        context()
    except InstallationError as error:
        return str(error)
    return ""


MISSING = without_opengl()
opengl = pytest.mark.skipif(bool(MISSING), reason=MISSING)
