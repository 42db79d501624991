"""The tutorial as a page: its cells, and the output that is kept in the notebook."""

from base64 import b64decode
from pathlib import Path

import nbformat


def page(path: Path) -> tuple[str, dict[str, bytes]]:
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
