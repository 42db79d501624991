"""Shading again on the page: as the kernel does, and what follows the sliders."""

import json
import re

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from fotismos.comparisons import pixel_terms
from fotismos.comparisons.departure.colour import BT709, rgb_to_xyz
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.records.departure import Viewing
from fotismos.heuristic import DirectionalLight, Material, PointLight, SpotLight, shade
from fotismos.reference.records import plain
from fotismos.reference.rendering.gbuffer import image_size, pixel_rays
from fotismos.reference.rendering.renderer import variant
from fotismos.reports.page.templating import TEMPLATES
from fotismos.reports.page.why_view import live_view
from tests.browser.conftest import EXACT, NOISY, NOISY_ID, PHONE, violations
from tests.shared.misplanned import scene as described
from tests.shared.parts import moved
from tests.shared.spheres import centres, prepared

SCENE = f"#scene={NOISY_ID}"
SCENES = (
    "fig-8-11-n9", "fig-6-5-m40", "fig-6-10", "plastic-spheres", "cornell-box", "two-intensities",
)  # fmt: skip
SCRIPTS = ("page", "images", "panels", "terms", "shading", "numbers")

STEP = 1 / 255
"""What a screen of 8 bits can show."""

SHADED = """
const points = pointsOf(data.live, await decode(data.live.grid, data.text));
return data.settings.map((each) => [...shaded(points, each)]);"""

MOVED = """
const points = pointsOf(data.live, await decode(data.live.grid, data.text));
const numbers = new Numbers(data.live, points);
return data.moved.map((text) => {
  numbers.follow(text);
  return { shaded: [...shaded(points, numbers.settings())], text: numbers.text };
});"""

DIFFERENCES = """
page.xyz = data.xyz;
const [first, second] = data.colours.map((each) => labOf(Float64Array.from(each), data.exposure));
return [...differencesOf(first, second)];"""


@pytest.fixture(scope="module")
def run(chromium):
    """A function that runs a body of JavaScript on data, with the page's functions."""
    code = "\n".join((TEMPLATES / f"viewer/{name}.js").read_text() for name in SCRIPTS)
    tab = chromium.new_page()
    yield lambda body, data: tab.evaluate(f"async (data) => {{ {code}\n{body} }}", data)
    tab.close()


def changed(rng, start):
    """Return settings with every number moved at random."""
    settings = json.loads(json.dumps(start))
    for material in settings["materials"]:
        for name in ("k_a", "k_d", "k_s", "ambient"):
            material[name] = (np.array(material[name]) * rng.uniform(0, 1.5)).tolist()
        material["k_i"] = rng.uniform(0, 0.2, 3).tolist()
        material["n"] *= rng.uniform(0.5, 2)
    for light in settings["lights"]:
        key = "position" if "position" in light else "direction"
        light[key] = (np.array(light[key]) + rng.normal(0, 0.3, 3)).tolist()
        for name in ("diffuse_intensity", "specular_intensity"):
            light[name] = (np.array(light[name]) * rng.uniform(0.5, 1.5)).tolist()
        if "position" in light:
            light["attenuation"] = rng.uniform(0.1, 1, 3).tolist()
        if "cutoff" in light:
            light |= {"cutoff": [rng.uniform(20, 80)], "exponent": [rng.uniform(0, 30)]}
    return settings


def kernel(half, index, settings):
    """Return the kernel's values (H, W, 3) at the centres of a half's pixels."""
    width, height = image_size(half.scene)
    places = np.meshgrid(np.arange(width), np.arange(height))
    ray = pixel_rays(half.scene, (width, height), *places)
    si = half.scene.ray_intersect(ray)
    normal, _ = half.integrator.seen_side(half.scene, si, si.is_valid())
    if settings["is_flat"]:
        normal = dr.select(dr.dot(si.n, ray.d) < 0, si.n, -si.n)
    lights, total = [light_of(light) for light in settings["lights"]], 0.0
    for place, one in enumerate(settings["materials"]):
        own = Material(**{key: one[key] for key in ("k_i", "k_a", "k_d", "k_s", "n", "form")})
        value = shade(si.p, normal, -ray.d, own, lights, tuple(one["ambient"]))
        value = np.array(value + dr.zeros(mi.Color3f, width * height)).T
        total = total + np.where(index.reshape(-1, 1) == place + 1, value, 0)
    return total.reshape(height, width, 3)


