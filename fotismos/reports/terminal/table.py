"""Tables: columns with their meaning, rows of values, and the forms in which they are written.

A table is printed on a terminal and in JUnit files, shown on a page by the macro ``table_of``, and
written as Markdown and CSV.
"""

import csv
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from io import StringIO
from operator import attrgetter, itemgetter
from shutil import get_terminal_size
from typing import Any, NamedTuple

from rich.cells import cell_len
from rich.console import Console
from rich.table import Table as RichTable
from rich.text import Text

from fotismos.reports.glossary import meanings
from fotismos.reports.terminal.words import visible

WIDTH = 120
"""Characters per line of a printed table; longer cells are folded."""

GAP = 2
"""Characters between two columns."""

Form = Callable[[Any], str]
"""How the numbers of a column are written."""


class Piece(NamedTuple):
    """A part of what a cell shows, with the number in full if it is one."""

    number: float | None
    text: str


@dataclass(frozen=True)
class Column:
    """A column: its heading, what it shows ``of`` a row, and the form of numbers.

    ``of`` is a function, or the name of an attribute such as ``ratio.value``. It gives a text, a
    number, an interval, of which both ends are shown, or several of these. On a terminal, columns
    stand left unless they are to stand right. On a page, numbers stand right, and texts left. The
    heading is a term of the glossary where it needs an explanation; its ``detail`` is none.

    Where there is too little room, columns are left out, the largest ``rank`` first; those of rank
    0 stay. A column with a ``fold`` needs no more characters than that, and folds longer cells.
    """

    heading: str
    of: str | Callable[[Any], Any]
    form: Form | None = None
    detail: str = ""
    is_right: bool = False
    rank: int = 0
    fold: int = WIDTH

    @property
    def is_text(self) -> bool:
        """Whether its cells are texts: it has no form of numbers."""
        return self.form is None and not self.is_right

    @property
    def title(self) -> str:
        """The heading with its detail."""
        return f"{self.heading} {self.detail}".rstrip()

    @property
    def meaning(self) -> str:
        """The glossary's sentence on it; empty if it needs none."""
        return meanings().get(self.heading, "")

    def cell(self, row: Any) -> Any:
        """Return what it shows of a row."""
        return attrgetter(self.of)(row) if isinstance(self.of, str) else self.of(row)

    def pieces(self, row: Any) -> list[Piece]:
        """Return the parts of a cell."""
        return self._parts(self.cell(row))

    def _parts(self, cell: Any) -> list[Piece]:
        if isinstance(cell, Piece):
            return [cell]
        if cell is None or isinstance(cell, str):
            return [Piece(None, "–" if cell is None else cell)]
        if isinstance(cell, tuple):
            return [piece for part in cell for piece in self._parts(part)]
        if isinstance(cell, (int, float)):
            text = (self.form or str)(cell)
            return [Piece(None if isinstance(cell, bool) else cell, text)]
        return self._parts((cell.low, " to ", cell.high))

    def text(self, row: Any) -> str:
        """Return a cell as one text."""
        return "".join(piece.text for piece in self.pieces(row))


@dataclass(frozen=True)
class Table:
    """Columns, and rows of which each shows something."""

    columns: Sequence[Column]
    rows: Sequence[Any]

    @classmethod
    def of(cls, rows: Iterable[Sequence[Any]], right: int = 1) -> "Table":
        """Return a table of cells; the first row has the headings.

        Columns from number ``right`` are aligned right.
        """
        headings, *others = rows
        columns = [
            Column(heading, itemgetter(number), is_right=number >= right)
            for number, heading in enumerate(headings)
        ]
        return cls(columns, others)

    def texts(self) -> list[list[str]]:
        """Return the rows as texts, without the headings."""
        return [[column.text(row) for column in self.columns] for row in self.rows]


def room() -> int:
    """Return the characters per line: a terminal's, at most `WIDTH`, and `WIDTH` elsewhere."""
    return min(get_terminal_size((WIDTH, 0)).columns, WIDTH) if sys.stdout.isatty() else WIDTH


def printed(table: Table, width: int = WIDTH) -> Iterator[str]:
    """Yield the lines of a table, the same on a terminal and in a file; what it leaves out, last.

    Columns with a rank whose cells are all empty are left out without a word.
    """
    kept = [column for column in table.columns if not column.rank or _has_text(column, table.rows)]
    left_out = []
    while _needed(kept, table.rows) > width and (last := max(kept, key=lambda c: c.rank)).rank:
        kept.remove(last)
        left_out.append(last.title)
    shown = RichTable(box=None, pad_edge=False, padding=(0, GAP, 0, 0))
    for column in kept:
        justify: Any = "right" if column.is_right else "left"
        # Only what may be folded gives way.
        is_firm = column.fold == WIDTH and any(other.fold < WIDTH for other in kept)
        shown.add_column(column.title, overflow="fold", justify=justify, no_wrap=is_firm)
    # As Text, since rich would read brackets in a string as markup.
    for row in Table(kept, table.rows).texts():
        shown.add_row(*(Text(visible(cell)) for cell in row))
    console = Console(width=width, color_system=None)
    with console.capture() as capture:
        console.print(shown)
    yield from (line.rstrip() for line in capture.get().splitlines())
    if left_out:
        names = ", ".join(reversed(left_out))
        yield f"{names}: not in {width} characters, but in {WIDTH}, and on the page"


def _has_text(column: Column, rows: Sequence[Any]) -> bool:
    return any(column.text(row) for row in rows)


def _needed(columns: Sequence[Column], rows: Sequence[Any]) -> int:
    """Return the characters that columns need, as far as they do not fold."""
    cells = [[column.title, *map(column.text, rows)] for column in columns]
    widths = [
        min(max(map(cell_len, texts)), column.fold)
        for column, texts in zip(columns, cells, strict=True)
    ]
    return sum(widths) + GAP * (len(widths) - 1)


def markdown(table: Table, texts: Sequence[Sequence[str]] | None = None) -> Iterator[str]:
    """Yield the lines of a table in Markdown; ``texts`` stand for its rows, if given."""
    yield _row([column.title for column in table.columns])
    yield _row(["---:" if column.is_right else "---" for column in table.columns])
    for row in table.texts() if texts is None else texts:
        yield _row([cell.replace("|", "\\|") for cell in row])


def _row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def escaped(text: str) -> str:
    """Return text in one line that Markdown shows unchanged; `markdown` escapes bars."""
    # Line breaks go first, or `visible` would print them as escapes. The ampersand goes before
    # "<", whose replacement has one.
    text = visible(" ".join(text.split())).replace("&", "&amp;").replace("<", "&lt;")
    return re.sub(r"([\\`*_\[\]])", r"\\\1", text)


def comma_separated(table: Table) -> str:
    """Return a table as CSV (RFC 4180, lines end with a line feed), with numbers in full.

    Texts that a spreadsheet would compute as formulas begin with an apostrophe.
    """
    rows = [[column.cell(row) for column in table.columns] for row in table.rows]
    text = StringIO()
    csv.writer(text, lineterminator="\n").writerows(
        [*map(_inert, row)] for row in ([column.title for column in table.columns], *rows)
    )
    return text.getvalue()


def _inert(cell: Any) -> Any:
    is_formula = isinstance(cell, str) and cell.startswith(("=", "+", "-", "@", "\t", "\r"))
    return f"'{cell}" if is_formula else cell
