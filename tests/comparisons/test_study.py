"""Studies: designs, surfaces against formulas, points that are kept, datasets and findings."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from msgspec import structs
from PIL import Image
from scipy.special import erf

from docs.figures import phong_roughplastic
from fotismos.comparisons.departure.metrics import METRICS
from fotismos.comparisons.processes.pool import Pool
from fotismos.comparisons.study import dataset, design, running, scenes, sheet
from fotismos.heuristic import user_shaders
from fotismos.heuristic.errors import InputError
from fotismos.reports.charts import study_charts, vega
from tests.shared.programs import ROOT
from tests.shared.quadrature import dot, integral
from tests.witnesses.fresnel import dielectric

# --- Designs --------------------------------------------------------------------------------------


def part(parameters, scene="lobe", more=""):
    return f"[[part]]\nscene = '{scene}'\n{more}\n[part.parameters]\n{parameters}\n"


def points(*words):
    return design.parse(part(*words)).parts[0].points()


def test_a_grid_has_all_combinations_the_material_slowest():
    found = points("light_angle = [0, 30]\nalpha = {from = 0.1, to = 0.4, steps = 3}")
    combinations = [(a, angle) for a in (0.1, 0.25, 0.4) for angle in (0, 30)]
    assert [(p["alpha"], p["light_angle"]) for p in found] == combinations
    assert all(p["int_ior"] == 1.5 and p["reflectance"] == 0.5 for p in found)
    found = points("alpha = {from = 0.1, to = 0.8, steps = 4, scale = 'log'}")
    assert [p["alpha"] for p in found] == pytest.approx([0.1, 0.2, 0.4, 0.8])


def test_a_drawn_design_fills_its_ranges_evenly():
    words = (
        "alpha = {from = 0.1, to = 1, scale = 'log'}\nlight_angle = {from = 20, to = 60}\n"
        "int_ior = [1.3, 1.7]", "lobe", "design = 'sobol'\npoints = 1024\nseed = ",
    )  # fmt: skip
    found = points(*words[:2], words[2] + "3")
    assert found == points(*words[:2], words[2] + "3")
    assert found != points(*words[:2], words[2] + "4")
    names = ("alpha", "light_angle", "int_ior")
    alpha, angle, ior = (np.array([p[name] for p in found]) for name in names)
    assert np.all((alpha >= 0.1) & (alpha <= 1) & (angle >= 20) & (angle <= 60))
    assert abs(np.mean(ior == 1.3) - 0.5) < 0.05
    counts = np.histogram2d(np.log10(alpha), angle, bins=8, range=((-1, 0), (20, 60)))[0]
    assert (counts == 16).all()  # the points are a net


FIGURE = """[[figure]]
name = 'f'
title = 't'
part = 'lobe'
where = {{alpha = {0}}}
[figure.chart]
mark = "{1}"
encoding.x = {{field = "{2}", type = "quantitative"}}
"""
MISTAKES = (
    ("", "there are no parts"),
    ("parts = []", "'parts' is not known .did you mean part"),
    ("a = " + 100_000 * "[" + 100_000 * "]", "not TOML"),
    (part("alpha = " + 10_000 * "1"), "not TOML"),
    ("title = 5\n" + part("alpha = 1"), "`str"),
    (part("alfa = 1"), "'alfa' is not known.*alpha"),
    (part("alpha = 0"), "alpha = 0: give a number from 0.02 to 1[.]"),
    (part("alpha = []"), "at least one value"),
    (part("alpha = [true]"), "alpha: Expected `float`, got `bool`"),
    (part("alpha = nan"), "alpha = nan: give a number from 0.02 to 1[.]"),
    (part("light_angle = 95"), "light_angle = 95: give a number from 0 to 89 deg[.]"),
    (part("'a.b' = inf", "s.xml"), "a.b = inf: give a finite number"),
    (part("alpha = {from = 0.1, to = 1, stepps = 3}"), "alpha: .*unknown field `stepps`"),
    (
        part("alpha = {from = 0.1, to = 1, steps = 4}", "lobe", "design = 'sobol'\npoints = 4"),
        "from and to, without steps",
    ),
    (part("alpha = {from = 0.1, to = 1}"), "from, to and steps"),
    (part("alpha = {from = 0.5, to = 0.1, steps = 3}"), "from 0.5 to 0.1"),
    (part("light_angle = {from = 0, to = 9, steps = 3, scale = 'log'}"), "above 0"),
    (part("alpha = 0.1\nn = 3"), "two materials"),
    (part("alpha = 0.1", "lobe", "design = 'latin'"), "latin"),
    (part("alpha = {from = 0.1, to = 1}", "lobe", "design = 'sobol'\npoints = 500"), "256 or 512"),
    (part("alpha = [0.1]", "lobe", "design = 'sobol'\npoints = 4"), "no parameter has a range"),
    (part("alpha = 0.1") * 2, "each its own"),
    (part("alpha = 0.1", "lobe", "heuristic = 'mine.py'"), "is not rendered.*mine.py on sphere or"),
    (part("alpha = 0.1", "lobe", "name = '../../evil'"), "name = '../../evil': .*slash"),
    (part("alpha = 0.1") + FIGURE.format("'x'", "line", "alpha"), "got `str`.*where"),
    (
        part("alpha = 0.1") + FIGURE.replace("alpha =", "n =").format(1, "line", "alpha"),
        "'n' is no",
    ),
    (part("alpha = 0.1") + FIGURE.replace("'f'", "'../evil'").format(0.1, "", ""), "'../evil'.*sl"),
    (part("alpha = 0.1") + FIGURE.replace("'lobe'", "'nix'").format(0.1, "", ""), "part = 'nix'"),
    (
        part("alpha = 0.1") + FIGURE.format(0.1, "", "") + "data.url = 'a.csv'",
        "url = 'a.csv'.*Omit",
    ),
    (
        part("alpha = 0.1") + FIGURE.format(0.1, "", "").replace("[figure.chart]", "kind = 'map'"),
        "kind",
    ),
)


@pytest.mark.guarantee("runs", "A mistake in a study's file is one message, before anything runs.")
def test_a_mistake_is_refused_with_what_is_allowed(tmp_path):
    for text, expected in MISTAKES:
        with pytest.raises(InputError, match=f"(?s){expected}"):
            design.parse(text)
    with pytest.raises(InputError, match=r"nix\.toml: No such file"):
        design.read(tmp_path / "nix.toml")


# --- Surfaces -------------------------------------------------------------------------------------
# Against formulas that share nothing with the kernel or Mitsuba.


def rows(*words):
    found = [
        running.evaluated(point)[0] for point in running.all_points(design.parse(part(*words)))
    ]
    assert all(row["error"] is None for row in found), found[0]["error"]
    return found


def torrance_sparrow(light, view, alpha, ior):
    """Specular radiance in the plane of incidence, display-linear: pi f cos(light).

    Beckmann's distribution and Smith's shadowing in its exact form; Mitsuba has Walter's rational
    fit of the latter, within 0.4 %.
    """

    def shadowing(angle):
        a = 1 / (alpha * np.maximum(np.tan(angle), 1e-6))
        return 2 / (1 + erf(a) + np.exp(-(a**2)) / (a * np.sqrt(np.pi)))

    light, view = np.deg2rad(light), np.deg2rad(view)
    half = (light - view) / 2
    slopes = np.exp(-((np.tan(half) / alpha) ** 2)) / (np.pi * alpha**2 * np.cos(half) ** 4)
    reflectance = dielectric(np.cos((light + view) / 2), ior)
    return np.pi * reflectance * slopes * shadowing(light) * shadowing(view) / (4 * np.cos(view))


def phong_albedo(k_d, k_s, n, degrees):
    """Exitance over irradiance of (8.10); light at ``degrees``."""

    def reflected(light, view, half):
        mirrored = np.stack([-light[0], -light[1], light[2]])
        return (k_d + k_s * np.maximum(dot(mirrored, view), 0) ** n / light[2]) / np.pi

    return integral(reflected, degrees)


@pytest.mark.thorough
def test_phong_reflects_more_than_it_receives_for_a_large_k_s():
    parameters = "n = [1, 9, 100]\nk_d = 0.3\nk_s = [0.5, 2]\nlight_angle = [0, 75]"
    found = rows(parameters, "lobe", "pairing = 'literal'")
    for row in found:
        expected = phong_albedo(0.3, row["k_s"], row["n"], row["light_angle"])
        assert row["albedo_heuristic"] == pytest.approx(expected, rel=1e-3)
        assert row["albedo_reference"] < 1
    assert max(row["albedo_heuristic"] for row in found if row["n"] == 1) > 1
    (row,) = rows("k_s = 0\nk_d = 0.6\nlight_angle = 30")  # diffuse
    assert row["dE2000"] == pytest.approx(0, abs=1e-4)
    assert (row["albedo_heuristic"], row["albedo_reference"]) == pytest.approx((0.6, 0.6), rel=1e-5)


def test_the_reference_rises_towards_grazing_and_peaks_off_the_mirror_direction():
    """By Fresnel's factor and the view's cosine, neither of which Phong's model has."""
    found = rows("alpha = 0.1\nlight_angle = [0, 40, 80]")
    for row in found:
        angle = row["light_angle"]
        assert row["specular_heuristic"] == pytest.approx(row["k_s"], rel=1e-5)
        expected = torrance_sparrow(angle, angle, 0.1, 1.5)
        assert row["specular_reference"] == pytest.approx(expected, rel=0.01)
    first, _, last = (row["specular_reference"] for row in found)
    assert last / first > dielectric(np.cos(np.deg2rad(80)), 1.5) / dielectric(1.0, 1.5) > 9
    views = np.arange(0, 89.9, 0.02)
    for row in rows("alpha = [0.2, 0.4]\nlight_angle = [40, 50]"):
        angle = row["light_angle"]
        peak = views[np.argmax(torrance_sparrow(angle, views, row["alpha"], 1.5))]
        assert peak > angle + 1
        assert row["peak_reference"] == pytest.approx(peak, abs=0.4)
        assert row["peak_heuristic"] == pytest.approx(angle, abs=0.11)


