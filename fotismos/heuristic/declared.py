"""Named declarations by the package itself, by programs, and by installed packages."""

import pkgutil
from collections.abc import Iterator, Mapping
from importlib.metadata import entry_points
from typing import Any, Generic, TypeVar

from fotismos.heuristic.errors import InputError

Declaration = TypeVar("Declaration")


class Declared(Mapping[str, Declaration], Generic[Declaration]):
    """All named declarations of one kind, the package's own first.

    ``built_in`` says where these are, as ``module:object``, imported as late as they are read.
    Installed packages declare theirs by entry points of a group, which are loaded once, when the
    declarations are listed or a name is not known.
    """

    def __init__(self, kind: str, group: str, **built_in: str) -> None:
        self.kind = kind
        self.group = group
        self._own: dict[str, Any] = {
            name.replace("_", "-"): location for name, location in built_in.items()
        }
        self.added: dict[str, Declaration] = {}
        self._is_loaded = False

    def own(self, declaration: Any) -> Any:
        """Declare what belongs to the package, and return it."""
        self._own[declaration.name] = declaration
        return declaration

    def declare(self, declaration: Any) -> Any:
        """Declare something from outside, replacing an earlier one of its name; return it."""
        if declaration.name in self._own:
            raise InputError(
                f"{self.kind} {declaration.name!r} is already declared by fotismos: give another"
                " name."
            )
        self.added[declaration.name] = declaration
        return declaration

    def is_builtin(self, declaration: Any) -> bool:
        """Return whether a declaration is the package's own."""
        return declaration.name in self._own and self[declaration.name] is declaration

    def __getitem__(self, name: str) -> Declaration:
        if isinstance(self._own.get(name), str):
            self._own[name] = pkgutil.resolve_name(self._own[name])
        if name not in self._own and name not in self.added:
            self._load()
        return self._own[name] if name in self._own else self.added[name]

    def __iter__(self) -> Iterator[str]:
        self._load()
        return iter((*self._own, *self.added))

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def _load(self) -> None:
        """Load the entry points of installed packages."""
        for entry in () if self._is_loaded else entry_points(group=self.group):
            if entry.name.startswith("."):  # it reads files of that suffix
                continue
            try:
                self.declare(entry.load())
            except Exception as error:  # another package's code may raise anything
                raise InputError(
                    f"{self.kind} {entry.name}: the entry point {entry.value} of {self.group}"
                    f" cannot be loaded: {error}. Repair or uninstall its package."
                ) from error
        self._is_loaded = True
