"""The content of docs/accuracy.md: studies of cost over many scenes, and their common findings.

``./run docs --accuracy`` measures for 40 minutes on an idle machine, and writes the page.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from statistics import median
from typing import Any

import fotismos  # noqa: F401  isort: skip  it finds LLVM before Dr.Jit is imported

from docs.figures.from_tests import ROOT, fact
from fotismos.comparisons.case import open_case
from fotismos.comparisons.cost.cost import cost
from fotismos.comparisons.cost.cost_record import Cost, Point
from fotismos.comparisons.cost.front import at_size, fronted, sufficient
from fotismos.comparisons.cost.methods import FULL_PLAN, STAND_INS
from fotismos.comparisons.gallery.builtin import SCENES
from fotismos.comparisons.options import Options
from fotismos.reports.terminal.cost_tables import busy
from fotismos.reports.terminal.tables import markdown
from fotismos.reports.terminal.words import number, parameter, seconds

LARGER = tuple(
    ROOT / "docs/scenes" / f"{name}.py"
    for name in ("glass", "glossy_floor", "outdoors", "textured_room")
)
SIZE = 512, 384
TOLERANCES = (5.0, 2.0, 1.0)

FEW = 3
"""Scenes with an effect, for a median."""

NONE, KERNEL = "none", "kernel"
AT_FULL_SIZE = "cornell-box", "plastic-spheres"


def measured(names: Sequence[str] = (*SCENES, *map(str, LARGER))) -> list[Cost]:
    """Study what accuracy costs on each scene, in turn."""
    found = []
    for name in names:
        case = open_case(name, Options(resolution=(SIZE[0] // 4, SIZE[1] // 4)))
        found.append(cost(case.source, case.options).record)
        print(name, flush=True)
    return found


def at_full_size(record: Cost) -> tuple[Point, ...]:
    """Return the points of a study with their times and front at :data:`SIZE`."""
    return fronted(at_size(record.points, record.methods, SIZE))


def setting(records: Sequence[Cost]) -> Iterator[str]:
    """Yield the conditions of the measurement."""
    first = records[0]
    width, height = first.resolution
    yield (
        f"{len(records)} scenes, measured at {width} by {height} pixels in {first.rounds} rounds"
        f" with {first.threads} threads on {first.machine.processor}."
    )
    yield from (f"{one.scene}: {busy(one)}" for one in records if one.is_busy)


def fronts(records: Sequence[Cost]) -> Iterator[str]:
    """Yield the front of some studies at full size, in steps that lower the error by a tenth."""
    rows = []
    for record in (each for each in records if each.scene in AT_FULL_SIZE):
        error = float("inf")
        for point in sorted(at_full_size(record), key=lambda point: point.seconds.value):
            if point.front and point.error.value <= 0.9 * error:
                error = point.error.value
                where = record.scene, f"{point.method}, {point.spp}"
                rows.append((*where, seconds(point.seconds.value), number(error)))
    yield from markdown([("Scene", "Method, samples", "Time", "ΔE2000"), *rows], right=2)


def predictions() -> Iterator[str]:
    """Yield how predictions compare with later measurements."""
    found = fact("predictions", 7)
    width, height = found["size"]
    yield f"At {width} by {height} pixels, from studies of 128 pixels."
    yield " ".join(found["summary"])


def pictures(records: Sequence[Cost]) -> Iterator[str]:
    """Yield the charts of the larger scenes, for the page."""
    for record, file in charts(records):
        yield f"![Error against time: {record.scene.replace('_', ' ')}]({file})"


def charts(records: Sequence[Cost]) -> Iterator[tuple[Cost, str]]:
    """Yield the studies of the larger scenes, and the file of each chart."""
    names = {file.stem: f"cost-{file.stem.replace('_', '-')}.svg" for file in LARGER}
    yield from ((record, names[record.scene]) for record in records if record.scene in names)


def methods(records: Sequence[Cost]) -> Iterator[str]:
    """Yield the fastest method that passes, with one row for scenes that have the same ones."""
    yield (
        "The fastest method of which at most 5 % of the pixels exceed a ΔE2000, with its samples"
        f" per pixel, at {SIZE[0]} by {SIZE[1]} pixels; in brackets its time over that of the"
        " textbook kernel with the fewest (*kernel*), in the median of the scenes. *Full plan*: the"
        " same of the full plan with the most samples."
    )
    yield ""
    alike: dict[tuple[str, ...], list[tuple[Cost, list[Point | None]]]] = {}
    for record in records:
        points = at_full_size(record)
        chosen = [sufficient(points, limit) for limit in TOLERANCES]
        names = tuple(_named(one, record.methods[0].name) for one in chosen)
        alike.setdefault(names, []).append((record, chosen))
    rows = []
    for names, group in alike.items():
        times = [[_ratio(record, one) for one in chosen] for record, chosen in group]
        cells = (
            name if name in (NONE, KERNEL) else f"{name} ({number(median(ratios))})"
            for name, *ratios in zip(names, *times, strict=True)
        )
        full = median(_ratio(record, _longest(record)) for record, _ in group)
        scenes = ", ".join(record.scene for record, _ in group)
        rows.append((scenes, *cells, number(full)))
    head = "Scenes", *(f"at {parameter(t)}" for t in TOLERANCES), "Full plan"
    yield from markdown([head, *rows], right=4)


def attribution(records: Sequence[Cost]) -> Iterator[str]:
    """Yield what each effect removes and adds: the scenes where it matters, and medians there."""
    worth: dict[str, list[tuple[float, float]]] = {}
    for record in records:
        kernel = record.attribution.kernel_s.value
        for one in record.attribution.effects:
            if one.removes.low > 0:
                found = one.removes.value, one.adds_s.value / kernel
                worth.setdefault(one.effect, []).append(found)
    rows = [
        (
            effect,
            f"{len(found)}",
            number(median(removed for removed, _ in found)),
            f"{median(times for _, times in found):+.2f}",
        )
        for effect, found in sorted(worth.items(), key=lambda row: -len(row[1]))
        if len(found) >= FEW
    ]
    head = "Effect", "scenes", "removes, mean ΔE2000", "adds, in times of the kernel"
    yield from markdown([head, *rows], right=1)


def findings(records: Sequence[Cost]) -> Iterator[str]:
    """Yield the common findings of the studies, as list items."""
    ratios = [record.method(FULL_PLAN.name).ratio.value for record in records]
    yield (
        f"- A sample of the full plan takes {min(ratios):.2g} to {max(ratios):.2g} times as long as"
        f" the textbook kernel's, {median(ratios):.2g} times in the median."
    )
    yield from (f"- {_within(records, limit)}" for limit in TOLERANCES)
    yield f"- {_worth_most(records)}"
    yield f"- {_stand_ins(records)}"


def _within(records: Sequence[Any], limit: float) -> str:
    """Return how many scenes need only a kernel at a tolerance, and how much faster it is."""
    enough, saved = 0, []
    for record in records:
        chosen = sufficient(at_full_size(record), limit)
        if chosen and record.method(chosen.method).is_kernel:
            enough += 1
            full = record.method(FULL_PLAN.name).per_sample_s.value
            saved.append(full / record.method(chosen.method).per_sample_s.value)
    said = (
        f"At ΔE2000 {parameter(limit)} a kernel is the fastest method that passes in {enough} of"
        f" {len(records)} scenes"
    )
    return (
        f"{said}: a sample takes 1 / {median(saved):.2g} of the full plan's."
        if saved
        else f"{said}."
    )


def _worth_most(records: Sequence[Any]) -> str:
    """Return which effects are worth most, and in how many scenes."""
    first = Counter[str]()
    for record in records:
        sure = [one for one in record.attribution.effects if one.removes.low > 0]
        if sure:
            first[max(sure, key=lambda one: one.removes.value).effect] += 1
    if not first:
        return "No effect surely removes anything."
    ranked = ", then ".join(f"{effect} ({count})" for effect, count in first.most_common(3))
    return f"The effect worth most, by the number of scenes: {ranked}."


def _stand_ins(records: Sequence[Any]) -> str:
    """Return which stand-ins are on a front, and in how many scenes."""
    names = [method.name for method in STAND_INS]
    on_front = Counter(
        name
        for record in records
        for name in {one.method for one in at_full_size(record) if one.front}.intersection(names)
    )
    never = [name for name in names if not on_front[name]]
    said = "; ".join(f"{name} ({count})" for name, count in on_front.most_common()) or "none"
    left = f" Never: {'; '.join(never)}." if never else ""
    left += (
        " Removed, since never on one: constant ambient, and in version 0.2 spherical harmonics"
        " and ambient occlusion. The filtered shadow map, also removed, was on one."
    )
    return f"Stand-ins on the front, by the number of scenes: {said}.{left}"


def _named(point: Point | None, kernel: str) -> str:
    if not point:
        return NONE
    return KERNEL if point.method == kernel else f"{point.method}, {point.spp}"


def _longest(record: Cost) -> Point:
    """Return the full plan with the most samples."""
    own = (point for point in at_full_size(record) if point.method == FULL_PLAN.name)
    return max(own, key=lambda point: point.spp)


def _ratio(record: Cost, point: Point | None) -> float:
    """Return a point's time over that of the textbook kernel with the fewest samples."""
    kernel = record.methods[0].name
    fewest = min(one.seconds.value for one in at_full_size(record) if one.method == kernel)
    return point.seconds.value / fewest if point else 0.0
