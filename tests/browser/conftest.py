"""A small report, and a browser that opens it from disk."""

import shutil
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from axe_playwright_python.sync_playwright import Axe
from msgspec import structs
from playwright.sync_api import sync_playwright

from fotismos.comparisons.departure import regions
from fotismos.comparisons.departure.metrics import LEADING, THRESHOLDS, drawn, log2_luminance_ratio
from fotismos.comparisons.ladder.engine import Study
from fotismos.comparisons.records.departure import Region
from fotismos.comparisons.records.images import Comparison
from fotismos.reference.records import Machine, Missing, Pixels, plain
from fotismos.reference.rendering.gbuffer import ObjectIds
from fotismos.reports.files import results
from fotismos.reports.files.results import Failure, RunRecord
from fotismos.reports.page import page
from fotismos.reports.run import scene_files
from tests.shared import cost_records, records, term_grids

WIDTH, HEIGHT = 48, 32

#: Columns that one shape has, the other has those to the right.
LEFT = 20

#: The pixel in the middle of the spot.
WORST = 30, 12

#: Names that the page has to bear; the address knows them by plain characters.
NOISY, EXACT, FAILED = "noisy & <b>", "exact", "lost"
NOISY_ID = "noisy----b-"


@dataclass
class Report:
    """Where the report is, its records and EXR channels by scene, and the study of one."""

    url: str
    records: dict = field(default_factory=dict)
    channels: dict = field(default_factory=dict)
    study: Study | None = None


@pytest.fixture(scope="session")
def report(tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    found = Report((folder / "index.html").as_uri())
    views = []
    study = cost_records.study(NOISY)
    for name, comparison, priced in (
        (NOISY, cost_records.explained(noisy()), study),
        (EXACT, exact(), None),
    ):
        (place,) = results.assigned(folder, [(name, None)])
        views.append(scene_files.write(folder, place, comparison, priced))
        found.records[name] = plain(comparison.record)
        with OpenEXR.File(str(folder / place / "comparison.exr"), separate_channels=True) as file:
            found.channels[name] = {key: c.pixels.copy() for key, c in file.channels().items()}
    found.study = study
    failures = [Failure(scene=FAILED, error="lost.xml: there is no such file")]
    machine = Machine(processor="any", cores=2, system="Linux")
    run = RunRecord(command="", stages={"page": 1.0}, failures=(), machine=machine, versions={})
    (folder / "index.html").write_text(page.render(views, failures=failures))
    (folder / results.DETAILS).write_text(page.details(run=run))
    return found


def noisy():
    """A bright spot against noise: HDR values over many decades, some negative."""
    rng = np.random.default_rng(0)
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    spot = 40.0 * np.exp(-((x - 30) ** 2 + (y - 12) ** 2) / 30.0)
    reference = (0.05 + spot)[..., None] * rng.uniform(0.5, 1.5, (HEIGHT, WIDTH, 3))
    heuristic = reference * rng.uniform(0.3, 2.0, (HEIGHT, WIDTH, 3))
    heuristic[3, 4] = (-0.0123, 0.0, 1e-5)
    maps = {
        "dE2000": np.minimum(2 * spot, 90) + rng.random((HEIGHT, WIDTH)),
        "dE_ITP": 5 * spot,
        "dE_CAM16UCS": spot,
        "ldr_flip": spot / 40,
    }
    marks = rng.choice([0.0, 0.5, 1.0], (HEIGHT, WIDTH))
    found = comparison(NOISY, heuristic, reference, maps, marks)
    beyond = records.visible({t: 0.6 / t**1.7 for t in THRESHOLDS})
    metrics = found.record.metrics
    error = maps["dE2000"][1:]
    lead = structs.replace(
        metrics["dE2000"], visible=beyond, mean=float(error.mean()), max=float(error.max())
    )
    metrics = metrics | {"dE2000": lead}
    record = structs.replace(found.record, metrics=metrics)
    size = WIDTH, HEIGHT
    return Comparison(
        record, found.images, term_grids.grid(size, WORST), live=term_grids.points(size)
    )


def exact():
    """Two equal halves; nothing is significant."""
    half = np.full((HEIGHT, WIDTH, 3), 0.25)
    maps = dict.fromkeys(drawn(), np.zeros((HEIGHT, WIDTH)))
    found = comparison(EXACT, half, half, maps, np.zeros((HEIGHT, WIDTH), bool))
    box = Region(x=8, y=4, width=10, height=8, share=0.5, mean_dE2000=1.0, effect="extended lights")
    none = records.summary(0.0)
    none = structs.replace(none, after_exposure=structs.replace(none.after_exposure, exposure=1.0))
    record = structs.replace(
        found.record,
        metrics=found.record.metrics | dict.fromkeys(drawn(), none),
        significant=structs.replace(found.record.significant, fraction=0.0),
        regions=(box,),
        warnings=(),
        unrepresentable=(),
    )
    reason = "Flat shading does not evaluate 8.10 at pixels."
    return Comparison(
        record, found.images, Missing(reason), Missing("There are more than 16 lights.")
    )


def comparison(name, heuristic, reference, maps, significant):
    counted = np.ones((HEIGHT, WIDTH), bool)
    counted[0] = False
    first, *others = regions.find(maps["dE2000"], counted) or [None]
    left = np.tile(np.arange(WIDTH) < LEFT, (HEIGHT, 1))
    owners = ObjectIds(np.where(left, 0, 1), ("left <b>", "right"))
    carriers, places = regions.find_objects(maps["dE2000"], counted, owners, owners)
    first = first and structs.replace(first, effect="interreflection")
    record = records.record(
        scene=name,
        resolution=(WIDTH, HEIGHT),
        pixels=Pixels(counted=int(counted.sum()), total=counted.size),
        regions=tuple(filter(None, (first, *others))),
        objects=tuple(structs.replace(each, effect="occlusion") for each in carriers),
        materials=carriers,
    )
    images = records.images(
        HEIGHT,
        WIDTH,
        maps | {"log2_luminance": log2_luminance_ratio(heuristic, reference)},
        heuristic=heuristic.astype(np.float32),
        reference=reference.astype(np.float32),
        reference_stderr=0.01 * np.abs(reference),
        significant=significant,
        counted=counted,
        objects=places,
        materials=places,
    )
    return Comparison(record, images)


@pytest.fixture(scope="session")
def chromium():
    path = shutil.which("chromium") or shutil.which("chromium-browser")
    if path is None:
        pytest.skip("there is no Chromium: apt-get install chromium")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=["--disable-gpu"])
        yield browser
        browser.close()


