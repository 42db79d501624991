"""The documentation as a site: whole, in reading order, offline, each guarantee with its test."""

import re
from html import unescape
from html.parser import HTMLParser

import pytest

from tests.programs import ROOT, python

BUILD = f"""
import sys
from pathlib import Path
sys.path.insert(0, {str(ROOT / "docs")!r})
import heuristic
from website import build
raise SystemExit(build.build(Path(sys.argv[1])))
"""


class Page(HTMLParser):
    """The links, what is loaded, the identifiers and the text of a page."""

    def __init__(self, path):
        super().__init__()
        self.links, self.loaded, self.ids = [], [], set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag, attributes):
        found = dict(attributes)
        self.ids.add(found.get("id"))
        if tag == "a":
            self.links.append(found.get("href", ""))
        elif tag in ("img", "script", "link"):
            self.loaded.append(found.get("src") or found.get("href") or "")


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The site; warnings, such as a link to nothing, would have ended its building."""
    folder = tmp_path_factory.mktemp("site")
    done = python("-c", BUILD, folder)
    assert (done.returncode, done.stderr) == (0, "")
    return folder


def test_the_sidebar_has_the_order_of_the_list(site):
    listed = re.findall(r"\]\(([\w-]+)\.\w+\)", (ROOT / "docs/README.md").read_text("utf-8"))
    links = [link for link in Page(site / "index.html").links if link.startswith("docs/")]
    assert len(listed) > 20
    assert [f"docs/{name}.html" for name in listed] == [
        link for link in dict.fromkeys(links) if link in {f"docs/{name}.html" for name in listed}
    ]


def test_each_guarantee_leads_to_the_source_of_its_test(site, monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "docs")
    import guarantees

    links = Page(site / "docs/guarantees.html").links
    for each in guarantees.guarantees():
        name = each.test.replace("_", "-")
        (link,) = (link for link in links if link.endswith(f"/{each.path}.html#{name}"))
        page = (site / "docs" / link.partition("#")[0]).read_text("utf-8")
        section = page.partition(f'id="{name}"')[2].partition("</section>")[0]
        assert f"def {each.test}(" in unescape(re.sub(r"<[^>]*>", "", section)), link


def test_equations_lead_to_the_functions_that_compute_them(site):
    links = Page(site / "docs/models.html").links
    assert "../api/heuristic.html#heuristic.terms.specular" in links
    assert "heuristic.terms.specular" in Page(site / "api/heuristic.html").ids


def test_nothing_is_loaded_from_elsewhere(site):
    pages = list(site.rglob("*.html"))
    assert len(pages) > 100
    assert [name for path in pages for name in Page(path).loaded if "//" in name] == []
