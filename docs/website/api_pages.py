"""The pages of the API: one per package, with its modules in full from their docstrings."""

from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from pydoc import locate

from docs.figures.documents import ROOT

ROOMS = ("heuristic", "reference", "comparisons", "reports")


def pages() -> Iterator[tuple[str, str]]:
    """Yield the name of each package and its page, in reStructuredText."""
    for room in ROOMS:
        for path in sorted((ROOT / "fotismos" / room).rglob("__init__.py")):
            yield dotted(path.parent), "\n".join(lines(path.parent))


def lines(folder: Path) -> Iterator[str]:
    """Yield the lines of a package's page."""
    package = dotted(folder)
    yield from (package, "=" * len(package), "", f".. automodule:: {package}", "")
    inner = sorted(path.parent for path in folder.glob("*/__init__.py"))
    if inner:
        yield from (".. toctree::", "   :caption: Packages", "   :maxdepth: 1", "")
        yield from (f"   {dotted(path)}" for path in inner)
        yield ""
    for path in sorted(folder.glob("*.py")):
        if not path.stem.startswith("__"):
            module = dotted(path.with_suffix(""))
            yield from (path.stem, "-" * len(path.stem), "", f".. automodule:: {module}", "")


def name(path: str, words: str) -> str:
    """Return what a link to a module is about: the function that its text names, or the module.

    Empty for files that are not Python's, for folders that are not packages, and for modules that
    have no page.
    """
    module = dotted(ROOT / path.removesuffix("/__init__.py").removesuffix(".py"))
    is_module = path.endswith(".py") or (ROOT / path / "__init__.py").exists()
    if not is_module or path.endswith("__main__.py"):
        return ""
    import_module(module)
    parts = words.strip("`").removeprefix("fotismos.").split(".")
    names = (".".join([module, *parts[start:]]) for start in range(len(parts)))
    return next((each for each in names if locate(each)), module)


def dotted(path: Path) -> str:
    """Return the name of a module or package."""
    return ".".join(path.relative_to(ROOT).parts)
