"""The content of docs/accuracy.md: studies of cost over many scenes, and their common findings.

``./run docs --accuracy`` measures for 40 minutes on an idle machine, and writes the page.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from statistics import median

import heuristic  # noqa: F401  isort: skip  it finds LLVM before Dr.Jit is imported

from comparisons.case import open_case
from comparisons.cost.cost import cost
from comparisons.cost.cost_record import Cost, Measured
from comparisons.cost.front import ERRORS, cheapest
from comparisons.cost.measure import Effort
from comparisons.cost.methods import FULL_PLAN, STAND_INS
from comparisons.gallery.builtin import SCENES
from comparisons.options import Options
from reports.terminal.tables import markdown
from reports.terminal.words import number, parameter, seconds
from tests.benchmarks import prediction

LARGER = tuple(sorted((Path(__file__).parent / "scenes").glob("*.py")))
WIDTH = 256
TOLERANCES = ERRORS[:3]

AT_FULL_SIZE = "cornell-box", "plastic-spheres", str(LARGER[0].with_stem("outdoors"))
FULL_SIZE, FEW_ROUNDS = 512, 3


def measured(
    names: Sequence[str] = (*SCENES, *map(str, LARGER)),
    size: tuple[int, int] = (WIDTH, 3 * WIDTH // 4),
    effort: Effort | None = None,
) -> list[Cost]:
    """Study what accuracy costs on each scene, in turn."""
    found = []
    for name in names:
        case = open_case(name, Options(resolution=size))
        found.append(cost(case.source, case.options, effort).record)
        print(name, flush=True)
    return found


def setting(records: Sequence[Cost]) -> Iterator[str]:
    """Yield the conditions of the measurement."""
    first = records[0]
    width, height = first.resolution
    yield (
        f"{len(records)} scenes at {width} by {height} pixels, {first.rounds} rounds, on"
        f" {first.machine.cores} cores of {first.machine.processor}."
    )


def at_full_size() -> list[Cost]:
    """Study three scenes at the size at which people render."""
    return measured(AT_FULL_SIZE, (FULL_SIZE, FULL_SIZE), Effort(rounds=FEW_ROUNDS))


def fronts(records: Sequence[Cost]) -> Iterator[str]:
    """Yield the Pareto front of each study, from the fastest method to the most accurate."""
    first = records[0]
    width, height = first.resolution
    yield f"At {width} by {height} pixels, {first.rounds} rounds."
    yield ""
    rows = [
        (record.scene, point.method, str(point.spp), _time(point), number(point.error.mean))
        for record in records
        for point in sorted(record.points, key=lambda point: point.seconds.value)
        if point.pareto
    ]
    head = "Scene", "Method", "Samples per pixel", "Time", "Mean ΔE2000"
    yield from markdown([head, *rows], right=2)


def predictions() -> Iterator[str]:
    """Yield how predictions compare with later measurements, scene by scene."""
    found = prediction.run(rounds=7)
    width, height = prediction.TARGET
    yield f"At {width} by {height} pixels, 6 and 32 samples per pixel, none of them fitted."
    yield " ".join(prediction.summary(found))
    yield ""
    yield from markdown([prediction.HEAD, *prediction.rows(found)], right=1)


def pictures(records: Sequence[Cost]) -> Iterator[str]:
    """Yield the charts of the larger scenes, for the page."""
    for record, file in charts(records):
        yield f"![Error against time: {record.scene.replace('_', ' ')}]({file})"


def charts(records: Sequence[Cost]) -> Iterator[tuple[Cost, str]]:
    """Yield the studies of the larger scenes, and the file of each chart."""
    names = {file.stem: f"cost-{file.stem.replace('_', '-')}.svg" for file in LARGER}
    yield from ((record, names[record.scene]) for record in records if record.scene in names)


def methods(records: Sequence[Cost]) -> Iterator[str]:
    """Yield a row per scene: the kernel, the cheapest way to each error, and the full plan."""
    head = "Scene", "Textbook", *(f"within {parameter(limit)}" for limit in TOLERANCES), "Full plan"
    rows = [
        (
            record.scene,
            _cell(_first(record, "Phong kernel")),
            *(_named(cheapest(record.points, limit)) for limit in TOLERANCES),
            _cell(_points(record, FULL_PLAN.name)[-1]),
        )
        for record in records
    ]
    yield from markdown([head, *rows], right=0)


def attribution(records: Sequence[Cost]) -> Iterator[str]:
    """Yield what each effect removes and adds: the scenes where it matters, and medians there."""
    worth: dict[str, list[float]] = {}
    for record in records:
        for one in record.attribution.effects:
            if one.removes.low > 0:
                worth.setdefault(one.effect, []).append(one.removes.value)
    rows = [
        (
            effect,
            f"{len(found)}",
            number(median(found)),
        )
        for effect, found in sorted(worth.items(), key=lambda row: -len(row[1]))
    ]
    head = "Effect", "scenes", "removes, mean ΔE2000"
    yield from markdown([head, *rows], right=1)


def findings(records: Sequence[Cost]) -> Iterator[str]:
    """Yield the common findings of the studies, as list items."""
    for limit in TOLERANCES:
        yield f"- {_within(records, limit)}"
    yield f"- {_worth_most(records)}"
    yield f"- {_stand_ins(records)}"


def _within(records, limit):
    """Return how many scenes need only a kernel for an error, and the time it saves."""
    enough, saved = [], []
    for record in records:
        chosen = cheapest(record.points, limit)
        full = cheapest(_points(record, FULL_PLAN.name), limit)
        if chosen and _family(record, chosen.method) == "kernel":
            enough.append(record.scene)
            if full:
                saved.append(full.seconds.value / chosen.seconds.value)
    said = (
        f"Within a mean ΔE2000 of {parameter(limit)}, a kernel without paths is the cheapest way in"
        f" {len(enough)} of {len(records)} scenes"
    )
    return f"{said}: {median(saved):.2g} times as fast as the full plan." if saved else f"{said}."


def _worth_most(records):
    """Return which effects are worth most, and in how many scenes."""
    first = Counter()
    for record in records:
        sure = [one for one in record.attribution.effects if one.removes.low > 0]
        if sure:
            first[max(sure, key=lambda one: one.removes.value).effect] += 1
    if not first:
        return "No effect surely removes anything."
    ranked = ", then ".join(f"{effect} ({count})" for effect, count in first.most_common(3))
    return f"The effect worth most, by the number of scenes: {ranked}."


def _stand_ins(records):
    """Return which stand-ins are on a Pareto front, and in how many scenes."""
    names = [method.name for method in STAND_INS]
    on_front = Counter(
        name
        for record in records
        for name in {point.method for point in record.points if point.pareto}.intersection(names)
    )
    never = [name for name in names if not on_front[name]]
    said = "; ".join(f"{name} ({count})" for name, count in on_front.most_common()) or "none"
    left = f" Never: {'; '.join(never)}." if never else ""
    left += (
        " Measured in version 0.2, lost in all scenes and gone since: spherical harmonics; ambient"
        " occlusion; ambient occlusion from the depth image."
    )
    return f"Stand-ins on the Pareto front, by the number of scenes: {said}.{left}"


def _points(record: Cost, name: str) -> tuple[Measured, ...]:
    """Return the points of a method, even if a scene has merged it with another."""
    return record.points_of(next(method.name for method in record.methods if name in method.names))


def _first(record, name):
    return _points(record, name)[0]


def _family(record, name):
    return next(method.family for method in record.methods if method.name == name)


def _cell(point):
    return f"{number(point.error.mean)} in {_time(point)}"


def _time(point):
    time = point.seconds
    return f"{seconds(time.median)} ({seconds(time.low)} to {seconds(time.high)})"


def _named(point):
    return f"{point.method}, {point.spp} spp: {_cell(point)}" if point else "none"
