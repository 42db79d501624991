"""Pages of files outside the API that our pages link to: tests, shaders, scenes, schemas."""

import ast
from functools import cache
from pathlib import PurePosixPath
from textwrap import indent

from docs.figures.documents import ROOT
from docs.figures.guarantees import Guarantee, guarantees

LANGUAGES = {
    ".py": "python", ".json": "json", ".toml": "toml", ".glsl": "glsl", ".xml": "xml",
    ".csv": "text", ".cff": "yaml", ".sh": "bash",
}  # fmt: skip


@cache
def shown() -> dict[str, Guarantee]:
    """Return all guarantees by the labels of the tests that show them."""
    return {f"{PurePosixPath(each.path).stem}.{each.test}": each for each in guarantees()}


def label(path: str, words: str) -> str:
    """Return the label of the test that a link's text names; empty if there is none."""
    found = f"{PurePosixPath(path).stem}.{words}"
    return found if found in shown() else ""


def page(path: str) -> str:
    """Return the page of a file: each test in it that shows a guarantee, then the whole file."""
    text = (ROOT / path).read_text(encoding="utf-8")
    tests = {key: each for key, each in shown().items() if each.path == path}
    parts = [":orphan:", heading(path, "=")]
    for key, each in tests.items():
        words = each.test.removeprefix("test_").replace("_", " ").capitalize()
        parts += [f".. _{key}:", heading(words, "-"), each.text.replace("`", "``")]
        parts.append(code(*source(text, each.test)))
    if tests:
        parts.append(heading("The whole file", "-"))
    return "\n\n".join([*parts, code(text, 1, LANGUAGES[PurePosixPath(path).suffix])])


def source(text: str, name: str) -> tuple[str, int]:
    """Return the source of a test with its decorators, and the line where it begins."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and node.name == name:
            first = min(each.lineno for each in (node, *node.decorator_list))
            return "\n".join(text.splitlines()[first - 1 : node.end_lineno]), first
    raise ValueError(f"there is no test {name}")


def heading(words: str, line: str) -> str:
    """Return a heading of reStructuredText."""
    return f"{words}\n{line * len(words)}"


def code(text: str, first: int, language: str = "python") -> str:
    """Return a block of code with numbered lines."""
    options = f"   :linenos:\n   :lineno-start: {first}\n"
    return f".. code-block:: {language}\n{options}\n{indent(text, '   ')}\n"