def light_of(numbers):
    """Return the kernel's light of the page's."""
    given = {key: value for key, value in numbers.items() if key != "name"}
    for key in {"cutoff", "exponent", "clamped", "shell"} & given.keys():
        (given[key],) = given[key]
    kind = SpotLight if "cutoff" in given else PointLight if "position" in given else None
    return (kind or DirectionalLight)(**{k: tuple(v) if isinstance(v, list) else v
                                         for k, v in given.items()})  # fmt: skip


@pytest.mark.guarantee("kernel", "A page shades its points again as the kernel does, to 1/255.")
@pytest.mark.parametrize("name", SCENES)
def test_the_page_shades_as_the_kernel_does(run, name):
    ready, options = prepared(name, resolution=(40, 30))
    half = ready.heuristic
    points = pixel_terms.live(half, options)
    view = live_view(points)
    start = plain(
        {
            "materials": view.data["materials"],
            "lights": view.data["lights"],
            "is_flat": view.data["is_flat"],
        }
    )
    rng = np.random.default_rng(3)
    settings = [start, *(changed(rng, start) for _ in range(4)), start | {"is_flat": True}]
    data = {"live": view.manifest(), "text": view.grid.data, "settings": settings}
    found = np.reshape(run(SHADED, data), (len(settings), 30, 40, 3))
    with variant(half.variant):
        expected = np.array([kernel(half, points.planes["material"], each) for each in settings])
    assert expected.max() > 0.1
    assert (abs(found - expected) / np.maximum(expected, 1)).max() <= STEP
    moved = abs(expected[1:-1] - expected[0]).max(axis=(1, 2, 3))
    assert moved.min() > STEP


def beam(ball=None, spot=None, key=None, ambient=(0.1, 0.2, 0.3)):
    """Return a floor and a ball that shines, under a spot and a lamp; parts have other numbers."""
    shiny = {"type": "phong", "id": "shiny", "k_i": 0.1, "k_a": 0.3, "k_d": 0.5, "k_s": 0.4, "n": 9}
    matt = {"type": "phong", "id": "matt", "k_a": 0.5, "k_d": 0.8}
    cone = {"type": "heuristic_spot", "position": [0.5, -1, 3], "direction": [0, 0.2, -1]}
    cone |= {"intensity": 2.0, "cutoff": 25.0, "exponent": 4.0, "k0": 0.5, "k1": 0.2}
    lamp = {"type": "heuristic_point", "position": [-2, -3, 2], "intensity": 0.7}
    return described(
        (0, -5, 3),
        size=32,
        floor={"type": "rectangle", "to_world": moved((0, 0, 0), 2.0), "bsdf": matt},
        ball={"type": "sphere", "radius": 0.6, "bsdf": shiny | (ball or {})},
        spot=cone | (spot or {}),
        key=lamp | (key or {}),
        integrator={"type": "heuristic", "ambient": {"type": "rgb", "value": list(ambient)}},
    )


def law(k0, k1, k2):
    return {"k0": float(k0), "k1": float(k1), "k2": float(k2)}


#: Sliders as the address has them, and the numbers of the scene that they must lead to.
SLIDERS = {
    "k_i:shiny:0.35": {"ball": {"k_i": 0.35}},
    "I_a:0:0.6": {"ambient": (0.2, 0.4, 0.6)},
    "f_att:spot:0": {"spot": law(1, 0, 0)},
    "f_att:spot:1": {"spot": law(0, 1, 0)},
    "f_att:key:2": {"key": law(0, 0, 1)},
    "m:spot:20": {"spot": {"exponent": 20.0}},
    "m:spot:0": {"spot": {"exponent": 0.0}},
    "cutoff:spot:12": {"spot": {"cutoff": 12.0}},
    "L_d:key:0.5,L_s:key:2": {"key": {"diffuse_intensity": 0.35, "specular_intensity": 1.4}},
    "L_s:spot:0,intensity:spot:3": {"spot": {"diffuse_intensity": 3.0, "specular_intensity": 0.0}},
    "I_a:0:0,cutoff:spot:40,f_att:spot:2,intensity:spot:30,m:spot:1.5": {
        "ambient": (0.0, 0.0, 0.0),
        "spot": law(0, 0, 1) | {"cutoff": 40.0, "exponent": 1.5, "intensity": 30.0},
    },
}


def image_of(scene):
    """Return what the integrator of a scene has at the centres of 40 × 30 pixels."""
    ready, options = prepared(scene, resolution=(40, 30))
    half = ready.heuristic
    with variant(half.variant):
        image = centres(half.scene, half.integrator, (40, 30), range(40), range(30))
    return image, half, options


