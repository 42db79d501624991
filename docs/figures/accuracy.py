"""The content of docs/accuracy.md: studies of cost over many scenes, and their common findings.

``./run docs --accuracy`` measures on an idle machine, and writes the page.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from statistics import median
from typing import Any

from docs.figures import charts
from docs.figures.documents import DOCS, fact, replace, write_table
from fotismos.comparisons import atomic
from fotismos.comparisons.case import open_case
from fotismos.comparisons.gallery.builtin import SCENES
from fotismos.comparisons.ladder.cost import cost
from fotismos.comparisons.ladder.front import cheapest
from fotismos.comparisons.ladder.methods import FULL_PLAN, STAND_INS
from fotismos.comparisons.options import Options
from fotismos.comparisons.records.cost import Cost, Point
from fotismos.reports.charts import vega
from fotismos.reports.charts.cost_charts import titled
from fotismos.reports.sentences import busy
from fotismos.reports.terminal.table import Table, markdown
from fotismos.reports.terminal.words import number, parameter

LARGER = tuple(
    DOCS / "scenes" / f"{name}.py"
    for name in ("glass", "glossy_floor", "outdoors", "textured_room")
)
SIZE = 512, 384
TOLERANCES = (5.0, 2.0, 1.0)

FEW = 3
"""Scenes with an effect, for a median."""

NONE, KERNEL = "none", "kernel"
AT_FULL_SIZE = "cornell-box", "plastic-spheres"


def write() -> None:
    """Measure, and write the page with its tables and charts."""
    records = measured()
    replace("accuracy.md", "setting", setting(records))
    replace("accuracy.md", "findings", findings(records))
    replace("accuracy.md", "attribution", attribution(records))
    write_table("methods", methods(records))
    write_table("fronts", fronts(records))
    charts.write()
    names = [path.stem for path in LARGER]
    pictures = []
    for record in (each for each in records if each.scene in names):
        file = f"cost-{record.scene.replace('_', '-')}.svg"
        atomic.write(DOCS / file, vega.paper(titled(record)))
        pictures.append(f"![Error against time: {record.scene.replace('_', ' ')}]({file})")
    replace("accuracy.md", "pictures", pictures)
    replace("accuracy.md", "predictions", predictions())


def measured() -> list[Cost]:
    """Study what accuracy costs on each scene, in turn."""
    found = []
    for name in (*SCENES, *map(str, LARGER)):
        case = open_case(name, Options(resolution=(SIZE[0] // 4, SIZE[1] // 4)))
        found.append(cost(case.source, case.options, at=SIZE).record)
        print(name, flush=True)
    return found


def setting(records: Sequence[Cost]) -> Iterator[str]:
    """Yield the conditions of the measurement."""
    first = records[0]
    width, height = first.resolution
    yield (
        f"{len(records)} scenes, measured at {width} by {height} pixels in {first.rounds} rounds"
        f" with {first.threads} threads on {first.machine.processor}."
    )
    yield from (f"{one.scene}: {busy(one)}" for one in records if one.is_busy)


def fronts(records: Sequence[Cost]) -> Iterator[tuple[str, ...]]:
    """Yield the front of some studies at full size, in steps that lower the error by a tenth."""
    yield "scene", "method", "samples", "seconds", "mean ΔE2000"
    for record in (each for each in records if each.scene in AT_FULL_SIZE):
        error = float("inf")
        for point in sorted(record.points, key=lambda point: point.seconds.value):
            if point.front and point.error.value <= 0.9 * error:
                error = point.error.value
                numbers = f"{point.seconds.value:.3g}", number(error)
                yield record.scene, point.method, str(point.spp), *numbers


def predictions() -> Iterator[str]:
    """Yield how predictions compare with later measurements."""
    found = fact("predictions", 7)
    width, height = found["size"]
    yield f"At {width} by {height} pixels, from studies of 128 pixels."
    yield " ".join(found["summary"])


def methods(records: Sequence[Cost]) -> Iterator[tuple[str, ...]]:
    """Yield the fastest method that passes at each threshold, for scenes that have the same ones.

    Times are over that of the textbook kernel with the fewest samples, in the median of the scenes;
    the last row of each group has everything simulated with the most samples.
    """
    yield "scenes", "threshold", "method", "samples", "time over the kernel's"
    alike: dict[tuple[str, ...], list[tuple[Cost, list[Point | None]]]] = {}
    for record in records:
        points = record.points
        chosen = [cheapest(points, limit) for limit in TOLERANCES]
        names = tuple(_named(one, record.methods[0].name) for one in chosen)
        alike.setdefault(names, []).append((record, chosen))
    for names, group in alike.items():
        scenes = ", ".join(record.scene for record, _ in group)
        for place, (limit, name) in enumerate(zip(TOLERANCES, names, strict=True)):
            point = group[0][1][place]
            samples = str(point.spp) if point and name != KERNEL else ""
            ratios = [_ratio(record, chosen[place]) for record, chosen in group]
            time = number(median(ratios)) if point else ""
            yield scenes, parameter(limit), name.removesuffix(f", {samples}"), samples, time
        full = [_ratio(record, _longest(record)) for record, _ in group]
        yield scenes, "most samples", FULL_PLAN.name, "", number(median(full))


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
    yield from markdown(Table.of([head, *rows]))


def findings(records: Sequence[Cost]) -> Iterator[str]:
    """Yield the common findings of the studies, as list items."""
    ratios = [record.method(FULL_PLAN.name).ratio.value for record in records]
    ratio = f"{median(ratios):.2g}"
    yield f"- A path-traced sample costs {ratio} times a textbook sample in the median."
    yield f"- {_kernels(records)}"
    yield f"- {_worth_most(records)}"
    yield f"- {_stand_ins(records)}"


def _kernels(records: Sequence[Any]) -> str:
    """Return in how many scenes a kernel is the fastest that passes, and how much time it saves."""
    counts = []
    gains = []
    for limit in TOLERANCES:
        saved = []
        for record in records:
            chosen = cheapest(record.points, limit)
            if chosen and record.method(chosen.method).is_kernel:
                full = record.method(FULL_PLAN.name).per_sample_s.value
                saved.append(full / record.method(chosen.method).per_sample_s.value)
        counts.append(f"{len(saved)}")
        gains.append(f"{median(saved):.2g}" if saved else "–")
    limits = _joined([parameter(limit) for limit in TOLERANCES])
    scenes = f"{_joined(counts)} of {len(records)} scenes"
    return (
        f"At ΔE2000 {limits}, a textbook kernel is the fastest passing method in {scenes}, and"
        f" only {_joined(gains)} times faster than path tracing there."
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
        for name in {one.method for one in record.points if one.front}.intersection(names)
    )
    never = [name for name in names if not on_front[name]]
    said = "; ".join(f"{name} ({count})" for name, count in on_front.most_common()) or "none"
    left = f" Never: {'; '.join(never)}." if never else ""
    return f"Approximations of engines on the front, by the number of scenes: {said}.{left}"


def _named(point: Point | None, kernel: str) -> str:
    if not point:
        return NONE
    return KERNEL if point.method == kernel else f"{point.method}, {point.spp}"


def _longest(record: Cost) -> Point:
    """Return the full plan with the most samples."""
    own = (point for point in record.points if point.method == FULL_PLAN.name)
    return max(own, key=lambda point: point.spp)


def _ratio(record: Cost, point: Point | None) -> float:
    """Return a point's time over that of the textbook kernel with the fewest samples."""
    kernel = record.methods[0].name
    fewest = min(one.seconds.value for one in record.points if one.method == kernel)
    return point.seconds.value / fewest if point else 0.0


def _joined(words: Sequence[str]) -> str:
    """Return words as a sentence lists them: with commas, and *and* before the last."""
    return f"{', '.join(words[:-1])} and {words[-1]}"
