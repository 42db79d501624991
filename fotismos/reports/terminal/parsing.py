"""How words of the command line become values."""

import math
import re
from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem

from fotismos.comparisons.gallery.builtin import SCENES
from fotismos.heuristic import llvm
from fotismos.heuristic.errors import unknown

FILE = click.Path(path_type=Path, dir_okay=False)


def resolution(text: str) -> tuple[int, int]:
    """Parse ``WIDTHxHEIGHT``, two integers of at least 1."""
    sides = re.fullmatch(r"(?i)0*([1-9]\d*)x0*([1-9]\d*)", text)
    if sides is None:
        raise click.BadParameter(
            f"{text!r} is not a resolution; write it like 512x512, with sides of at least 1."
        )
    return int(sides[1]), int(sides[2])


def definition(text: str) -> tuple[str, str]:
    """Parse ``NAME=VALUE``, such as for a placeholder ``$NAME`` of a scene file."""
    name, separator, value = text.partition("=")
    if not (separator and name):
        raise click.BadParameter(f"{text!r} is not a definition; write it like name=value.")
    return name, value


def parameter(text: str) -> tuple[str, float | bool | str]:
    """Parse ``NAME=VALUE``: a number, ``true`` or ``false``, or else a word."""
    name, separator, value = text.partition("=")
    if not (separator and name and value):
        raise click.BadParameter(f"{text!r} is not a parameter; write it like alpha=0.1.")
    try:
        return name, float(value)
    except ValueError:
        return name, {"true": True, "false": False}.get(value, value)


def share_of(text: str) -> float:
    """Return the share from 0 to 1 of a percentage, with or without its sign; NaN for others."""
    digits, _, rest = text.strip().partition("%")
    try:
        share = float(digits) / 100.0
    except ValueError:
        return math.nan
    return share if not rest and 0.0 <= share <= 1.0 else math.nan


def percentage(text: str) -> float:
    """Parse a percentage of the command line as a share; see :func:`share_of`."""
    share = share_of(text)
    if math.isnan(share):
        raise click.BadParameter(
            f"{text!r} is not a percentage: give one from 0% to 100%, such as 5%."
        )
    return share


class OneOf(click.Choice):  # type: ignore[type-arg]  # older ones take none
    """A word; the message on another suggests the nearest, and says why a variant is not there."""

    def get_invalid_choice_message(self, value: Any, ctx: click.Context | None) -> str:
        if llvm.VARIANTS[0] in self.choices:
            return str(llvm.unknown_variant("variant", value))
        return str(unknown("word", value, self.choices))


class Within(click.FloatRange):
    """A number in an interval; NaN is in none."""

    def convert(
        self, value: Any, parameter: click.Parameter | None, context: click.Context | None
    ) -> float:
        number = super().convert(value, parameter, context)
        # Comparisons with NaN are false, so click's range lets it pass.
        if math.isnan(number):
            self.fail(
                f"{value!r} is not in the range {self._describe_range()}.", parameter, context
            )
        return number


class OutputFolder(click.Path):
    """A folder's path, which is not empty: that would be the current folder."""

    def convert(self, value: Any, *context: Any) -> Any:
        """Return the path of a folder."""
        if value == "":
            self.fail("it is empty. Name a folder; the current one is '.'.", *context)
        return super().convert(value, *context)


def complete_scene(
    context: click.Context, parameter: click.Parameter, beginning: str
) -> list[CompletionItem]:
    """Complete a SCENE: built-in ones with this beginning, or else files."""
    named = [name for name in SCENES if name.startswith(beginning)]
    items = [CompletionItem(name, help=SCENES[name].title) for name in named]
    return items or [CompletionItem(beginning, type="file")]