@pytest.mark.guarantee(
    "kernel", "A page's sliders show what a scene of their numbers does, to 1/255."
)
def test_sliders_lead_to_the_picture_of_a_scene_with_their_numbers(run):
    before, half, options = image_of(beam())
    points = pixel_terms.live(half, options)
    view = live_view(points)
    owners = view.data["materials"], view.data["lights"]
    names = [list(dict.fromkeys(one["name"] for one in several)) for several in owners]
    places = {name: place for each in names for place, name in enumerate(each)}
    texts = [
        re.sub(r":([a-z]+):", lambda found: f":{places[found[1]]}:", words) for words in SLIDERS
    ]
    data = {"live": view.manifest(), "text": view.grid.data, "moved": ["", *texts, ""]}
    start, *found, again = run(MOVED, data)
    seen = points.planes["material"] > 0
    assert start == again
    for one, text, numbers in zip(found, texts, SLIDERS.values(), strict=True):
        expected, *_ = image_of(beam(**numbers))
        shaded = np.reshape(one["shaded"], (30, 40, 3))
        off = abs(shaded - expected) / np.maximum(expected, 1)
        assert off[seen].max() <= STEP, text
        assert abs(expected - before)[seen].max() > 5 * STEP, text
        assert one["text"] == text


def test_an_address_moves_only_what_the_scene_has_and_within_its_range(run):
    _, half, options = image_of("fig-6-5-m40")
    view = live_view(pixel_terms.live(half, options))
    absent = ("k_i:0:0.3", "I_a:0:0.3", "flat:0:1", "k_d:1:0.3", "m:1:3", "no:0:1", "__proto__:0:1")
    wrong = ("m:0:", "m:0", "m:0:x", "f_att:0:-1")
    kept = {
        "m:0:3": "m:0:3",
        "m:0:3,k_i:0:1,,:": "m:0:3",
        "cutoff:0:500": "cutoff:0:90",
        "intensity:0:1e9": "intensity:0:4",
        "intensity:0:9,f_att:0:2": "f_att:0:2,intensity:0:9",
    }
    data = {"live": view.manifest(), "text": view.grid.data, "moved": [*absent, *wrong, *kept]}
    found = [one["text"] for one in run(MOVED, data)]
    assert found == ["" for _ in absent + wrong] + list(kept.values())


def test_differences_of_colours_are_those_of_the_metric(run):
    rng = np.random.default_rng(1)
    first = rng.uniform(-0.1, 2, (500, 3)) ** 2
    second = first * rng.uniform(0.5, 1.5, (500, 3))
    greys = np.repeat(rng.uniform(0, 1, (2, 40, 1)), 3, axis=2)
    pair = np.concatenate((first, greys[0])), np.concatenate((second, greys[1]))
    viewing = Viewing(exposure=0.7)
    data = {"xyz": rgb_to_xyz(BT709).tolist(), "exposure": viewing.exposure}
    found = run(DIFFERENCES, data | {"colours": [each.ravel().tolist() for each in pair]})
    np.testing.assert_allclose(found, LEADING(*pair, viewing), rtol=1e-6, atol=1e-6)


IN_SIGHT = """element => {
  const box = element.getBoundingClientRect();
  const there = document.elementFromPoint(box.left + 9, box.top + box.height / 2);
  return there === element;
}"""


# --- On the page -------------------------------------------------------------------------------


def opened(visitor):
    """Open the section of a scene's page, and return the section."""
    visitor.open(SCENE).locator("#live summary").click()
    return ready(visitor)


def ready(visitor):
    """Wait until the section is drawn, and return it."""
    visitor.page.wait_for_function(
        "() => document.querySelector('#live [data-part=size]').textContent"
    )
    visitor.settle()
    return visitor.page.locator("#live")


def choice(section, name):
    """Return the list of a name: material, lamp, f_att or flat."""
    return section.locator(f"select:is([name={name}], [data-part={name}])")


def names_shown(section):
    """Return the names of the controls that are shown, in their order."""
    return section.locator("[name]:visible").evaluate_all("all => all.map(one => one.name)")


def slider(section, name):
    return section.locator(f"input[name={name}]")


def drag(visitor, section, name, part):
    """Drag a slider's handle to a part of its length."""
    slider(section, name).scroll_into_view_if_needed()
    box = slider(section, name).bounding_box()
    mouse = visitor.page.mouse
    places = float(slider(section, name).evaluate("e => (e.value - e.min) / (e.max - e.min)")), part
    for place, act in zip(places, (mouse.down, mouse.up), strict=True):
        middle = box["y"] + box["height"] / 2
        mouse.move(box["x"] + 8 + place * (box["width"] - 16), middle, steps=4)
        act()
    visitor.settle()


