"""The documentation as a site: in reading order, each guarantee with its test, links that hold."""

import csv
import re
from pydoc import locate

import pytest

from docs.figures import guarantees, schemes
from docs.website import api_pages, typeset
from docs.website.sources import gather
from tests.shared.programs import ROOT


@pytest.fixture(scope="module")
def sources(tmp_path_factory):
    folder = tmp_path_factory.mktemp("sources")
    gather(folder)
    return folder


def test_the_contents_have_the_order_of_the_list(sources):
    listed = re.findall(r"\]\(([\w-]+)\.\w+\)", (ROOT / "docs/README.md").read_text())
    contents = (sources / "index.md").read_text().partition("```{toctree}")[2]
    assert len(listed) > 15
    assert re.findall(r"^docs/([\w-]+)$", contents, re.MULTILINE) == ["index", *listed]


def test_each_guarantee_leads_to_the_source_of_its_test(sources):
    page = (sources / "docs/guarantees.md").read_text()
    for each in guarantees.guarantees():
        label = re.search(rf"\[{each.test}\]\(#([^)]+)\)", page)[1]
        text = (sources / f"files/{each.path}.rst").read_text()
        section = text.partition(f".. _{label}:\n")[2].partition("\n.. _")[0]
        assert re.search(rf"(def|class) {each.test}\b", section), each
        assert each.text.replace("`", "``") in section


def test_links_to_modules_name_what_exists(sources):
    pages = [path.read_text() for path in sources.rglob("*.md")]
    names = re.findall(r"\]\(#(fotismos\.[\w.]*)\)", str(pages))
    assert len(names) > 50
    assert [name for name in names if locate(name) is None] == []
    assert "fotismos.heuristic.terms.specular" in names  # by the index of equations
    assert "fotismos.heuristic.kernel.shade" in names  # by its other name, fotismos.heuristic.shade


def test_every_equation_of_the_models_can_be_drawn():
    page = (ROOT / "docs/models.md").read_text()
    found = [a or b for a, b in re.findall(r"\$\$(.+?)\$\$|\$([^$\n]+?)\$", page)]
    assert len(found) > 20
    assert all(typeset.svg(each).count("M") >= 1 for each in found)


def numbers(text):
    """The numbers of equations or figures in a text, one by one: 6.8-6.10 are three."""
    found = re.findall(r"\b([68])\.(\d+)(?:[-–]\1\.(\d+))?", text)
    return [f"{c}.{n}" for c, low, high in found for n in range(int(low), int(high or low) + 1)]


def index(heading):
    """The rows of an index of the models: numbers, and what is said of them."""
    page = (ROOT / "docs/models.md").read_text().partition(f"\n## The index of {heading}\n")[2]
    return re.findall(r"^\| ([68]\.[^|]*) \| (.*) \|$", page.partition("\n## ")[0], re.MULTILINE)


@pytest.mark.parametrize(
    ("heading", "eighth", "sixth"), [("equations", 12, 38), ("figures", 11, 14)]
)
def test_an_index_has_each_number_of_both_chapters_once(heading, eighth, sixth):
    listed = [number for row, _ in index(heading) for number in numbers(row)]
    assert sorted(listed) == sorted(numbers(f"8.1-8.{eighth} 6.1-6.{sixth}"))


def anchors(text):
    """The anchors of a page's headings."""
    found = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in found}


def test_what_the_chapters_name_is_a_scene_an_equation_or_a_section():
    from fotismos.comparisons.gallery.builtin import SCENES

    with (ROOT / "docs/data/chapters.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.reader(file))[1:]
    assert len(rows) > 30
    shown = set()
    for named, where, here in rows:
        assert set(numbers(where)) <= set(numbers("8.1-8.12 6.1-6.38")), named
        for place in here.split(", "):
            page, _, anchor = place.partition("#")
            if anchor:
                assert anchor in anchors((ROOT / "docs" / page).read_text()), named
            elif place not in SCENES:
                assert (ROOT / "docs" / place).is_file(), named
            shown.add(place)
    assert {"emission", "mirror", "fall-offs", "far-lamp", "vertex-normals"} <= shown


def test_the_home_of_an_equation_names_it():
    for row, home in index("equations"):
        ((words, path),) = re.findall(r"\[`(.*)`\]\(\.\./(.*?)\)", home)
        assert set(numbers(row)) <= set(numbers(locate(api_pages.name(path, words)).__doc__)), row


def test_every_figure_is_a_scene_or_drawn():
    from fotismos.comparisons.gallery.builtin import SCENES

    drawn = []
    for name, panels in schemes.SHEETS.items():
        picture = (ROOT / f"docs/models-{name}.svg").read_text()
        assert [title for title in panels if f"<!-- {title} -->" not in picture] == []
        drawn += numbers(" ".join(title.partition("  ")[0] for title in panels))
    for row, where in index("figures"):
        scenes = re.findall(r"`(.*?)`", where)
        assert set(scenes) <= set(SCENES)
        assert scenes or set(numbers(row)) <= set(drawn), row
