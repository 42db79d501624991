"""Which folder the results of a scene go to: the same one each time, and one scene's alone."""

import os
import pkgutil
import unicodedata
from collections.abc import Iterable
from pathlib import Path

import reports.commands
from comparisons.case import file_of, name_of
from reports.files import listing

TABLES, FIGURES = "tables", "figures"
"""Folders of a run beside those of its scenes."""

PAGE, RUN = "index.html", "run.json"

RESERVED = frozenset(
    {TABLES, FIGURES, PAGE, RUN, "assets", "departures"}
    | {module.name for module in pkgutil.iter_modules(reports.commands.__path__)}
)
"""Names that no scene's folder takes."""

LONGEST = 100
"""Bytes of a name: what is written there has longer ones."""

Wanted = tuple[str, Path | None]
"""A name, and the file that it is of; None for what is built in."""


def places(folder: Path, scenes: Iterable[str]) -> dict[str, str]:
    """Return the names of the folders for some scenes, with the words that name the scenes.

    A folder is of one scene, which finds it again in every later command.

    Raises
    ------
    InputError
        For a scene that is not there.
    OutputError
        When the folder's list cannot be written to.
    """
    scenes = list(scenes)
    found = assigned(folder, [(name_of(scene), file_of(scene)) for scene in scenes])
    return dict(zip(found, scenes, strict=True))


def assigned(folder: Path, wanted: Iterable[Wanted]) -> list[str]:
    """Return a folder's name for each of some results, and note in ``folder`` what they are of.

    Raises
    ------
    OutputError
        When that cannot be noted.
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
    """Return the folder that is the subject's already, or else a new one."""
    own = {place for place, of in known.items() if of == subject} - found.keys()
    if own:
        return min(own, key=lambda place: (len(place), place))
    return folder_name(name, known.keys() | found.keys())


def _folded(name: str) -> str:
    """Return a name as file systems see it that do not tell case or composition apart."""
    return unicodedata.normalize("NFC", name).casefold()


def _subject(name: str, file: Path | None, folder: Path) -> str:
    """Return what a result is of: its file as seen from the folder, so that both may move."""
    if file is None:
        return f"built-in {name}"
    return os.path.relpath(file.resolve(), folder.resolve())
