"""The documentation keeps to the code: the index, links, commands, and the notebook."""

import importlib.util
import re
import shlex
from urllib.parse import unquote

import click
import nbformat
import pytest
from markdown_it import MarkdownIt
from nbclient import NotebookClient

from reports import cli
from tests.programs import ROOT
from tests.witnesses import page, test_povray

PAGES = [*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").glob("*.md"))]
OF_RUN = {"test", "lint", "bench", "docs"}


@pytest.fixture(scope="module")
def make():
    specification = importlib.util.spec_from_file_location("docs_make", ROOT / "docs/make.py")
    module = importlib.util.module_from_spec(specification)
    specification.loader.exec_module(module)
    return module


def part_of(page, name, make):
    begin, end = make.marks(name)
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    return text.partition(begin)[2].partition(end)[0].strip().splitlines()


def test_the_index_of_equations_is_that_of_the_docstrings(make):
    assert part_of("models.md", "equations", make) == list(make.equation_table())


def test_the_list_of_guarantees_is_that_of_the_tests(make, monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "docs")
    guarantees = importlib.import_module("guarantees")
    listed = part_of("guarantees.md", "guarantees", make)
    assert listed == "\n".join(guarantees.lines()).strip().splitlines()
    assert {each.area for each in guarantees.guarantees()} == set(guarantees.AREAS)


def test_the_rules_of_pruning_are_those_of_the_code(make):
    assert part_of("plans.md", "rules", make) == list(make.rules())


def test_the_worked_example_has_been_made(make):
    rows = part_of("reading.md", "example", make)
    assert [row.split(" | ")[-1] for row in rows[2:4]] == ["16 |", "256 |"]


def test_a_part_is_replaced_and_the_rest_stays(make, tmp_path, monkeypatch):
    monkeypatch.setattr(make, "DOCS", tmp_path)
    begin, end = make.marks("x")
    (tmp_path / "page.md").write_text(f"before\n\n{begin}\nold\n{end}\n\nafter\n")
    make.replace("page.md", "x", ["new"])
    expected = f"before\n\n{begin}\n\nnew\n\n{end}\n\nafter\n"
    assert (tmp_path / "page.md").read_text() == expected


def links(page):
    tokens = MarkdownIt().enable("table").parse(page.read_text(encoding="utf-8"))
    for token in tokens:
        for child in token.children or ():
            target = child.attrGet("href") or child.attrGet("src")
            if target and not re.match(r"https?://", target):
                yield unquote(target)


def headings(page):
    """The anchors of a page, as code hosts make them of headings."""
    found = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in found}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    for target in links(page):
        path, _, anchor = target.partition("#")
        place = page.parent / path if path else page
        assert place.exists(), target
        if anchor:
            assert anchor in headings(place), target


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_commands_in_examples_exist_with_their_options(page):
    blocks = MarkdownIt().parse(page.read_text(encoding="utf-8"))
    code = "\n".join(b.content for b in blocks if b.type in ("fence", "code_block"))
    for line in code.splitlines():
        if not line.startswith(("./run ", "fotismos ")):
            continue
        words = shlex.split(line, comments=True)
        if words[1] not in OF_RUN:
            command = cli.cli.get_command(click.Context(cli.cli), words[1])
            assert command, line
            command.make_context(words[1], words[2:])


def test_the_notebook_runs():
    notebook = nbformat.read(ROOT / "docs/tutorial.ipynb", as_version=4)
    client = NotebookClient(notebook, timeout=60, resources={"metadata": {"path": str(ROOT)}})
    client.execute()  # raises where a cell does
    printed = "".join(
        output.get("text", "") for cell in notebook.cells for output in cell.get("outputs", ())
    )
    assert "mean ΔE2000" in printed
    shown = [out for cell in notebook.cells for out in cell.get("outputs", ()) if "data" in out]
    assert sum("image/png" in out["data"] for out in shown) == 2


def test_the_notebook_is_kept_with_its_pictures_and_small():
    path = ROOT / "docs/tutorial.ipynb"
    text = path.read_text(encoding="utf-8")
    assert text.count('"image/png"') == 2
    assert '"text/html"' not in text
    assert path.stat().st_size < 400_000


def test_the_witnesses_of_the_page_are_those_of_the_suite(make):
    rows = [line.split(" | ") for line in part_of("witnesses.md", "closed forms", make)[2:]]
    shown = [(row[0].removeprefix("| "), *row[1:3]) for row in rows]
    assert shown == page.declared()
    assert part_of("witnesses.md", "elsewhere", make) == list(page.elsewhere())
    figures = part_of("witnesses.md", "figures", make)[2:]
    names = [line.split(" | ")[0].removeprefix("| ") for line in figures]
    assert names == test_povray.FIGURES + test_povray.OTHERS
