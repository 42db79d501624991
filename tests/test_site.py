"""The documentation as a site: in reading order, each guarantee with its test, links that hold."""

import re
from pydoc import locate

import pytest

from tests.programs import ROOT


@pytest.fixture(scope="module")
def docs():
    """The scripts of the documentation, which import each other from their folder."""
    with pytest.MonkeyPatch.context() as patched:
        patched.syspath_prepend(ROOT / "docs")
        yield


@pytest.fixture(scope="module")
def sources(docs, tmp_path_factory):
    from website import sources

    folder = tmp_path_factory.mktemp("sources")
    sources.gather(folder)
    return folder


def test_the_contents_have_the_order_of_the_list(sources):
    listed = re.findall(r"\]\(([\w-]+)\.\w+\)", (ROOT / "docs/README.md").read_text())
    contents = (sources / "index.md").read_text().partition("```{toctree}")[2]
    assert len(listed) > 15
    assert re.findall(r"^docs/([\w-]+)$", contents, re.MULTILINE) == ["index", *listed]


def test_each_guarantee_leads_to_the_source_of_its_test(sources):
    import guarantees

    page = (sources / "docs/guarantees.md").read_text()
    for each in guarantees.guarantees():
        label = re.search(rf"\[{each.test}\]\(#([^)]+)\)", page)[1]
        text = (sources / f"files/{each.path}.rst").read_text()
        section = text.partition(f".. _{label}:\n")[2].partition("\n.. _")[0]
        assert re.search(rf"(def|class) {each.test}\b", section), each
        assert each.text.replace("`", "``") in section


def test_links_to_modules_name_what_exists(sources):
    pages = [path.read_text() for path in sources.rglob("*.md")]
    names = re.findall(r"\]\(#((?:heuristic|reference|comparisons|reports)\b[\w.]*)\)", str(pages))
    assert len(names) > 50
    assert [name for name in names if locate(name) is None] == []
    assert "heuristic.terms.specular" in names  # by the index of equations
    assert "heuristic.kernel.shade" in names  # by its other name, heuristic.shade


def test_every_equation_of_the_models_can_be_drawn(docs):
    from website import typeset

    page = (ROOT / "docs/models.md").read_text()
    found = [a or b for a, b in re.findall(r"\$\$(.+?)\$\$|\$([^$\n]+?)\$", page)]
    assert len(found) > 20
    assert all(typeset.svg(each).count("M") >= 1 for each in found)
