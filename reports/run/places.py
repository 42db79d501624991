"""The folder of a scene's results: the same each time, and for one scene only."""

import os
import pkgutil
import unicodedata
from collections.abc import Iterable
from pathlib import Path

import reports.commands
from comparisons.case import file_of, name_of
from reports.files import listing

TABLES, FIGURES = "tables", "figures"
"""Folders of a run next to those of its scenes."""

PAGE, RUN = "index.html", "run.json"

RESERVED = frozenset(
    {TABLES, FIGURES, PAGE, RUN, "assets", "departures"}
    | {module.name for module in pkgutil.iter_modules(reports.commands.__path__)}
)
"""Names that no scene's folder may have."""

LONGEST = 100
"""Bytes of a name; those of files that are written there may be longer."""

Wanted = tuple[str, Path | None]
"""A name and its file, None if built in."""


def places(folder: Path, scenes: Iterable[str]) -> dict[str, str]:
    """Return the names of the scenes' folders, with the words that name the scenes.

    A folder belongs to one scene, also in later commands.

    Raises
    ------
    InputError
        If a scene does not exist.
    OutputError
        If the folder's list cannot be written to.
    """
    scenes = list(scenes)
    found = assigned(folder, [(name_of(scene), file_of(scene)) for scene in scenes])
    return dict(zip(found, scenes, strict=True))


def assigned(folder: Path, wanted: Iterable[Wanted]) -> list[str]:
    """Return a folder's name for each result, and list the subjects in ``folder``.

    Raises
    ------
    OutputError
        If the list cannot be written to.
    """
    known = listing.read(folder).places
    found: dict[str, str] = {}
    for name, file in wanted:
        subject = _subject(name, file, folder)
        found[_place(name, subject, known, found)] = subject
    listing.assign(folder, found)
    return list(found)


def folder_name(name: str, taken: Iterable[str] = ()) -> str:
    """Return a name for a folder: plain characters, neither reserved nor taken in any case."""
    folded = {*map(_folded, taken), *RESERVED}
    return next(each for each in _candidates(name) if _folded(each) not in folded)


def _candidates(name: str) -> Iterable[str]:
    composed = unicodedata.normalize("NFC", name)
    plain = "".join(c if c.isalnum() or c in "-_." else "-" for c in composed)
    plain = plain.encode(errors="replace")[:LONGEST].decode(errors="ignore").strip(".") or "scene"
    yield plain
    number = 1
    while True:
        number += 1
        yield f"{plain}-{number}"


def _place(name: str, subject: str, known: dict[str, str], found: dict[str, str]) -> str:
    """Return the subject's folder, or else a new one."""
    own = {place for place, of in known.items() if of == subject} - found.keys()
    if own:
        return min(own, key=lambda place: (len(place), place))
    return folder_name(name, known.keys() | found.keys())


def _folded(name: str) -> str:
    """Return a name as seen by file systems that ignore case and composition."""
    return unicodedata.normalize("NFC", name).casefold()


def _subject(name: str, file: Path | None, folder: Path) -> str:
    """Return a result's subject: its file relative to the folder, so both may move."""
    if file is None:
        return f"built-in {name}"
    return os.path.relpath(file.resolve(), folder.resolve())
