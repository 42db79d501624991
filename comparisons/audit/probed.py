"""three.js under audit: the real library draws the values of all checks at once."""

from collections.abc import Iterator, Mapping
from functools import partial
from hashlib import sha256
from typing import Any

import numpy as np

from comparisons.audit import shaded
from comparisons.audit.subject import Setting, Subject, Tuned, random_and_mirrored
from heuristic import heuristics
from heuristic.errors import InputError
from heuristic.heuristics import THREE

GRID, PAIRS = (48, 36), 2000


class Probed(Subject):
    """``three:phong`` or ``three:lambert``.

    Until :meth:`draw`, its values are 0; the pairs that were asked for are then drawn together.

    Raises
    ------
    InputError
        For parameters: it has none.
    """

    def __init__(self, name: str, given: Mapping[str, Any]) -> None:
        heuristics.named(name)  # it says what is missing
        if given:
            raise InputError(f"heuristic {name} has no parameters: leave out -p.")
        self.kind = name.removeprefix(THREE)
        self.white = shaded.white("phong")
        self.known: dict[bytes, np.ndarray] = {}
        self.wanted: dict[bytes, Any] = {}
        self.is_planning = True
        materials = {material: each.get("alpha") for material, each in self.white.items()}
        super().__init__(materials, GRID, PAIRS, untuned="three.js has no derivatives")

    def draw(self) -> None:
        """Draw all values that were asked for; others are drawn as they are asked for."""
        from heuristic.three_js import three_lobes

        asked = [three_lobes.Asked(*each) for each in self.wanted.values()]
        found = three_lobes.values(self.kind, asked)
        self.known |= dict(zip(self.wanted, found, strict=True))
        self.wanted, self.is_planning = {}, False

    def evaluate(self, material: str, light: np.ndarray, view: np.ndarray) -> np.ndarray:
        return self._values(self.white[material], light, view)

    def settings(self) -> Iterator[Setting]:
        light, view = random_and_mirrored()
        for words, change in shaded.EXTREMES:
            if not change.keys() & {"alpha", "ior", "metallic"}:  # it does not read them
                values = partial(self._values, shaded.MIDDLE | change, light, view)
                yield Setting(words, values, (light, view))
        light, view = shaded.grazing()
        values = partial(self._values, shaded.MIDDLE, light, view)
        yield Setting(shaded.GRAZING, values, (light, view))

    def tuned(self) -> Iterator[Tuned]:
        return iter(())

    def _values(
        self, material: Mapping[str, float], light: np.ndarray, view: np.ndarray
    ) -> np.ndarray:
        colours = {name: [material.get(name, 0.0)] * 3 for name in ("k_i", "k_a", "k_d", "k_s")}
        given = colours | {"n": material.get("n", 1.0), "form": "phong", "normalised": False}
        count = max(light.shape[1], view.shape[1])
        pairs = [np.broadcast_to(each, (3, count)) for each in (light, view, shaded.UP)]
        words = repr(sorted(given.items())).encode()
        key = sha256(b"".join([words, *(each.tobytes() for each in pairs)])).digest()
        if key not in self.known:
            self.wanted[key] = (given, *pairs)
            if self.is_planning:
                return np.zeros((3, count))
            self.draw()
        return self.known[key]