class Visitor:
    """A page of the browser, and what it said and asked for meanwhile."""

    def __init__(self, page, report):
        self.page = page
        self.report = report
        self.complaints, self.requests = [], []
        page.on("console", lambda message: self.complaints.append(message.text))
        page.on("pageerror", lambda error: self.complaints.append(str(error)))
        page.on("request", lambda request: self.requests.append(request.url))

    def open(self, fragment=""):
        """Open the report, and wait until the scene that the fragment names is drawn."""
        if self.page.url.startswith(self.report.url):
            self.page.evaluate("fragment => { location.hash = fragment; }", fragment)
        else:
            self.page.goto(self.report.url + fragment)
        if "scene=" in fragment:
            self.wait_for_viewer(fragment.split("scene=")[1].split("&")[0])
        return self.page

    def wait_for_viewer(self, scene=NOISY_ID):
        self.page.wait_for_function(
            "scene => document.querySelector('#viewer').dataset.ready === scene", arg=scene
        )
        self.settle()

    def unfold(self):
        """Open the appendix of each scene that is there."""
        closed = self.page.locator(".scene:visible .folded:not([open]) > summary")
        for summary in reversed(closed.all()):
            summary.click()

    def settle(self):
        """Wait for two frames: drawing is asked for in one and done in the next."""
        self.page.evaluate(
            "new Promise(r => requestAnimationFrame(() => requestAnimationFrame(r)))"
        )

    def state(self):
        """The fragment's parts by name."""
        text = self.page.evaluate("location.hash.slice(1)")
        return dict(part.split("=") for part in text.split("&") if part)

    def canvas(self):
        return self.page.locator("#viewer > canvas")

    def place_of(self, x, y, zoom=None, centre=(WIDTH / 2, HEIGHT / 2), pane=None):
        """Where on the canvas the middle of a pixel is, in CSS pixels, and in which pane."""
        box = self.canvas().bounding_box()
        panes = 1 if pane is None else 4 if "on" in self.state() else 3
        columns = 2 if panes == 4 and box["width"] < 680 else panes
        row, column = divmod(pane or 0, columns)
        rows = -(-panes // columns)
        width, height = (box["width"] + 8) / columns - 8, (box["height"] + 8) / rows - 8
        zoom = zoom or min(width / WIDTH, height / HEIGHT)
        return (
            column * (width + 8) + width / 2 + (x + 0.5 - centre[0]) * zoom,
            row * (height + 8) + height / 2 + (y + 0.5 - centre[1]) * zoom,
        )

    def colour_at(self, left, top):
        """The canvas's colour at a place in CSS pixels (the tests' screens have density 1)."""
        return tuple(
            self.page.evaluate(
                """([x, y]) => {
                  const copy = document.createElement("canvas");
                  copy.width = copy.height = 1;
                  const context = copy.getContext("2d", { willReadFrequently: true });
                  context.drawImage(document.querySelector("#viewer > canvas"), -x, -y);
                  return [...context.getImageData(0, 0, 1, 1).data.slice(0, 3)];
                }""",
                [int(left), int(top)],
            )
        )

    def colour_of(self, x, y, **view):
        self.settle()
        return self.colour_at(*self.place_of(x, y, **view))

    def inspected(self):
        """The inspector's texts by name."""
        cells = self.page.locator("#inspector [data-value]").all()
        return {cell.get_attribute("data-value"): cell.text_content() for cell in cells}


@pytest.fixture
def visitor(chromium, report, request):
    """A visitor on a screen of ordinary size; at the end, nothing must have gone wrong."""
    settings = {"viewport": {"width": 1200, "height": 900}} | getattr(request, "param", {})
    context = chromium.new_context(**settings)
    visitor = Visitor(context.new_page(), report)
    yield visitor
    context.close()
    assert visitor.complaints == []
    pages = (report.url, report.url.replace("index", "details"), "data:", "about:")
    for url in visitor.requests:
        assert url.startswith(pages), url


def pytest_collection_modifyitems(items):
    for item in items:
        if Path(__file__).parent in item.path.parents:
            item.add_marker(pytest.mark.browser)


PHONE = {"viewport": {"width": 390, "height": 844}, "is_mobile": True, "has_touch": True}


VIEWS = [
    "",
    f"#scene={NOISY_ID}",
    f"#scene={NOISY_ID}&mode=error&map=effects",
    f"#scene={NOISY_ID}&t=5&box=4,4,20,9&pixel=6,6&on=0",
]


def violations(page):
    """What axe objects to: rules, and where."""
    found = Axe().run(page).response["violations"]
    return [(rule["id"], [node["html"][:120] for node in rule["nodes"]]) for rule in found]


TOP = LEADING.map_range[1]
"""The end of the colours of all maps of ΔE2000."""
