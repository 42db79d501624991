"""A comparison in a notebook."""

from base64 import b64decode
from html.parser import HTMLParser
from io import BytesIO

import nbformat
from nbclient import NotebookClient
from PIL import Image

from tests.programs import ROOT

CELL = """
from reports.notebook import compare
import mitsuba as mi
shown = compare(mi.cornell_box(), name="box <b>", spp=4, resolution=(16, 16))
print(shown.comparison.record.resolution)
shown
"""


def test_a_notebook_shows_the_view_of_the_page_in_a_frame(monkeypatch, tmp_path):
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    monkeypatch.setenv("JUPYTER_PLATFORM_DIRS", "1")
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(CELL)])
    NotebookClient(notebook, timeout=120, resources={"metadata": {"path": tmp_path}}).execute()
    printed, shown = notebook.cells[0].outputs
    assert printed["text"] == "(16, 16)\n"
    picture = Image.open(BytesIO(b64decode(shown["data"]["image/png"])))
    assert picture.width > 2 * picture.height
    assert shown["data"]["text/plain"] == "Shown()"
    tags = []
    parser = HTMLParser()
    parser.handle_starttag = lambda tag, attributes: tags.append((tag, dict(attributes)))
    parser.feed(shown["data"]["text/html"])
    ((tag, attributes),) = tags
    assert (tag, attributes["sandbox"]) == ("iframe", "allow-scripts")
    page = attributes["srcdoc"]
    assert page.lstrip().startswith("<!")
    assert page.count('src="data:image/webp') == 3
    assert "box <b>" not in page
    assert "box &lt;b&gt;" in page
