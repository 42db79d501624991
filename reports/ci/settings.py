"""The table ``[tool.fotismos]`` of a project's pyproject.toml: what ``fotismos check`` does there.

::

    [tool.fotismos]
    baselines = "baselines"
    report = "out"
    significance = 0.001
    within = 2
    max_visible = "5%"

An option on the command line comes before the table. Folders are relative to the file.
"""

import os
import tomllib
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from fotismos.heuristic.errors import InputError, unknown
from fotismos.reports import jobs

FILE = "pyproject.toml"
TABLE = "[tool.fotismos]"
FOLDERS = {"baselines": "baseline", "report": "output"}
"""Keys that name a folder, with the parameter of `check` that each sets."""

KEYS = (*FOLDERS, "significance", "within", "max_visible")


def find(folder: Path) -> tuple[Path, dict[str, Any]] | None:
    """Return the nearest pyproject.toml that has the table, and the table; None without one.

    It is searched for in this folder and in those above it.
    """
    for above in (folder, *folder.parents):
        path = above / FILE
        if not path.is_file():
            continue
        try:
            whole = tomllib.loads(path.read_text(encoding="utf-8"))
        # Values nested too deeply raise RecursionError.
        except (OSError, ValueError, RecursionError) as error:
            raise InputError(f"{path} cannot be read: {error}. Correct it.") from error
        tools = whole.get("tool")
        table = tools.get("fotismos") if isinstance(tools, dict) else None
        if isinstance(table, dict):
            return path, table
    return None


def parameters(path: Path, table: dict[str, Any]) -> dict[str, str]:
    """Return the values of the table by the parameters of `check`, as the user would type them."""
    values = {}
    for key, value in table.items():
        if key not in KEYS:
            raise unknown(f"{path}: {TABLE} key", key, KEYS)
        is_folder = key in FOLDERS
        if not isinstance(value, str if is_folder else (str, int, float)):
            allowed = "a folder" if is_folder else "a number or a text"
            raise InputError(f"{path}: {TABLE} {key} = {value!r} is not {allowed}. Correct it.")
        text = str(value)
        # Printed paths and commands are then as short as the user's own.
        values[FOLDERS.get(key, key)] = os.path.relpath(path.parent / text) if is_folder else text
    return values


class Configured(jobs.Helped):
    """A command whose defaults the table may set."""

    def make_context(
        self,
        info_name: str | None,
        args: list[str],
        parent: click.Context | None = None,
        **extra: Any,
    ) -> click.Context:
        """Read the table, then the command line."""
        is_needed = not extra.get("resilient_parsing") and not {"-h", "--help"} & set(args)
        found = find(Path.cwd()) if is_needed else None
        if found is None:
            return super().make_context(info_name, args, parent, **extra)
        path, table = found
        extra["default_map"] = parameters(path, table)
        try:
            return super().make_context(info_name, args, parent, **extra)
        except click.BadParameter as error:
            name = (error.param and error.param.name) or ""
            source = error.ctx and error.ctx.get_parameter_source(name)
            if source is ParameterSource.DEFAULT_MAP:
                raise InputError(f"{path}: {TABLE} {name}: {error.message}") from error
            raise
