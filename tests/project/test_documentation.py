"""The documentation keeps to the code: its links resolve, its commands and programs run."""

import re
import shlex
from urllib.parse import unquote

import click
import nbformat
import pytest
from markdown_it import MarkdownIt
from matplotlib.collections import PathCollection
from nbclient import NotebookClient
from pyarrow import csv, parquet

from docs.figures import accuracy, charts, engines
from fotismos.comparisons.case import open_case
from fotismos.comparisons.options import Options
from fotismos.reports import cli
from fotismos.reports.terminal.words import number
from tests.shared.programs import ROOT, python

PAGES = [
    *sorted(ROOT.glob("*.md")),
    *sorted((ROOT / "docs").glob("*.md")),
    ROOT / "findings/README.md",
]
OF_RUN = {"test", "lint", "bench", "docs"}


def links(page):
    tokens = MarkdownIt().enable("table").parse(page.read_text())
    for token in tokens:
        for child in token.children or ():
            target = child.attrGet("href") or child.attrGet("src")
            if target and not re.match(r"https?://", target):
                yield unquote(target)


def headings(page):
    """The anchors of a page, as code hosts make them of headings."""
    found = re.findall(r"^#+ (.*)$", page.read_text(), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in found}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    for target in links(page):
        path, _, anchor = target.partition("#")
        place = page.parent / path if path else page
        assert place.exists(), target
        if anchor:
            assert anchor in headings(place), target


@pytest.mark.parametrize("page", ["docs/architecture.md", "CONTRIBUTING.md"])
def test_guides_to_the_code_name_what_it_has(page):
    code = (path.read_text() for path in (ROOT / "fotismos").rglob("*.py"))
    known = set(re.findall(r"\w+", "\n".join(code)))
    prose = re.sub(r"```.*?```", "", (ROOT / page).read_text(), flags=re.DOTALL)
    named = re.findall(r"`([A-Za-z_][\w.]*)(?:\([^`]*\))?`", prose)
    assert named
    assert [name for name in named if not set(name.split(".")) <= known] == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_commands_in_examples_exist_with_their_options(page):
    blocks = MarkdownIt().parse(page.read_text())
    code = "\n".join(b.content for b in blocks if b.type in ("fence", "code_block"))
    pattern = r"^ *(?:- (?:run: )?)?((?:\./run|fotismos|fotismos/run) .*)"
    for line in re.findall(pattern, code, re.MULTILINE):
        words = shlex.split(line, comments=True)
        if words[1] not in OF_RUN:
            command = cli.cli.get_command(click.Context(cli.cli), words[1])
            assert command, line
            command.make_context(words[1], words[2:])


@pytest.mark.thorough
def test_the_notebook_runs():
    notebook = nbformat.read(ROOT / "docs/tutorial.ipynb", as_version=4)
    client = NotebookClient(notebook, timeout=60, resources={"metadata": {"path": str(ROOT)}})
    client.execute()  # raises where a cell does
    shown = [output for cell in notebook.cells for output in cell.get("outputs", ())]
    assert any("mean ΔE2000" in output.get("text", "") for output in shown)
    assert sum("image/png" in output.get("data", ()) for output in shown) == 2


def test_the_readmes_example_runs(tmp_path):
    (code,) = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.DOTALL)
    done = python("-c", code + "print(colour)", cwd=tmp_path, PYTHONWARNINGS="error")
    assert (done.returncode, done.stderr) == (0, "")
    # k_a + k_d (N.L) with N.L = 4 / 5; the mirror direction is as far off the viewer, to the ninth.
    expected = [0.3 + k_d * 0.8 + 0.7 * 0.8**9 for k_d in (0.5, 0.4, 0.3)]
    found = [float(number) for number in re.findall(r"[\d.]+", done.stdout)]
    assert all(abs(a - b) < 1e-5 for a, b in zip(found, expected, strict=True))


def test_the_scenes_of_studies_open_without_values():
    page = (ROOT / "docs/accuracy.md").read_text()
    for path in accuracy.LARGER:
        assert f"scenes/{path.name}" in page
        case = open_case(str(path), Options())
        assert case.source.name == path.stem


def test_the_page_of_engines_has_the_numbers_of_its_files():
    rows = csv.read_csv(ROOT / "docs/engines.csv").to_pylist()
    assert rows == parquet.read_table(ROOT / "docs/engines.parquet").to_pylist()
    served = {
        (method.name, scene)
        for method, lights in engines.APPROXIMATIONS.items()
        for scene, (_, light) in engines.SCENES.items()
        if light in lights
    }
    assert {(row["approximation"], row["scene"]) for row in rows} == served
    page = (ROOT / "docs/engines.md").read_text()
    for part in ("table", "bias"):
        table = page.split(f"<!-- {part}")[1].split("<!-- end")[0]
        rows_of_page = [line.strip("| ").split(" | ") for line in table.splitlines()]
        lines = {cells[0]: cells for cells in rows_of_page}
        for row in rows:
            if part == "bias" and row["approximation"] in ("no interreflection", "path tracing"):
                continue  # physical pictures: their direct light has no bias
            cells = lines[row["approximation"]]
            cell = cells[list(engines.SCENES).index(row["scene"]) + 1]
            stops = f"{row['stops_direct']:+.2f}/{row['stops']:+.2f}"
            assert cell == (stops if part == "bias" else number(row["de2000"]))


@pytest.mark.parametrize("name", charts.CHARTS)
def test_a_chart_shows_each_row_of_its_table(name):
    assert (ROOT / f"docs/{name}.svg").is_file()
    panels = charts.CHARTS[name]().axes
    clouds = [one for axes in panels for one in axes.collections if isinstance(one, PathCollection)]
    lines = [line for axes in panels for line in axes.lines if line.get_marker() == "o"]
    drawn = sum(len(cloud.get_offsets()) for cloud in clouds)
    drawn += sum(len(line.get_xdata()) for line in lines)
    rows = [row for row in charts.read(name) if row.get("threshold") != "most samples"]
    passing = [row for row in rows if row.get(charts.TIME) != ""]
    marks = {"gates": 2 * len(charts.GATES), "fits": 2}.get(name, 1)
    assert drawn == marks * len(passing)