def shown(section):
    """Return the numbers, and the pictures as bytes."""
    parts = ("mean", "first", "best")
    numbers = {name: float(section.locator(f"[data-part={name}]").text_content()) for name in parts}
    pixels = """element => {
      const copy = Object.assign(document.createElement("canvas"), { width: 48, height: 32 });
      const context = copy.getContext("2d", { willReadFrequently: true });
      context.drawImage(element, 0, 0);
      return [...context.getImageData(0, 0, 48, 32).data];
    }"""
    canvases = ("shown", "reference", "error")
    pictures = {n: section.locator(f"canvas[data-part={n}]").evaluate(pixels) for n in canvases}
    return numbers, pictures


def test_the_start_is_the_stored_picture(visitor, report):
    numbers, pictures = shown(opened(visitor))
    channels = report.channels[NOISY]
    halves = [
        np.stack([channels[f"{half}.{c}"] for c in "RGB"], axis=-1)
        for half in ("heuristic", "reference")
    ]
    viewing = Viewing(**report.records[NOISY]["viewing"])
    mean = LEADING(*halves, viewing)[1:].mean()  # its first row does not count
    assert numbers == dict.fromkeys(numbers, pytest.approx(mean, rel=1e-2))
    linear = np.clip(halves[0] * viewing.exposure, 0, 1)
    levels = 255 * np.where(linear < 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    found = np.reshape(pictures["shown"], (*levels.shape[:2], 4))[..., :3]
    np.testing.assert_allclose(found, levels, atol=1.01)


def test_map_mean_and_best_follow_a_slider_and_start_again_restores_all(visitor):
    section = opened(visitor)
    numbers, pictures = shown(section)
    best = [numbers["best"]]
    for name, part in (("k_d", 0.9), ("intensity", 0.6), ("x", 0.3), ("k_d", 0.02), ("n", 0.4)):
        before = shown(section)
        drag(visitor, section, name, part)
        now = shown(section)
        assert now[0]["first"] == numbers["first"]
        if name != "n":  # the first material is matt
            assert now[0]["mean"] != before[0]["mean"]
            assert now[1]["error"] != before[1]["error"]
            assert now[1]["shown"] != before[1]["shown"]
        assert now[1]["reference"] == pictures["reference"]
        best.append(now[0]["mean"])
        assert now[0]["best"] <= min(best)
        assert now[0]["best"] <= before[0]["best"]
    assert now[0]["best"] == min(best)
    assert len(set(best)) > 3
    section.get_by_role("button", name="Start again").click()
    visitor.settle()
    again = shown(section)
    assert again == (numbers | {"best": now[0]["best"]}, pictures)


def test_keys_move_a_slider_and_flat_normals_show_steps(visitor):
    section = opened(visitor)
    start = shown(section)
    slider(section, "k_d").focus()
    for _ in range(5):
        visitor.page.keyboard.press("ArrowLeft")
    visitor.settle()
    assert float(slider(section, "k_d").get_attribute("aria-valuetext")) < 0.6
    assert shown(section)[0]["mean"] != start[0]["mean"]
    section.get_by_role("button", name="Start again").click()
    choice(section, "flat").select_option("1")
    visitor.settle()
    image = [np.reshape(each[1]["shown"], (32, 48, 4)) for each in (start, shown(section))]
    change = abs(image[1] - image[0])
    assert change[:, :24].max() <= 1  # no steps there
    assert change[:, 24:].max() > 20


def test_controls_are_there_only_for_what_a_light_has(visitor):
    section = opened(visitor)
    material = ["k_i", "k_a", "k_d", "k_s", "n"]
    point = ["intensity", "L_d", "L_s", "f_att", "x", "y", "z"]
    for name, own in (
        ("key", point),
        ("sun", [name for name in point if name != "f_att"]),
        ("cone", [*point[:4], "m", "cutoff", *point[4:]]),
    ):
        choice(section, "lamp").select_option(name)
        assert names_shown(section) == [*material, *own, "I_a", "flat"]
    assert slider(section, "cutoff").get_attribute("aria-valuetext") == "30.0°"
    assert "as given: 1, 0, 0" in choice(section, "f_att").text_content()


def test_each_new_slider_changes_the_picture_and_the_address_reopens_it(visitor):
    section = opened(visitor)
    choice(section, "material").select_option("shiny")
    choice(section, "lamp").select_option("cone")
    pictures = [shown(section)]
    for name, part in (("k_i", 0.5), ("I_a", 0.8), ("L_d", 0.1), ("L_s", 0.9), ("m", 0.5),
                       ("cutoff", 0.2)):  # fmt: skip
        drag(visitor, section, name, part)
        pictures.append(shown(section))
        assert pictures[-1][1]["shown"] != pictures[-2][1]["shown"], name
    choice(section, "f_att").select_option("quadratic: 1 / d²")
    visitor.settle()
    assert shown(section)[1]["shown"] != pictures[-1][1]["shown"]
    choice(section, "flat").select_option("1")
    visitor.settle()
    now = shown(section)
    visitor.page.locator("#viewer button[data-mode=split]").click()
    visitor.settle()
    assert visitor.state()["mode"] == "split"
    address = visitor.page.url
    assert {part.split(":")[0] for part in visitor.state()["live"].split(",")} == {
        "k_i", "I_a", "L_d", "L_s", "m", "cutoff", "f_att", "flat"
    }  # fmt: skip
    places = section.locator("[name]").evaluate_all("all => all.map(one => one.value)")

    visitor.page.goto("about:blank")
    visitor.page.goto(address)
    visitor.wait_for_viewer()
    section = ready(visitor)
    again = shown(section)
    assert again[1] == now[1]
    assert {name: again[0][name] for name in ("mean", "first")} == {
        name: now[0][name] for name in ("mean", "first")
    }
    # What was moved is chosen.
    assert section.locator("[name]").evaluate_all("all => all.map(one => one.value)") == places
    assert visitor.page.url == address
    section.get_by_role("button", name="Start again").click()
    assert "live" not in visitor.state()
    visitor.page.evaluate("hash => { location.hash = hash; }", "#" + address.split("#")[1])
    visitor.settle()
    visitor.settle()
    assert shown(section)[1] == now[1]


def test_a_scene_without_points_says_why(visitor):
    page = visitor.open(f"#scene={EXACT}")
    assert "more than 16 lights" in page.locator("#live").text_content()
    assert not page.locator("#live details").is_visible()


@pytest.mark.parametrize(
    "visitor", [{}, {"color_scheme": "dark"}, PHONE], indirect=True, ids=["light", "dark", "phone"]
)
def test_the_open_section_is_for_everybody(visitor):
    choice(opened(visitor), "lamp").select_option("cone")
    assert not violations(visitor.page)
    cut = """all => all.filter(one => one.scrollWidth > one.clientWidth + 1 ||
      one.offsetLeft + one.offsetWidth > one.parentElement.offsetLeft +
      one.parentElement.offsetWidth + 1).map(one => one.textContent)"""
    assert not visitor.page.locator("#live label > :visible").evaluate_all(cut)
    first = visitor.page.locator("#live canvas").first
    for name in ("k_i", "z", "I_a"):
        handle = slider(visitor.page.locator("#live"), name)
        handle.evaluate("slider => slider.scrollIntoView()")
        assert handle.evaluate(IN_SIGHT), name
        assert first.evaluate(IN_SIGHT), name


def test_an_exponent_is_printed_plainly_in_one_line(visitor):
    visitor.open(f"{SCENE}&live=n:1:1020")
    section = ready(visitor)
    choice(section, "material").select_option(label="shiny")
    output = slider(section, "n").locator("xpath=../output")
    assert output.text_content() == "1020"
    assert output.bounding_box()["height"] < 30


LIGHT = """
const light = { name: "spot", intensity: [3, 3, 3], specular_intensity: [3, 3, 3], lobe: 1,
  cosIncidence: 1, cosReflection: 1, diffuse: [0, 0, 0], specular: [0, 0, 0], ...data };
return lightRows(light, { k_d: [1, 1, 1], k_s: [1, 1, 1], n: 8, form: "phong" })[0].textContent;"""


def test_a_factor_of_0_is_named(run):
    """As outside of a spot's cone: "3 × 0" would not say which factor it is."""
    assert "Ip0 fatt = 3 × 0.5" in run(LIGHT, {"attenuation": 0.5})
    said = run(LIGHT, {"attenuation": 0})
    assert "fatt = 0: none of its light arrives; Ip0 = 3" in said


RATIO = """
page.epsilon = 1e-4;
const scene = { judged: { name: "textbook" }, truth: { name: "physical" } };
const ratio = Painter.prototype.ratio;
return ratioText({ scene, ratio, luminances: () => data }, 0);"""


@pytest.mark.parametrize(
    ("luminances", "said"),
    [
        ([0, 0.1], "textbook is black"),
        ([0.1, 0], "physical is black"),
        ([0, 0], "both are black"),
        ([0.2, 0.1], "1.0 stops"),
    ],
)
def test_a_ratio_to_black_is_not_a_number_of_stops(run, luminances, said):
    assert run(RATIO, luminances) == said
