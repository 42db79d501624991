"""Scenes of the corpus with one value broken at random, and what becomes of them.

``python -m tests.broken_scenes FIRST COUNT`` breaks so many, and counts them by outcome.
"""

import re
import sys
import tempfile
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from heuristic.errors import FotismosError  # isort: skip  it finds LLVM before Mitsuba looks for it
import mitsuba as mi
import numpy as np

from comparisons.case import Request, open_case
from comparisons.compare import compare
from tests import corpus_files

CORPUS = Path(__file__).parent / "corpus"
NUMBER = re.compile(r"(?<![\w.$])[-+]?\d+\.?\d*(?:e[-+]?\d+)?(?![\w.])")
VALUE = re.compile(r'\b(?:value|x|y|z|origin|target|up|matrix|angle)="([^"]*)"')
VALUES = ("nan", "inf", "-inf", "0", "-1", "1e308", "-1e308", "1e38", "1e-40", "-0.0", "1e19", "2")
WORDS = ("", "abc", "true", "$", "\u00e9", "1,2", "0 0 0", "99999999999999999999")

# A hair of a hundred segments and the sky's tables take longer than all else together.
SLOW = ("bsdf-hair", "emitter-sunsky", "emitter-timed-sunsky", "medium-", "integrator-volpath")


@dataclass(frozen=True)
class Outcome:
    """What became of a broken scene: ``rendered``, ``refused``, or else ``wrong``."""

    scene: str
    change: str
    kind: str
    what: str = ""

    def __str__(self) -> str:
        return f"{self.kind}: {self.scene}: {self.change}: {self.what}"


def broken(seed: int, folder: Path) -> tuple[Path, str]:
    """Write a scene of the corpus with one thing broken, and say which, and what was done to it."""
    draw = np.random.default_rng(seed)
    names = sorted(p.stem for p in CORPUS.glob("*.xml") if not p.stem.startswith(SLOW))
    name = names[draw.integers(len(names))]
    text = (CORPUS / f"{name}.xml").read_text(encoding="utf-8")
    text, change = (_value, _value, _value, _attribute, _element, _file)[draw.integers(6)](
        draw, text, folder, seed
    )
    path = folder / f"{name}-{seed}.xml"
    path.write_text(text, encoding="utf-8")
    return path, change


def _replaced(text: str, found: re.Match, group: int, new: str) -> tuple[str, str]:
    begin, end = found.span(group)
    return text[:begin] + new + text[end:], f"{found[0]!r} -> {new!r}"


def _value(draw, text, folder, seed):
    """Put another number in the place of one."""
    places = []
    for value in VALUE.finditer(text):
        places += [found for found in NUMBER.finditer(text, value.start(1), value.end(1))]
    if not places:
        return _attribute(draw, text, folder, seed)
    found = places[draw.integers(len(places))]
    return _replaced(text, found, 0, VALUES[draw.integers(len(VALUES))])


def _attribute(draw, text, folder, seed):
    """Put a word in the place of an attribute's value."""
    places = [m for m in re.finditer(r'\b\w+="([^"]*)"', text) if not m[0].startswith("version")]
    return _replaced(text, places[draw.integers(len(places))], 1, WORDS[draw.integers(len(WORDS))])


def _element(draw, text, folder, seed):
    """Leave an element without content out."""
    places = list(re.finditer(r"<(\w+)[^<>]*/>", text))
    return _replaced(text, places[draw.integers(len(places))], 0, "")


def _file(draw, text, folder, seed):
    """Damage a file that the scene reads: cut it short, or overwrite a few bytes."""
    places = [m for m in re.finditer(r'value="([\w-]+\.\w+)"', text) if (folder / m[1]).exists()]
    if not places:
        return _value(draw, text, folder, seed)
    found = places[draw.integers(len(places))]
    whole = (folder / found[1]).read_bytes()
    content = bytearray(whole)
    how = draw.integers(3)
    if how == 0:
        content = content[: draw.integers(len(content))]
    for place in draw.integers(len(content), size=3 * (how == 1)) if content else ():
        content[place] = draw.integers(256)
    if how == 2:
        content = bytearray(draw.bytes(200))
    name = f"{seed}-{found[1]}"
    (folder / name).write_bytes(content)
    text, _ = _replaced(text, found, 1, name)
    return text, f"{found[1]}: {('cut', 'three bytes', 'noise')[how]} of {len(whole)} bytes"


def outcome(seed: int, folder: Path) -> Outcome:
    """Break a scene and compare its halves: finite pictures of something, or a message."""
    mi.set_variant("llvm_ad_rgb")
    path, change = broken(seed, folder)
    try:
        case = open_case(path, Request(spp=4, resolution=(16, 12)))
        made = compare(case.source, case.options)
    except FotismosError as error:
        kind = "refused" if str(error).strip() else "wrong"
        return Outcome(path.stem, change, kind, f"{type(error).__name__}: {error}")
    except Exception as error:
        return Outcome(path.stem, change, "wrong", f"{type(error).__name__}: {error}")
    images = made.images
    if not all(np.isfinite(image).all() for image in (images.heuristic, images.reference)):
        return Outcome(path.stem, change, "wrong", "not finite")
    if not made.record.pixels.counted:
        return Outcome(path.stem, change, "wrong", "nothing in view")
    return Outcome(path.stem, change, "rendered")


def main(first: int, count: int) -> None:
    """Break scenes, and print those that are wrong and the counts of all."""
    mi.set_variant("llvm_ad_rgb")
    mi.set_log_level(mi.LogLevel.Error)
    counts = Counter()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        corpus_files.write(folder)
        for seed in range(first, first + count):
            print(f"\r{seed}", end="", file=sys.stderr, flush=True)
            found = outcome(seed, folder)
            counts[found.kind] += 1
            if found.kind == "wrong":
                print(found, flush=True)
    print(dict(counts))


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
