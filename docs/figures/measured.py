"""Measurements for the documents: ``./run docs --all`` measures and writes them again.

Times belong to the machine; nothing else should run at the same time.
"""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import msgspec
import numpy as np

from docs.figures import density, light_counts, phong_roughplastic
from docs.figures.documents import DOCS, ROOT, fact, replace, run, write_table
from fotismos.comparisons import atomic
from fotismos.comparisons.case import open_case
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.ladder.cost import cost
from fotismos.comparisons.options import Options
from fotismos.comparisons.records.fit import FitRecord
from fotismos.comparisons.study import dataset, design
from fotismos.reports.charts import vega
from fotismos.reports.charts.cost_charts import titled

COST_SCENE = "cornell-box"
ROUNDS = 30
VERIFIED = ("fig-8-9", "fig-6-10", "cornell-box", "plastic-spheres", "narrow-band-lamp")
CHAPTER_8 = (
    *(f"fig-8-{number}{letter}" for number in (5, 6, 7, 8) for letter in "abc"),
    "fig-8-9",
    "fig-8-11-n9",
    "fig-8-11-n3",
)


def write() -> None:
    """Measure all errors and times in the documents again."""
    density.write()
    light_counts.write()
    baselines()
    shipped_study()
    write_table("noise", fact("intervals_in_noise"))
    write_table("fits", fits())
    replace("../README.md", "cost", attribution())
    replace("plans.md", "gains", gains())
    replace("speed.md", "speed", speed())


def baselines() -> None:
    """Measure all baselines of the tests again, not only those that moved."""
    for file in (ROOT / "tests" / "baselines").glob("*.exr"):
        file.unlink()
    words = ("-q", "-m", "", "tests/test_baselines.py", "--fotismos-update")
    subprocess.run([sys.executable, "-P", "-m", "pytest", *words], cwd=ROOT, check=True)


def fits() -> Iterator[tuple[str, ...]]:
    """Fit the figures of chapter 8, and yield their errors before and after."""
    words = ("-P", "-m", "fotismos.reports", "fit", *CHAPTER_8, "--json")
    done = subprocess.run([sys.executable, *words], cwd=ROOT, check=True, capture_output=True)
    label = f"mean {LEADING.label}"
    yield "scene", "form", f"paired {label}", f"fitted {label}", "parameter error", "model error"
    for record in msgspec.json.decode(done.stdout, type=list[FitRecord]):
        best = record.nearest
        departure = best.departure[LEADING.name]
        errors = departure.before, departure.after, best.parameter_error, best.loss
        yield record.scene, best.form, *(f"{each:z.2f}" for each in errors)


def shipped_study() -> None:
    """Study Phong against roughplastic, and write its dataset, its figures and their page."""
    file = ROOT / "studies/phong-roughplastic.toml"
    with TemporaryDirectory() as folder:
        run("study", str(file), "-o", folder)
        made = Path(folder, "study", file.stem)
        table = dataset.read(made / f"{file.stem}.parquet")
        atomic.write(file.with_suffix(".parquet"), dataset.file_of(table))
        for figure in (made / "figures").glob("*.svg"):
            atomic.write(DOCS / file.stem / figure.name, figure.read_bytes())
    atomic.write(DOCS / f"{file.stem}.md", phong_roughplastic.page(design.read(file), table))


def attribution() -> Iterator[str]:
    """Study the cost of accuracy, draw its chart, and yield the README's sentences."""
    case = open_case(COST_SCENE, Options())
    record = cost(case.source, case.options).record
    atomic.write(DOCS / "cost-cornell-box.svg", vega.paper(titled(record)))
    points = sorted(record.points, key=lambda one: one.spp)
    kernel, *_ = (one for one in points if one.method == "Phong kernel")
    shadows, *_ = (one for one in points if one.method == "kernel with shadows")
    few, *_, many = (one for one in points if one.method == "full plan")
    ratio = {one.name: f"{one.ratio.value:.2g}" for one in record.methods}
    yield (
        f"A path-traced sample costs {ratio['full plan']} times a textbook sample; direct light"
        f" alone costs {ratio['direct']} times. The kernel stays at mean ΔE2000"
        f" {kernel.error.value:.1f} however many samples it takes; path tracing reaches"
        f" {few.error.value:.1f} with {few.spp} samples per pixel and {many.error.value:.1f} with"
        f" {many.spp}. Adding shadows alone gives {shadows.error.value:.1f}, because the"
        " interreflection that would fill them is missing."
    )


def gains() -> Iterator[str]:
    """Verify plans, and yield their savings; noise leaves two digits of them."""
    measured = fact("gains", *VERIFIED)
    found = (f"{scene} {float(f'{gain:.2g}'):,g}" for scene, gain in measured.items())
    yield f"{', '.join(found)}."


def speed() -> Iterator[str]:
    """Yield sentences on the kernel's speed, and on many lights."""
    data = fact("speed", ROUNDS)
    times = data["times"]
    ratios = data["ratios"]
    unrolled_ratio = ratios["Numba, three lights"]
    yield (
        f"The kernel takes {times['Dr.Jit']:.1f} ms, {ratios['memory copy']:.1f} times a memory"
        f" copy of what it reads and writes. It is {ratios['NumPy']:.0f} times as fast as NumPy,"
        f" {ratios['Numba']:.0f} times as fast as Numba in parallel for any number of lights, and"
        f" {unrolled_ratio:.1f} times as fast as Numba with its lights unrolled."
    )
    many = data["lights"]
    each = [row["ns"] for row in many if row["lights"] >= 1_000]
    unrolled = np.median([row["unrolled_ns"] for row in many])
    yield ""
    yield (
        f"With 1,000 to 10,000 lights it takes {min(each):.2f} to {max(each):.2f} ns per light and"
        f" point; eight unrolled lights take {unrolled:.2f} ns. Compile time stays under"
        f" {max(row['compile_s'] for row in many):.1g} s."
    )