# --- Renderings -----------------------------------------------------------------------------------

SMALL = "spp = 16\nresolution = [12, 12]"
TEXT = f"""title = "A small study"
[[part]]
scene = "lobe"
[part.parameters]
alpha = [0.2, 0.4]
light_angle = [0, 60]
[[part]]
scene = "enclosure"
{SMALL}
[part.parameters]
wall_albedo = [0, 0.9]
[[part]]
scene = "cornell-box"
{SMALL}
[part.parameters]
"white.reflectance" = [0.2, 0.9]
"""


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A study of all kinds of scenes, and its table."""
    study = design.parse(TEXT)
    table, done = running.run(study, tmp_path_factory.mktemp("study"))
    assert (done, failed(table)) == (8, [])
    return study, table


def failed(table):
    """Return why points failed."""
    return [row["error"] for row in table.to_pylist() if row["error"]]


def test_a_scene_of_ones_own_is_varied_by_paths(finished, rgb):
    _, table = finished
    dark, bright = (row for row in table.to_pylist() if row["part"] == "cornell-box")
    assert (dark["white.reflectance"], bright["white.reflectance"]) == (0.2, 0.9)
    assert bright["reference"] > 1.3 * dark["reference"]
    assert bright["interreflection"] > 2 * dark["interreflection"]
    for scene, path, expected in (
        ("cornell-box", "white.albedo", "white.reflectance"),
        ("nowhere", "a.b", "neither a file nor"),
        ("metameric-pair", "a.b", "llvm_ad_spectral"),
    ):
        with pytest.raises(InputError, match=f"part '{scene}': .*{expected}"):
            rows(f"'{path}' = 0.5", scene)


def test_the_dataset_says_units_meanings_and_where_it_comes_from(finished, tmp_path):
    study, table = finished
    (tmp_path / "d.parquet").write_bytes(dataset.file_of(table))
    again = dataset.read(tmp_path / "d.parquet")
    assert again.equals(table, check_metadata=True)
    assert all(field.metadata[b"description"] for field in again.schema)
    assert again.schema.field("light_angle").metadata[b"unit"] == b"deg"
    assert again.schema.metadata[b"study"].decode() == study.text
    assert "mitsuba" in json.loads(again.schema.metadata[b"versions"])
    (tmp_path / "bad.parquet").write_text("nothing")
    with pytest.raises(InputError, match=r"bad\.parquet"):
        dataset.read(tmp_path / "bad.parquet")


def test_other_values_and_options_are_other_points(rgb):
    others = "seed = 1", "spp = 16", "resolution = [8, 8]", "pairing = 'literal'"
    texts = [part("alpha = 0.1", "sphere", more) for more in ("name = 'other'", "", *others)]
    texts += [part("alpha = 0.2", "sphere"), part("alpha = 0.1", "enclosure")]
    first, second, *keys = (running.all_points(design.parse(text))[0].key for text in texts)
    assert first == second
    assert len({first, *keys}) == len(keys) + 1


FILES = """<scene version="3.0.0"><integrator type="path"/>
<sensor type="perspective"><film type="hdrfilm"/></sensor>
<shape type="obj"><string name="filename" value="m.obj"/><bsdf type="diffuse" id="paint">
<rgb name="reflectance" value="0.5"/></bsdf></shape>
<emitter type="point"><point name="position" x="0" y="0" z="-2"/>
<rgb name="intensity" value="9"/></emitter></scene>"""


@pytest.mark.guarantee("runs", "A study is done again once a file of its scene changes.")
def test_a_study_is_done_again_once_a_file_of_its_scene_changes(rgb, tmp_path):
    text = part("'paint.reflectance' = 0.4", "s.xml", SMALL)
    study, values = design.parse(text, folder=tmp_path), []
    for size, intensity in ((1, 9), (2, 9), (2, 3)):
        lines = [f"v {x * size} {y * size} 3" for x, y in ((-1, -1), (1, -1), (0, 2))]
        (tmp_path / "m.obj").write_text("\n".join([*lines, "f 1 2 3", "f 3 2 1", ""]))
        (tmp_path / "s.xml").write_text(FILES.replace('"9"', f'"{intensity}"'))
        table, done = running.run(study, tmp_path / "out")
        assert (done, failed(table)) == (1, [])
        assert running.run(study, tmp_path / "out")[1] == 0
        values += table["reference"].to_pylist()
    assert len(set(values)) == 3


# --- Runs that end early --------------------------------------------------------------------------


class Ending:
    """A pool of this process that is interrupted after some tasks."""

    def __init__(self, count):
        self.count = count

    def each(self, tasks, told=None):
        for number, done in enumerate(Pool(0).each(tasks)):
            if number == self.count:
                raise KeyboardInterrupt
            yield done


@pytest.mark.guarantee("runs", "A study that ended early goes on, and repeats nothing.")
def test_a_study_that_ended_early_goes_on_and_repeats_nothing(rgb, tmp_path):
    study = design.parse(part("alpha = [0.1, 0.2]\nlight_angle = [0, 60]"))
    whole, _ = running.run(study, tmp_path / "whole")
    with pytest.raises(KeyboardInterrupt):
        running.run(study, tmp_path / "cut", Ending(2))
    half = next((tmp_path / "cut/points").glob("*.json"))
    half.write_text(half.read_text()[:40])
    table, done = running.run(study, tmp_path / "cut")
    assert done == 3  # the damaged one again
    assert table.equals(whole)
    assert running.run(study, tmp_path / "cut")[1] == 0


@pytest.mark.guarantee("runs", "A study with a Python shader is never continued, but done again.")
def test_a_study_with_a_python_shader_is_done_again(rgb, tmp_path):
    (tmp_path / "level").write_text("0.25")
    shader = tmp_path / "mine.py"
    shader.write_text(
        f"import numpy as np\nlevel = float(np.loadtxt({str(tmp_path / 'level')!r}))\n"
        "def shade(point): return point.ambient * 0 + level\n"
    )
    text = part("alpha = [0.1, 0.2]", "sphere", f"{SMALL}\nheuristic = '{shader}'")
    study = design.parse(text, folder=tmp_path)
    first, done = running.run(study, tmp_path / "out")
    assert (done, failed(first)) == (2, [])
    (tmp_path / "level").write_text("0.75")
    user_shaders.forget()  # as in a new process
    second, done = running.run(study, tmp_path / "out")
    assert done == 2
    assert first["heuristic"].to_pylist() != second["heuristic"].to_pylist()


def test_a_point_that_fails_is_a_row_that_says_why(rgb, tmp_path, monkeypatch):
    study = design.parse(part("alpha = [0.1, 0.2, 0.3]"))
    lobe = scenes.lobe

    def fails_once(point, options):
        return 1 / 0 if point["alpha"] == 0.2 else lobe(point, options)

    with monkeypatch.context() as patch:
        patch.setattr(scenes, "lobe", fails_once)
        table, _ = running.run(study, tmp_path)
    assert table["error"].to_pylist() == [None, "ZeroDivisionError: division by zero", None]
    assert table["dE2000"].to_pylist()[1] is None
    assert table["alpha"].to_pylist() == [0.1, 0.2, 0.3]
    table, done = running.run(study, tmp_path)
    assert (done, failed(table)) == (1, [])


# --- The command ----------------------------------------------------------------------------------


def test_the_command_writes_dataset_and_figures(run, tmp_path):
    file, out = tmp_path / "small.toml", tmp_path / "out"
    file.write_text(part("alpha = [0.2, 0.4]\nlight_angle = [0, 60]"))
    code, printed, messages = run("study", file, "-o", out)
    assert code == 0, messages
    assert dataset.read(out / "study/small/small.parquet").num_rows == 4
    assert "mean ΔE2000: least" in (out / "study/small/index.html").read_text(encoding="utf-8")
    assert "<svg" in (out / "study/small/figures/lobe.svg").read_text()
    assert "4       0" in printed
    code, printed, _ = run("study", file, "-o", out)
    assert (code, "4 points were kept" in printed) == (0, True)
    file.write_text(part("alfa = 1"))
    code, _, messages = run("study", file, "-o", out)
    assert (code, "small.toml: part 1: 'alfa' is not known" in messages) == (2, True)


@pytest.mark.parametrize(
    ("shown", "message"),
    [
        ((0.2, "line", "dE200"), "figure 'f': column 'dE200' is not known (did you mean dE2000?)"),
        (("[0.3]", "line", "dE2000"), "no point has alpha = [0.3]"),
        ((0.2, "lines", "dE2000"), "figure 'f': chart: 'lines' is an invalid value for `mark`"),
    ],
)
def test_a_figure_of_nothing_is_refused_before_anything_runs(run, tmp_path, shown, message):
    file = tmp_path / "small.toml"
    file.write_text(part("alpha = [0.2, 0.4]") + FIGURE.format(*shown))
    code, printed, messages = run("study", file, "-o", tmp_path / "out")
    assert (code, printed) == (2, "")
    assert message in messages
    assert not (tmp_path / "out").exists()


def test_a_study_sweeps_declared_parameters(rgb, written):
    written(
        "from fotismos.heuristic import Range\n"
        "def shade(point, gain: Range(0, 1) = 0.5): return gain * point.material.base_color\n"
    )
    more = f"{SMALL}\nheuristic = 'mine.py'"
    found = rows("heuristic.gain = [0, 0.5, 1]\nalpha = 0.6", "sphere", more)
    assert len({row["dE2000"] for row in found}) == 3
    for text, message in (
        ("heuristic.gian = 1", "parameter of mine.py:? 'gian' is not known .did you mean gain"),
        ("heuristic.gain = [0, 2]", "gain = 2.0 is not allowed: give a value from 0 to 1"),
    ):
        with pytest.raises(InputError, match=message):
            rows(text, "sphere", more)


# --- The shipped study ----------------------------------------------------------------------------

FILE = ROOT / "studies/phong-roughplastic.toml"
PAGE = ROOT / "docs/phong-roughplastic.md"


@pytest.fixture(scope="module")
def shipped():
    return design.read(FILE), dataset.read(FILE.with_suffix(".parquet"))


def has_values(table, column):
    return column in table.column_names and table[column].null_count < len(table)


def test_the_shipped_dataset_is_that_of_its_study(shipped, rgb):
    study, table = shipped
    assert FILE.with_suffix(".parquet").stat().st_size < 1_000_000
    assert table.schema.metadata[b"study"].decode() == study.text
    assert table["error"].null_count == len(table)
    everywhere = [(part.name, values) for part in study.parts for values in part.points()]
    for row, (name, values) in zip(table.to_pylist(), everywhere, strict=True):
        assert row["part"] == name
        assert {key: row[key] for key in values} == pytest.approx(values, rel=1e-9)
    every = {"incidence": 80, "by name": 160, "lamp": 28}
    points = running.all_points(study)
    younger_metrics = {name for name in METRICS if not has_values(table, name)}
    assert not younger_metrics & {"dE2000", "dE_ITP", "dE_CAM16UCS", "rmse"}
    for name, step in every.items():
        known = {row["point"]: row for row in dataset.rows(table, name)}
        for each in [each for each in points if each.part.name == name][::step]:
            row, _ = running.evaluated(each)
            for column in row.keys() - younger_metrics - {"exposure"}:
                value, expected = row[column], known[row["point"]][column]
                if isinstance(value, float):
                    # The fourth digit: compilers differ, and noise floors magnify it.
                    close = pytest.approx(expected, rel=2e-3, abs=2e-3)
                    assert value == close, (name, column, row["point"])


def test_the_page_says_what_the_dataset_says(shipped):
    study, table = shipped
    text = PAGE.read_text()
    assert phong_roughplastic.page(study, table) == text
    column = table.column_names.index("dE2000")
    changed = table.set_column(column, table.schema.field("dE2000"), table["rmse"])
    assert phong_roughplastic.page(study, changed) != text
    shown = re.findall(r"!\[Figure (\d+): .*?\]\((.*?)\)", text)
    assert [int(number) for number, _ in shown] == list(range(1, len(study.figures) + 1))
    assert all("<svg" in (PAGE.parent / path).read_text() for _, path in shown)


def test_every_figure_has_its_points_and_says_what_it_averages(shipped):
    study, table = shipped
    for figure in study.figures:
        spec = study_charts.chart(figure, table, study)
        assert spec["title"]["text"] == figure.title
        assert len(spec["data"]["values"]) >= 12
        assert "http" not in str({key: spec[key] for key in spec if key != "$schema"})
    error = {"field": "dE2000", "aggregate": "mean", "type": "quantitative"}
    chart = {"mark": "line", "encoding": {"x": {"field": "k_s", "type": "ordinal"}, "y": error}}
    figure = design.StudyFigure(name="f", title="t", part="energy", chart=chart)
    spec = study_charts.chart(figure, table, study)
    assert spec["title"]["subtitle"] == "mean over n, light angle"
    assert spec["encoding"]["y"] == error | {"title": "ΔE2000"}
    spec = study_charts.chart(structs.replace(figure, where={"light_angle": 45}), table, study)
    assert spec["title"]["subtitle"] == "mean over n"
    assert {row["light_angle"] for row in spec["data"]["values"]} == {45}


@pytest.mark.parametrize("design_of", ["grid", "sobol"])
def test_a_part_without_a_figure_shows_its_error_over_its_parameters(shipped, design_of):
    study, table = shipped
    kept = tuple(part for part in study.parts if part.design == design_of)
    for figure in study_charts.all_figures(replace(study, parts=kept, figures=())):
        spec = study_charts.chart(figure, table, study)
        study_charts.check_charts(replace(study, figures=(figure,)))
        marks = {"grid": "rect", "sobol": "circle"}
        assert spec["mark"] == marks[design_of]
        assert spec["encoding"]["color"]["field"] == "dE2000"
        assert b"<svg" in vega.paper(spec)


# --- Contact sheets -------------------------------------------------------------------------------


def test_a_sheet_has_six_levels_of_two_parameters_and_the_middle_of_others():
    many = "alpha = {from = 0.1, to = 1, steps = 19}\nreflectance = [0.1, 0.4, 0.9]\n"
    chosen = design.parse(part(f"{many}light_angle = [0, 60]", "sphere")).parts[0]
    found = sheet.sheet_of(chosen)
    assert (found.down, found.across, found.points.shape) == ("alpha", "light_angle", (6, 2))
    shown = np.array(chosen.points())[found.points]
    assert {point["reflectance"] for point in shown.ravel()} == {0.4}
    for row, level in zip(shown, (0.1, 0.3, 0.45, 0.65, 0.8, 1), strict=True):
        assert [point["light_angle"] for point in row] == [0, 60]
        assert row[0]["alpha"] == row[1]["alpha"] == pytest.approx(level, abs=0.06)
    for words in (("alpha = [0.1, 0.2]", "lobe"), ("alpha = 0.2", "sphere")):
        assert sheet.sheet_of(design.parse(part(*words)).parts[0]) is None


def test_a_sheet_shows_both_halves_of_each_point_where_its_labels_are(rgb, run, tmp_path):
    file = tmp_path / "small.toml"
    file.write_text(part("reflectance = [0, 1]\nlight_angle = [0, 80]", "sphere", SMALL))
    code, _, _ = run("study", file, "-o", tmp_path)
    folder = tmp_path / "study/small"
    study = design.read(file)
    kept = running.kept_pictures(running.all_points(study), folder)
    assert (code, sorted(kept)) == (0, [0, 1, 2, 3])
    dark, _, bright, aside = (kept[number].mean(axis=(1, 2, 3)) for number in range(4))
    assert (bright > dark + 20).all()
    assert (bright > aside + 20).all()
    with Image.open(folder / "figures/sheet-sphere.webp") as opened:
        whole = np.asarray(opened.convert("L"), float)
    # The brightest of the four cells is above at the left: reflectance 1, light from the viewer.
    is_cell = whole < 250
    rows, columns = np.nonzero(is_cell & (whole < 40))
    middle = (rows.min() + rows.max()) // 2, (columns.min() + columns.max()) // 2
    quarters = [
        part_of[:, side].sum()
        for part_of in (whole[rows.min() : middle[0]], whole[middle[0] : rows.max()])
        for side in (slice(columns.min(), middle[1]), slice(middle[1], columns.max()))
    ]
    assert np.argmax(quarters) == 0
    assert "sheet" in (folder / "index.html").read_text(encoding="utf-8")
