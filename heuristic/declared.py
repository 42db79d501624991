"""Named declarations by the package itself, by programs, and by installed packages."""

from collections.abc import Iterator, Mapping
from importlib import import_module
from importlib.metadata import entry_points
from typing import Generic, Protocol, TypeVar

from heuristic.errors import InputError


class Named(Protocol):
    """What can be declared."""

    @property
    def name(self) -> str:
        """The word that identifies it."""
        ...


Declaration = TypeVar("Declaration", bound=Named)


class Declared(Mapping[str, Declaration], Generic[Declaration]):
    """All named declarations of one kind, the package's own first.

    Parameters
    ----------
    kind
        What messages call it.
    group
        Group of the entry points by which installed packages declare theirs. They are loaded once,
        when the declarations are listed or a name is not known.
    home
        A package of fotismos whose import declares more; it is imported as late as those.
    """

    def __init__(self, kind: str, group: str, home: str = "") -> None:
        self.kind, self.group, self.home = kind, group, home
        self._own: dict[str, Declaration] = {}
        self._others: dict[str, Declaration] = {}
        self._loaded = False

    def own(self, declaration: Declaration) -> Declaration:
        """Declare what belongs to the package, and return it."""
        self._own[declaration.name] = declaration
        return declaration

    def declare(self, declaration: Declaration) -> Declaration:
        """Declare something from outside, replacing an earlier one of its name; return it.

        Raises
        ------
        InputError
            If the package itself uses the name.
        """
        if declaration.name in self._all_own():
            raise InputError(
                f"{self.kind} {declaration.name!r} is already declared by fotismos: give another"
                " name."
            )
        self._others[declaration.name] = declaration
        return declaration

    def is_own(self, declaration: Declaration) -> bool:
        """Return whether a declaration is the package's own and loaded."""
        return self._own.get(declaration.name) is declaration

    @property
    def built_in(self) -> tuple[str, ...]:
        """The names of the package's own declarations."""
        return tuple(self._all_own())

    def others(self) -> tuple[Declaration, ...]:
        """Return the declarations from outside.

        Raises
        ------
        InputError
            If an entry point cannot be loaded, or its object not declared.
        """
        if not self._loaded:
            for entry in entry_points(group=self.group):
                try:
                    self.declare(entry.load())
                except Exception as error:  # another package's code may raise anything
                    raise InputError(
                        f"{self.kind} {entry.name}: the entry point {entry.value} of {self.group}"
                        f" cannot be loaded: {error}. Repair or uninstall its package."
                    ) from error
            self._loaded = True
        return tuple(self._others.values())

    def __getitem__(self, name: str) -> Declaration:
        if name not in self._own and name not in self._others and name not in self._all_own():
            self.others()
        return self._own[name] if name in self._own else self._others[name]

    def __iter__(self) -> Iterator[str]:
        self.others()
        return iter((*self._all_own(), *self._others))

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def _all_own(self) -> dict[str, Declaration]:
        """Return the package's own declarations, including those of its ``home``."""
        if self.home:
            import_module(self.home)
        return self._own
