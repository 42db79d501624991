"""Code is written plainly: one statement per name, records by keyword, imports at the top."""

import ast
from collections.abc import Iterator

from tests.shared.programs import ROOT

FILES = sorted((ROOT / "fotismos").rglob("*.py"))
SCRIPTS = sorted((ROOT / "fotismos/reports/page/templates/viewer").glob("*.js"))
TREES = {path: ast.parse(path.read_text()) for path in FILES}
TRUTHS = (ast.Compare, ast.BoolOp, ast.UnaryOp)


def records() -> set[str]:
    """The names of all dataclasses and records, and of what derives from them."""
    classes = [n for tree in TREES.values() for n in ast.walk(tree) if isinstance(n, ast.ClassDef)]
    names = {"Record"}
    names |= {
        c.name for c in classes if any("dataclass" in ast.unparse(d) for d in c.decorator_list)
    }
    while more := {c.name for c in classes if {ast.unparse(b) for b in c.bases} & names} - names:
        names |= more
    return names


RECORDS = records()


def faults(node: ast.AST, lines: list[str]) -> Iterator[str]:
    """What is wrong with a node, in words."""
    match node:
        case ast.Assign(targets=[ast.Tuple()], value=ast.GeneratorExp()):
            yield "a generator is unpacked into names: write a line for each"
        case ast.Call(func=ast.Name(id=name) | ast.Attribute(attr=name)) if name in RECORDS:
            if any(isinstance(argument, ast.Starred) for argument in node.args):
                yield f"a star in {name}(...): name its fields"
            if len(node.args) > 3:
                yield f"{len(node.args)} positions in {name}(...): name its fields"
        case ast.BinOp(op=ast.Mult(), left=left, right=right):
            is_sequence = isinstance(left, (ast.List, ast.Tuple, ast.JoinedStr))
            is_sequence |= isinstance(left, ast.Constant) and isinstance(left.value, str)
            if is_sequence and isinstance(right, TRUTHS):
                yield "a sequence is multiplied by a condition: write an if"
        case ast.Subscript(slice=ast.Constant(value=int(index))) if index > 2:
            yield f"index {index} into a row: give its parts names"
        case ast.FunctionDef():
            for inner in ast.walk(node):
                ours = isinstance(inner, ast.ImportFrom) and (inner.module or "").startswith(
                    "fotismos"
                )
                text = " ".join(lines[inner.lineno - 1 : inner.end_lineno]) if ours else "#"
                if "#" not in text + lines[inner.lineno - 2 if ours else 0]:
                    yield f"an import in {node.name} without its reason"


def test_code_is_written_plainly():
    found = []
    for path, tree in TREES.items():
        lines = path.read_text().splitlines()
        for node in ast.walk(tree):
            place = f"{path.relative_to(ROOT)}, line {getattr(node, 'lineno', 0)}"
            found += [f"{place}: {fault}" for fault in faults(node, lines)]
    assert found == []


def test_lines_of_scripts_fit_a_window():
    lines = [(path.name, line) for path in SCRIPTS for line in path.read_text().splitlines()]
    assert [(name, line) for name, line in lines if len(line) > 100] == []
