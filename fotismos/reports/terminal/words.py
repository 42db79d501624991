"""What is printed, and how: amount, safety, numbers.

Results go to standard output, everything else to standard error. Numbers are the same on a terminal
and on every page.
"""

import math
import os
import re
import unicodedata
from collections.abc import Callable, Iterable
from pathlib import Path

import click

from fotismos.comparisons.options import Options

LEVEL = "fotismos.verbosity"
"""Key of the level in click's context: -1 quiet, 0 normal, 1 verbose."""


def _remember(context: click.Context, parameter: click.Parameter, is_set: bool) -> None:
    # click calls this for an absent flag, too, which must not undo the other one.
    if is_set:
        context.meta[LEVEL] = -1 if parameter.name == "quiet" else 1


VERBOSITY = {
    "quiet": "Print only where the results are, no progress or tables.",
    "verbose": "Also print the simulation, the pairing of lights, warnings, and times.",
}
"""The options that set the level, and their help."""


def verbosity_option(name: str) -> click.Option:
    """Return one of the options that set the level."""
    return click.Option(
        [f"-{name[0]}", f"--{name}"],
        is_flag=True,
        expose_value=False,
        callback=_remember,
        help=VERBOSITY[name],
    )


def level() -> int:
    """Return -1 for a quiet command, 1 for a verbose one, else 0."""
    context = click.get_current_context(silent=True)
    return context.meta.get(LEVEL, 0) if context else 0


def is_quiet() -> bool:
    """Return whether the command is quiet."""
    return level() < 0


def visible(text: str) -> str:
    """Return a line that no terminal or CI service takes for a command.

    Control characters, which names from a scene may have, are shown as escapes. GitHub reads lines
    that begin with ``::``, Azure and TeamCity ``##name[``.
    """
    # Zs are blanks: Python calls those beyond the space not printable, but they do no harm.
    shown = "".join(
        c if c.isprintable() or unicodedata.category(c) == "Zs" else ascii(c)[1:-1] for c in text
    )
    return re.sub(r"##(?=\w*\[)", "# #", re.sub(r"^(\s*)::", r"\1\\::", shown))


OPTION_NAMES = frozenset(
    {
        *Options.__struct_fields__,
        "at",
        "form",
        "kernel_time",
        "measure",
        "output",
        "rounds",
        "update",
    }
)

OPTION = re.compile(r"`(\w+)(?:=([^`]*))?`")


def as_typed(text: str) -> str:
    """Return text with options as one types them: `` `spp=64` `` becomes ``--spp 64``.

    The rooms below name options as Python does.
    """

    def typed(match: re.Match[str]) -> str:
        name, value = match.groups()
        if name not in OPTION_NAMES:
            return match[0]
        option = f"--{name.replace('_', '-')}"
        return option if value is None else f"{option} {value}"

    return OPTION.sub(typed, text)


def echo(text: str, err: bool = False) -> None:
    """Print text, each line as :func:`visible` returns it."""
    click.echo("\n".join(visible(line) for line in as_typed(text).split("\n")), err=err)


def tell(lines: Iterable[str]) -> None:
    """Print lines of a result, unless the command is quiet."""
    if not is_quiet():
        for line in lines:
            echo(line)


def tell_where(path: Path) -> None:
    """Print where the results are; a quiet command prints nothing else."""
    name = os.fsencode(path)  # unchanged, even if it is not in UTF-8
    click.echo(name if is_quiet() else b"\n" + name)


def remark(lines: Iterable[str]) -> None:
    """Print lines on standard error, if the command is verbose."""
    if level() > 0:
        for line in lines:
            echo(line, err=True)


# --- Numbers ---------------------------------------------------------------------------------


def number(value: float | None) -> str:
    """Three significant digits, as a power of ten below 0.001 and from a million."""
    if value is None:
        return "–"
    size = abs(float(f"{value:.2e}"))  # rounded first: 9.999 is 10.0, not 10.00
    if size == 0:
        return "0"
    if not 1e-3 <= size < 1e6:
        mantissa, exponent = f"{value:.1e}".split("e")
        superscript = str(int(exponent)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
        return f"{_minus(mantissa)} × 10{superscript}"
    decimals = max(0, 2 - math.floor(math.log10(size)))
    return _minus(f"{value:,.{decimals}f}")


def difference(value: float | None) -> str:
    """A colour difference like `number`, but "< 0.01" where nobody sees it."""
    if value and abs(value) < 0.01:
        return "< 0.01" if value > 0 else "> −0.01"
    return number(value)


def parameter(value: float) -> str:
    """A value that was set, not measured: up to four significant digits, no trailing zeros."""
    return _minus(f"{value:,}" if isinstance(value, int) else f"{value:.4g}")


def seconds(value: float | None, digits: Callable[[float], str] = number) -> str:
    """A time with its unit: ns, µs, ms or s."""
    if value is None:
        return "–"
    for scale, unit in ((1.0, "s"), (1e-3, "ms"), (1e-6, "µs")):
        if abs(value) >= scale:
            return f"{digits(value / scale)} {unit}"
    return f"{digits(value / 1e-9)} ns" if value else "0 s"


def given_time(value: float) -> str:
    """A time that was given, not measured: without trailing zeros."""
    return seconds(value, parameter)


def percent(value: float) -> str:
    """A fraction as a percentage."""
    return f"{number(100 * value)} %"


def yes_or_no(is_so: bool) -> str:
    """A truth value."""
    return "yes" if is_so else "no"


def _minus(digits: str) -> str:
    return digits.replace("-", "−")
