"""Builds the site, offline: from our pages, those of the API, and those of linked files."""

import re
from base64 import b64decode
from collections.abc import Iterator
from pathlib import Path, PurePosixPath
from posixpath import dirname, normpath, relpath
from tempfile import TemporaryDirectory

import nbformat
from sphinx.cmd.build import build_main

from docs.figures import guarantees, lessons
from docs.figures.documents import ROOT
from docs.website import api_pages, file_pages

LINK = re.compile(r"\[(?P<text>[^][]*)\]\((?P<target>[^)\s#]+)(?P<anchor>#[^)\s]*)?\)")
"""A link in Markdown."""

PICTURES = (".png", ".svg", ".webp")

ORDER = "docs/README.md"
"""The page that lists the others in reading order, under headings in bold."""

LESSONS = "docs/lessons.md"
"""The page whose scenes the site shows live."""

GUARANTEES = "docs/guarantees.md"
"""The page to which the site adds each guarantee, with a link to its test."""

PROJECT = ("CONTRIBUTING.md", "CHANGELOG.md")


def build(folder: Path) -> int:
    """Write the site into a folder; return 0 only if no link or docstring has a fault."""
    with TemporaryDirectory() as temporary:
        gather(Path(temporary, "sources"))
        words = ["-b", "html", "-W", "--keep-going", "-q", "-c", str(Path(__file__).parent)]
        trees = ["-d", f"{temporary}/trees"]
        return build_main([*words, *trees, f"{temporary}/sources", str(folder)])


def gather(folder: Path) -> None:
    """Write all sources into a folder: pages where they are, modules in api, others in files."""
    linked: set[str] = set()
    for path in (*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").glob("*.md"))):
        page = path.relative_to(ROOT).as_posix()
        text = path.read_text(encoding="utf-8")
        if page == GUARANTEES:
            text += "\n".join(guarantees.lines())
        text = with_links(text, page, linked)
        if page == "README.md":
            text += "\n".join(contents())
        if page == LESSONS:
            text = lessons.with_pages(text, "../live")
        write(folder / place(page), text)
    for path in (ROOT / "docs").rglob("*"):
        if path.suffix in PICTURES:
            write(folder / path.relative_to(ROOT), path.read_bytes())
    text, pictures = notebook(ROOT / "docs/tutorial.ipynb")
    write(folder / "docs/tutorial.md", with_links(text, "docs/tutorial.ipynb", linked))
    for name, picture in pictures.items():
        write(folder / "docs" / name, picture)
    for name, text in api_pages.pages():
        write(folder / "api" / f"{name}.rst", text)
    for name in sorted(linked):
        write(folder / "files" / f"{name}.rst", file_pages.page(name))


def write(path: Path, content: str | bytes) -> None:
    """Write a file, and the folders that it is in."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content.encode() if isinstance(content, str) else content)


def place(path: str) -> str:
    """Return a page's place in the site: a folder's own page is its index."""
    return path.replace("README.md", "index.md").replace(".ipynb", ".md")


def notebook(path: Path) -> tuple[str, dict[str, bytes]]:
    """Return a notebook in Markdown, and its pictures by file name."""
    parts = []
    pictures: dict[str, bytes] = {}
    for cell in nbformat.read(path, as_version=4).cells:
        is_code = cell.cell_type == "code"
        parts.append(fenced("python", cell.source) if is_code else cell.source)
        for output in cell.get("outputs", ()):
            data = output.get("data", {"text/plain": output.get("text")})
            kind = next(k for k in ("image/png", "image/svg+xml", "text/plain") if k in data)
            if kind == "text/plain":
                parts.append(fenced("text", data[kind].rstrip()))
                continue
            is_svg = kind == "image/svg+xml"
            name = f"{path.stem}-{len(pictures) + 1}.{'svg' if is_svg else 'png'}"
            pictures[name] = data[kind].encode() if is_svg else b64decode(data[kind])
            parts.append(f"![The picture that the cell draws]({name})")
    return "\n\n".join(parts), pictures


def fenced(language: str, text: str) -> str:
    """Return a block of code."""
    return f"```{language}\n{text}\n```"


def with_links(text: str, page: str, linked: set[str]) -> str:
    """Return a page with links that stay in the site.

    Parameters
    ----------
    text
        The page, in Markdown.
    page
        Its path from the root.
    linked
        Files that need a page of their own are added to it.
    """

    def replaced(match: re.Match[str]) -> str:
        words, target, anchor = match["text"], match["target"], match["anchor"] or ""
        path = normpath(f"{dirname(page)}/{target}".lstrip("/"))
        if "://" in target or path.endswith(PICTURES):
            return match[0]
        if path.endswith((".md", ".ipynb")):
            return f"[{words}]({place(target)}{anchor})"
        if path.startswith("fotismos/") and (name := api_pages.name(path, words)):
            return f"[{words}](#{name})"
        if not (ROOT / path).is_file() or path.endswith(".parquet"):
            return words  # the site has no page for a folder
        linked.add(path)
        if test := file_pages.label(path, words):
            return f"[{words}](#{test})"
        return f"[{words}]({relpath(f'files/{path}.rst', dirname(page) or '.')})"

    return LINK.sub(replaced, text)


def contents() -> Iterator[str]:
    """Yield the table of contents, in the order of docs/README.md."""
    yield from tree("", [place(ORDER)])
    _, *parts = re.split(r"^\*\*(.*)\*\*$", (ROOT / ORDER).read_text("utf-8"), flags=re.MULTILINE)
    for heading, text in zip(parts[::2], parts[1::2], strict=True):
        yield from tree(heading, [f"docs/{place(m['target'])}" for m in LINK.finditer(text)])
    yield from tree("Modules", [f"api/fotismos.{room}.rst" for room in api_pages.ROOMS])
    yield from tree("Project", PROJECT)


def tree(caption: str, pages: list[str] | tuple[str, ...]) -> Iterator[str]:
    """Yield a part of the table of contents, which only the sidebar shows."""
    options = (":hidden:", *([f":caption: {caption}"] if caption else []))
    yield from ("", "```{toctree}", *options, "")
    yield from (str(PurePosixPath(page).with_suffix("")) for page in pages)
    yield from ("```", "")
