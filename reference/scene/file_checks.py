"""Scene files, looked at before Mitsuba's parser reads them: it recurses, and can be made to crash.

No more is checked than what would end the process or never end; all else is Mitsuba's to refuse.
"""

import re
from pathlib import Path

from heuristic.errors import InputError

DEEPEST = 100
"""Elements within elements. Scenes need about ten; the parser's stack is full at some thousands."""

TAG = re.compile(r"""<(/?)[A-Za-z_](?:"[^"]*"|'[^']*'|[^"'<>])*?(/?)>""")
INCLUDE = re.compile(r"""<include\b[^<>]*?\bfilename\s*=\s*["']([^"']*)["']""")
COMMENT = re.compile(r"<!--.*?(?:-->|\Z)", re.DOTALL)


def included(path: Path) -> list[Path]:
    """Return a scene file and those that it includes, after ensuring that all can be read.

    Raises
    ------
    InputError
        When one is not a file or cannot be read, has a NUL, includes itself, or is too deep.
    """
    found: list[Path] = []
    _check(path, (), found)
    return found


def _check(path: Path, outer: tuple[Path, ...], found: list[Path]) -> None:
    if path.resolve() in outer:
        raise InputError(f"{path}: it includes itself. Take the <include> out that leads back.")
    if len(outer) >= DEEPEST:
        raise InputError(f"{path}: more than {DEEPEST} files include each other.")
    text = _text(path)
    found.append(path.resolve())
    depth = 0
    for end, empty in TAG.findall(text):
        depth += -1 if end else 0 if empty else 1
        if depth > DEEPEST:
            raise InputError(
                f"{path}: elements lie more than {DEEPEST} deep in each other. Write it flatter."
            )
    for name in INCLUDE.findall(text):
        inner = path.parent / name
        if inner.is_file():  # else Mitsuba looks elsewhere, or says what is missing
            _check(inner, (*outer, path.resolve()), found)


def _text(path: Path) -> str:
    """Return a file's text without its comments."""
    if not path.is_file():
        raise InputError(
            f"{path}: there is no such file, or it is no regular one. Give a Mitsuba scene (.xml)."
        )
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}. See that it can be read.") from error
    if b"\0" in content:
        raise InputError(f"{path}: it holds a NUL byte, which no XML file in UTF-8 has.")
    return COMMENT.sub("", content.decode("utf-8", errors="replace"))
