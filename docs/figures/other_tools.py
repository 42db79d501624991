"""The table of docs/checks.md: what three tools say about the same ten pairs of pictures."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from flip_evaluator import evaluate

import fotismos
from docs.figures.documents import replace
from fotismos.comparisons.case import open_case
from fotismos.comparisons.departure.colour import Array
from fotismos.comparisons.departure.criterion import LIMIT
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import prepare
from fotismos.comparisons.records.departure import Verdict
from fotismos.reference.rendering.renderer import Renderer
from fotismos.reports import verdict
from fotismos.reports.terminal.table import Table, markdown
from fotismos.reports.terminal.words import number, percent

SCENE = "plastic-spheres"
RESOLUTION = (128, 96)
SAMPLES = 1024
"""Samples per pixel of a repeat."""

REPEATS = 4
"""Repeats of each half; the other tools take one picture, the first."""

GAMMA = 1.3
WHITE = (1.12, 1.0, 0.85)
BRIGHTER = 1.02
BLOCK = (slice(24, 56), slice(40, 88))
FIREFLY = 50.0
CLIP = 0.3


@dataclass(frozen=True)
class Answers:
    """What tools say of a pair: FLIP's mean, idiff's RMS, and a verdict with what is named."""

    pair: str
    flip: float
    rms: float
    verdict: Verdict
    share: float
    named: str


def write() -> None:
    """Compare a path tracer's repeats with ten others, and write what the tools say."""
    case = open_case(SCENE, Options(resolution=RESOLUTION))
    ready = prepare(case.source, case.options)
    seeds = iter(range(4 * REPEATS))

    def repeats(half: Renderer, samples: int = SAMPLES) -> list[Array]:
        half.pass_spp = samples
        return [np.array(half.render(next(seeds)), float) for _ in range(REPEATS)]

    reference = repeats(ready.reference)
    pairs = _changed(repeats(ready.reference))
    pairs["half the noise"] = repeats(ready.reference, 4 * SAMPLES)
    pairs["textbook shading"] = repeats(ready.heuristic)
    found = [_answers(pair, image, reference) for pair, image in pairs.items()]
    replace("checks.md", "other tools", _lines(found))


def _changed(image: Sequence[Array]) -> dict[str, list[Array]]:
    """Return repeats (H, W, 3) by what was done to them."""
    block = np.ones_like(image[0])
    block[BLOCK] = BRIGHTER
    firefly = np.zeros_like(image[0])
    firefly[len(firefly) // 2, len(firefly[0]) // 2] = FIREFLY
    return {
        "only other noise": list(image),
        "half the noise": [],
        "a firefly": [image[0] + firefly, *image[1:]],
        "a block 2 % brighter": [one * block for one in image],
        "no division by π": [one * np.pi for one in image],
        "moved by a pixel": [np.roll(one, 1, axis=1) for one in image],
        "a gamma of 1.3": [np.maximum(one, 0) ** (1 / GAMMA) for one in image],
        "another white": [one * np.array(WHITE) for one in image],
        "clipped at 0.3": [np.minimum(one, CLIP) for one in image],
        "textbook shading": [],
    }


def _answers(pair: str, image: Sequence[Array], reference: Sequence[Array]) -> Answers:
    """Ask each tool about repeats (H, W, 3) of two pictures."""
    shown = fotismos.compare(name=pair, image=list(image), reference=list(reference))
    record = shown.comparison.record
    first = [np.ascontiguousarray(repeats[0], np.float32) for repeats in (reference, image)]
    _, flip, _ = evaluate(*first, "HDR", inputsRGB=False, applyMagma=False)
    assert record.agreement is not None
    return Answers(
        pair=pair,
        flip=float(flip),
        rms=float(np.sqrt(np.mean((first[1] - first[0]) ** 2))),
        verdict=verdict.decision(record),
        share=verdict.share(record).value,
        named=_short(record.agreement.mistakes),
    )


def _short(mistakes: Sequence[str]) -> str:
    """Return the first mistake up to its first pause; empty if none is named."""
    if not mistakes:
        return ""
    whole = mistakes[0].removeprefix("The picture").removeprefix("'s")
    return re.split(r"[:?]|, which|\. |, where", whole)[0].strip()


def _lines(found: Sequence[Answers]) -> Iterator[str]:
    """Yield the table and what it shows."""
    head = "Pair", "fotismos: verdict, share, mistake", "FLIP, mean", "idiff, RMS"
    rows = [(one.pair, _said(one), number(one.flip), number(one.rms)) for one in found]
    yield from markdown(Table.of([head, *rows], right=2))
    passed = [one for one in found if one.verdict == "pass"]
    named = [one for one in found if one.named]
    unnamed = [one.pair for one in found if one.verdict == "fail" and not one.named]
    worst = max(passed, key=lambda one: one.rms)
    better = sum(one.verdict == "fail" and one.rms < worst.rms for one in found)
    yield ""
    yield (
        f"FLIP and RMS give a number only. fotismos passes {len(passed)} pairs, in which at most"
        f" {percent(LIMIT)} of the pixels differ visibly, and names the mistake in {len(named)} of"
        f" the {len(found) - len(passed)} others. It names none in {', '.join(unnamed)}, where the"
        f" error varies over the picture. By RMS, *{worst.pair}* is worse than {better} of those"
        " that fail."
    )


def _said(one: Answers) -> str:
    mistake = f"; {one.named}" if one.named else ""
    return f"{one.verdict}, {percent(one.share)}{mistake}"
