"""The chart of docs/checks.md: what three tools say about the same ten pairs of pictures."""

import re
import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import fotismos  # isort: skip  it finds LLVM before Dr.Jit is imported

import numpy as np
from flip_evaluator import evaluate
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from docs.figures.model_figures import FAINT, GROUND, STYLE
from fotismos.comparisons.case import open_case
from fotismos.comparisons.departure.colour import Array
from fotismos.comparisons.departure.criterion import LIMIT, Verdict
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import prepare
from fotismos.reference.rendering.renderer import Renderer
from fotismos.reports import verdict
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

COLOURS: dict[Verdict, str] = {"pass": "#00795a", "undecided": "#8a5c00", "fail": "#b0426f"}
ROW = 0.6
WIDTH = 5.4
"""Inches: a row of the chart, and its width, which a phone shows in a legible size."""

LETTERS = 44
"""Letters in a line of the chart."""


@dataclass(frozen=True)
class Answers:
    """What tools say of a pair: FLIP's mean, idiff's RMS, and a verdict with what is named."""

    pair: str
    flip: float
    rms: float
    verdict: Verdict
    share: float
    named: str


def made() -> list[Answers]:
    """Compare a path tracer's repeats with ten others."""
    case = open_case(SCENE, Options(resolution=RESOLUTION))
    ready = prepare(case.source, case.options)
    seeds = iter(range(4 * REPEATS))

    def repeats(half: Renderer, samples: int = SAMPLES) -> list[Array]:
        half.pass_spp = samples
        return [np.array(half.render(next(seeds)), float) for _ in range(REPEATS)]

    reference = repeats(ready.reference)
    pairs = changed(repeats(ready.reference))
    pairs["half the noise"] = repeats(ready.reference, 4 * SAMPLES)
    pairs["textbook shading"] = repeats(ready.heuristic)
    return [answers(pair, image, reference) for pair, image in pairs.items()]


def changed(image: Sequence[Array]) -> dict[str, list[Array]]:
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


def answers(pair: str, image: Sequence[Array], reference: Sequence[Array]) -> Answers:
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


def chart(found: Sequence[Answers]) -> Figure:
    """Draw two numbers for each pair, and what fotismos says in words."""
    height = ROW * len(found) + 0.7
    with rc_context(STYLE | {"font.size": 9}):
        figure = Figure(figsize=(WIDTH, height), facecolor=GROUND)
        words, flip, rms = figure.subplots(1, 3, sharey=True, width_ratios=(3.1, 1, 1))
        figure.subplots_adjust(0.01, 0.45 / height, 0.985, 1 - 0.3 / height, wspace=0.06)
        words.set_title("fotismos: verdict, share, mistake", loc="left", fontsize=9)
        words.set(xlim=(0, 1), ylim=(len(found) - 0.5, -0.5))
        words.axis("off")
        for place, one in enumerate(found):
            words.text(0, place - 0.3, one.pair, va="center", weight="bold")
            said = f"{one.verdict}, {percent(one.share)}" + (f"; {one.named}" if one.named else "")
            lines = "\n".join(textwrap.wrap(said, LETTERS)[:2])
            style = {"color": COLOURS[one.verdict], "fontsize": 8.5, "linespacing": 1.15}
            words.text(0, place - 0.1, lines, va="top", **style)
        _dots(flip, "FLIP, mean", [one.flip for one in found], found)
        _dots(rms, "idiff, RMS", [one.rms for one in found], found)
    return figure


def _dots(axes: Axes, title: str, values: Sequence[float], found: Sequence[Answers]) -> None:
    """Draw numbers on a logarithmic axis, and the smallest of a pair that only noise parts."""
    axes.set_facecolor(GROUND)
    axes.set_title(title, loc="left", fontsize=9)
    axes.set_xscale("log")
    axes.set_xlim(min(values) / 2.5, max(values) * 2.5)
    axes.spines[["top", "right", "left"]].set_visible(False)
    axes.tick_params(axis="y", length=0, labelleft=False)
    axes.grid(axis="x", alpha=0.25)
    axes.axvline(values[0], color=FAINT, linewidth=1, linestyle=":")
    for place, value in enumerate(values):
        axes.plot(value, place, "o", color=COLOURS[found[place].verdict], markersize=5)
        axes.annotate(
            number(value), (value, place), (0, 6), textcoords="offset points", ha="center",
            fontsize=8,
        )  # fmt: skip


def lines(found: Sequence[Answers]) -> Iterator[str]:
    """Yield the picture and what it shows."""
    passed = [one for one in found if one.verdict == "pass"]
    named = [one for one in found if one.named]
    unnamed = [one.pair for one in found if one.verdict == "fail" and not one.named]
    worst = max(passed, key=lambda one: one.rms)
    better = sum(one.verdict == "fail" and one.rms < worst.rms for one in found)
    yield "![Ten pairs: FLIP and RMS give a number, fotismos a verdict and a name](other-tools.svg)"
    yield ""
    yield (
        f"FLIP and RMS give a number only. fotismos passes {len(passed)} pairs, in which at most"
        f" {percent(LIMIT)} of the pixels differ visibly, and names the mistake in {len(named)} of"
        f" the {len(found) - len(passed)} others; not named is {', '.join(unnamed)}, which varies"
        f" over the picture. By RMS, *{worst.pair}* is worse than {better} of those that fail."
    )
