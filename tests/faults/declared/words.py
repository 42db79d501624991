"""Words of commands that cannot be meant."""

from collections.abc import Iterator

from tests.faults.fault import RESULTS, SMALL, Fault, compare, then, with_scene, written

STUDY = """
[[part]]
name = "sharpness"
scene = "lobe"
[part.parameters]
alpha = [0.1, 0.2]
"""


def _scene_options() -> Iterator[tuple[str, str, str]]:
    """Yield options of comparisons, values that they cannot have, and what has to be said."""
    for value in ("nan", "1e3", "x", "-1", "0", "1", "", "1.5", "99999999999999999999"):
        yield "--spp", value, "spp|range|integer"
    for value in ("x", "0x0", "16", "16x", "-1x16", "16x16x16", "1e1x16", "99999999x99999999"):
        yield "--resolution", value, "resolution|pixels|too large"
    for value in ("nan", "inf", "-1", "0", "x"):
        yield "--noise", value, "noise|float"
    for value in ("nan", "0", "-3", "x"):
        yield "--timeout", value, "timeout"
    for value in ("-1", "1.5", "x", "99"):
        yield "--sensor", value, "sensor"
    for value in ("-1", "x"):
        yield "--seed", value, "seed"
    for value in ("0", "x"):
        yield "--tessellation", value, "tessellation"
    for option, value in (
        ("--variant", "scalar_rgb"), ("--heuristic-variant", "rgb"), ("--heuristic", "phnog"),
        ("--interpolation", "gourad"), ("--pairing", "exact"), ("-D", "x"), ("-D", "=1"),
        ("-D", "nosuch=1"),
    ):  # fmt: skip
        yield option, value, r"did you mean phong|choose|one of|is not a definition|nosuch"


SMALL_WORDS = (
    ("a command with a typo", ("comapre", "a.xml"), "did you mean compare"),
    ("a scene with a typo", ("plan", "cornel-box"), "did you mean cornell-box"),
    ("a file with a typo", compare("b.xml"), "did you mean a.xml"),
    ("an option with a typo", (*compare(), "--ssp", "4"), "--spp"),
    ("no scene", ("compare",), "SCENE"),
    ("no command of that kind", ("--compare", "a.xml"), "No such option"),
    ("an empty scene", ("compare", ""), "''|folder|file|scene"),
    ("a scene of blanks", ("compare", "   "), "scene"),
    ("a scene of a kilobyte", ("compare", "x" * 1000), "scene|name too long|File name"),
    ("a scene of non-UTF-8", ("compare", b"\xff\xfe"), "scene"),
    ("a scene with a newline", ("compare", "a\nb"), "scene"),
    ("a file in a folder that is not there", ("compare", "no/such/a.xml"), "no such file"),
    ("a file below a file", ("compare", "a.xml/a.xml"), "no such file"),
    ("two scenes for one", ("plan", "a.xml", "fig-8-9"), "unexpected extra argument"),
    ("cost of two", ("cost", "a.xml", "fig-8-9"), "unexpected extra argument"),
    ("cost of no scene", ("cost",), "SCENE"),
    ("one round", ("cost", "a.xml", "--rounds", "1"), "rounds"),
    ("rounds of no number", ("cost", "a.xml", "--rounds", "nan"), "rounds"),
    ("a form that is none", ("fit", "a.xml", "--form", "cook"), "form"),
    ("a loss that is none", ("fit", "a.xml", "--loss", "l1"), "loss"),
    ("a scene that is not there to fit", ("fit", "cornell"), "did you mean cornell-box"),
    ("no baseline", ("check", "nowhere"), "there is no such baseline"),
    ("a folder without baselines", ("check", "out"), "no baseline"),
    ("a scene for a baseline", ("check", "a.xml"), "a.xml"),
    ("options of an update in a check", ("check", "out", "--spp", "4"), "--update"),
    ("significance 0", ("check", "out", "--significance", "0"), "significance"),
    ("significance 1", ("check", "out", "--significance", "1"), "significance"),
    ("significance NaN", ("check", "out", "--significance", "nan"), "significance"),
    ("an update of no scene", ("check", "new.json", "--update"), "new.json"),
    ("an update of a typo", ("check", "b", "--update", "--scene", "fig-8-99"), "did you mean"),
    ("a study that is not there", ("study", "no.toml"), "no.toml"),
    ("a study of a scene", ("study", "a.xml"), "a.xml"),
    ("a study on 0 processes", ("study", "s.toml", "--processes", "0"), "processes"),
    ("a study in two ways", ("study", "s.toml", "--processes", "1", "--workers", "1"), "exclude"),
    ("a study on no scheduler", ("study", "s.toml", "--scheduler", "x", "-o", "out"), "scheduler"),
    ("a shell that is none", ("completion", "tcsh"), "SHELL|bash"),
    ("no shell", ("completion",), "bash"),
    ("words for doctor", ("doctor", "now"), "unexpected extra argument"),
    ("words for scenes", ("scenes", "all"), "unexpected extra argument"),
    ("a report of a scene", ("report", "a.xml"), "unexpected extra argument"),
    ("a folder of no scene", ("compare", "out"), "no scene"),
    ("a scene that is text", ("compare", "mine.txt"), "mine.txt"),
    ("an option without its value", ("compare", "a.xml", "-o"), "requires an argument"),
    ("a flag with a value", (*compare(), "--fresh=1"), "fresh"),
    ("JSON of a comparison", (*compare(), "--json"), "No such option"),
    ("placeholders that no scene has", (*compare("a.xml", "fig-8-9"), "-D", "x=1"), "-D x"),
)


def faults() -> Iterator[Fault]:
    """Yield faults of words."""
    prepare = then(with_scene, written({"s.toml": STUDY}))
    for option, value, message in _scene_options():
        words = (*compare(small=False), *SMALL, option, value)
        yield Fault(f"{option} {value!r}", words, message, prepare=prepare)
    for name, words, message in SMALL_WORDS:
        yield Fault(name, words, message, prepare=prepare)
    yield Fault(
        "a timeout that is over at once", (*compare(), "--timeout", "1e-9"), "made no progress",
        (1,), prepare,
    )  # fmt: skip
    yield Fault("-o of no name", ("compare", "a.xml", "-o", "", *SMALL), "out", (0, 2), prepare)
    yield Fault(
        "the same scene twice", compare("a.xml", "a.xml"), "a.xml", (0, 2), prepare, RESULTS
    )
