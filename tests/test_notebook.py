"""A comparison in a notebook."""

from base64 import b64decode
from dataclasses import replace
from html.parser import HTMLParser
from io import BytesIO

import nbformat
import numpy as np
import pytest
from nbclient import NotebookClient
from PIL import Image

from comparisons.case import open_case
from comparisons.compare import compare
from comparisons.options import Options
from heuristic.errors import InputError
from reports.notebook import Shown
from tests.programs import ROOT

CELL = """
from fotismos import compare
import mitsuba as mi
shown = compare(mi.cornell_box(), name="box <b>", spp=4, resolution=(16, 16))
print(shown.comparison.record.resolution)
shown
"""


def tags_of(html):
    """Return the tags of a page in order, each with its attributes."""
    tags = []
    parser = HTMLParser()
    parser.handle_starttag = lambda tag, attributes: tags.append((tag, dict(attributes)))
    parser.feed(html)
    return tags


@pytest.mark.thorough
def test_a_notebook_shows_the_view_of_the_page_in_a_frame(monkeypatch, tmp_path):
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    monkeypatch.setenv("JUPYTER_PLATFORM_DIRS", "1")
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(CELL)])
    NotebookClient(notebook, timeout=120, resources={"metadata": {"path": tmp_path}}).execute()
    printed, shown = notebook.cells[0].outputs
    assert printed["text"] == "(16, 16)\n"
    picture = Image.open(BytesIO(b64decode(shown["data"]["image/png"])))
    assert picture.width > 2 * picture.height
    assert shown["data"]["text/plain"].startswith("Textbook shading is visibly wrong in")
    ((tag, attributes),) = tags_of(shown["data"]["text/html"])
    assert (tag, attributes["sandbox"]) == ("iframe", "allow-scripts")
    page = attributes["srcdoc"]
    pictures = [one for tag, one in tags_of(page) if tag == "img" and "hidden" not in one]
    captions = [one["alt"].rpartition(", ")[2] for one in pictures]
    assert captions[:3] == ["Textbook shading", "Physical reference", "ΔE2000"]
    assert captions[3:] == ["emission term", "diffuse term", "sum of the terms"]
    assert "box <b>" not in page
    assert "box &lt;b&gt;" in page


@pytest.fixture(scope="module")
def shown():
    """A sphere in front of nothing, wider than high so that no column passes for a row."""
    case = open_case("fig-8-9", Options(spp=4, resolution=(24, 16)))
    return Shown(compare(case.source, case.options, why=True), page="")


@pytest.mark.parametrize("place", [(12, 8), (9, 5)])
def test_the_terms_at_a_pixel_add_up(shown, place):
    found = shown.at(*place)
    assert found.pixel == place
    parts = [found.emission, found.ambient, found.others]
    parts += [part for light in found.lights for part in (light.diffuse, light.specular)]
    np.testing.assert_allclose(np.sum(parts, axis=0), found.total, rtol=1e-6)


def test_pixels_without_terms_say_why(shown):
    with pytest.raises(InputError, match="pixel 0, 0 sees no surface"):
        shown.at(0, 0)
    with pytest.raises(InputError, match="outside the image"):
        shown.at(24, 0)
    flat = replace(shown.comparison, terms=None, no_terms="Flat shading has none.")
    with pytest.raises(InputError, match=r"there are no terms. Flat shading has none"):
        Shown(flat, shown.page).at(12, 8)
