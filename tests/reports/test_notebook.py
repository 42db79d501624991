"""A comparison in a notebook."""

from base64 import b64decode
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from html.parser import HTMLParser
from io import BytesIO

import mitsuba as mi
import nbformat
import numpy as np
import pytest
from nbclient import NotebookClient
from PIL import Image

import fotismos
from fotismos.comparisons.case import open_case
from fotismos.comparisons.compare import compare
from fotismos.comparisons.options import Options
from fotismos.comparisons.steps import TERMS
from fotismos.heuristic.errors import InputError
from fotismos.reference.records import Missing
from fotismos.reports.notebook import Shown
from tests.shared.programs import ROOT

CELL = """
from fotismos import compare
import mitsuba as mi
shown = compare(mi.cornell_box(), name="box <b>", spp=16, resolution=(16, 16))
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
    assert shown["data"]["text/plain"].startswith("Textbook shading differs visibly in")
    ((tag, attributes),) = tags_of(shown["data"]["text/html"])
    assert (tag, attributes["sandbox"]) == ("iframe", "allow-scripts")
    page = attributes["srcdoc"]
    pictures = [one for tag, one in tags_of(page) if tag == "img" and "hidden" not in one]
    # The small ones of the row have no words.
    captions = [one["alt"].rpartition(", ")[2] for one in pictures if one["alt"]]
    assert captions[:3] == ["Textbook shading", "Physical picture", "ΔE2000"]
    assert captions[3:] == ["emission term", "diffuse term", "sum of the terms"]
    assert "box <b>" not in page
    assert "box &lt;b&gt;" in page


@pytest.fixture(scope="module")
def shown():
    """A sphere in front of nothing, wider than high so that no column passes for a row."""
    case = open_case("fig-8-9", Options(spp=4, resolution=(24, 16)))
    return Shown(compare(case.source, case.options, then=[TERMS]), page="")


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
    flat = replace(shown.comparison, terms=Missing("Flat shading has none."))
    with pytest.raises(InputError, match=r"there are no terms. Flat shading has none"):
        Shown(flat, shown.page).at(12, 8)


def small(name="box"):
    return fotismos.compare(mi.cornell_box(), name, why=False, spp=4, resolution=(16, 16))


@pytest.mark.thorough
def test_the_users_variant_is_given_back_after_success_and_error(spectral):
    scene = mi.load_dict({"type": "scene", "ball": {"type": "sphere"}})
    small()
    assert mi.variant() == "llvm_ad_spectral"
    with pytest.raises(InputError):
        fotismos.fit("no such scene")
    assert mi.variant() == "llvm_ad_spectral"
    assert scene.ray_intersect(mi.Ray3f((0, 0, -3), (0, 0, 1))).is_valid()


@pytest.mark.thorough
def test_comparisons_in_threads_are_those_of_one_thread(rgb):
    alone = small().comparison.images.reference
    with ThreadPoolExecutor(2) as threads:
        together = list(threads.map(small, ["a", "b"]))
    for shown in together:
        # Threads may add a pixel's samples in another order.
        np.testing.assert_allclose(shown.comparison.images.reference, alone, atol=1e-5)


@pytest.mark.parametrize("significance", [0, 1, float("nan"), "x"])
def test_an_impossible_significance_is_refused(rgb, baselines_folder, significance):
    (path, *_) = baselines_folder.glob("*.exr")
    with pytest.raises(InputError, match=r"significance = .* above 0 and below 1"):
        fotismos.check(path, significance)


def test_a_folder_of_several_baselines_is_refused(rgb, baselines_folder):
    with pytest.raises(InputError, match=r"has 2 baselines\. Give the file of one"):
        fotismos.check(baselines_folder)


def test_a_scene_of_another_type_is_refused(rgb):
    for scene in (None, 5, [1], mi.load_dict({"type": "scene"})):
        with pytest.raises(InputError, match=f"a scene of type {type(scene).__name__} is not"):
            fotismos.compare(scene)


def test_what_is_no_declaration_is_refused():
    with pytest.raises(InputError, match="'phong' of type str cannot be declared"):
        fotismos.declare("phong")


def test_a_shader_is_read_again_by_each_comparison(rgb, written, tmp_path):
    """What it reads may have changed since the last one, in the same process."""
    path = tmp_path / "level"
    name = written(
        f"import numpy as np\nlevel = float(np.loadtxt({str(path)!r}))\n"
        "def shade(point): return point.ambient * 0 + level\n"
    )
    means = []
    for level in ("0.25", "0.75"):
        path.write_text(level)
        shown = fotismos.compare(
            "lambert-sphere", why=False, heuristic=name, resolution=(8, 8), spp=4
        )
        means.append(shown.comparison.images.heuristic.max())
    assert means == [0.25, 0.75]
