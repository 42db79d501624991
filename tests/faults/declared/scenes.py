"""Scene files that are not scenes, or lead nowhere, or in circles."""

import os
from collections.abc import Iterator
from pathlib import Path

from tests.faults.fault import (
    RESULTS,
    SMALL,
    UNPRIVILEGED,
    Fault,
    compare,
    then,
    with_scene,
    written,
)
from tests.small_scene import SCENE


def _more(text: str) -> str:
    return SCENE.replace("</scene>", text + "</scene>")


def _textured(filename: str) -> str:
    return SCENE.replace(
        '<rgb name="diffuse_reflectance" value="0.2, 0.3, 0.5"/>',
        '<texture type="bitmap" name="diffuse_reflectance">'
        f'<string name="filename" value="{filename}"/></texture>',
    )


ENTITIES = (
    f'<!ENTITY {b} "{f"&{a};" * 10}">' for a, b in zip("abcdefghi", "bcdefghij", strict=True)
)
HEAD = '<?xml version="1.0"?>'
BALL = '<shape type="sphere"/>'

FORMS = {
    "empty": "",
    "blank": "  \n\n",
    "text": "nothing of a scene",
    "JSON": '{"type": "scene"}',
    "HTML": "<!doctype html><html><body><p>404<br>not found</body></html>",
    "half of a scene": SCENE[: len(SCENE) // 2],
    "a shape alone": '<shape version="3.0.0" type="sphere"/>',
    "no version": SCENE.replace(' version="3.0.0"', ""),
    "a version of words": SCENE.replace("3.0.0", "new"),
    "an element that is none": _more("<shpae/>"),
    "an attribute that is none": _more('<shape type="sphere" colour="red"/>'),
    "an element without its type": _more("<shape/>"),
    "an attribute without quotes": _more("<shape type=sphere/>"),
    "a tag that is not closed": _more("<shape type='sphere'>"),
    "UTF-16": SCENE.encode("utf-16"),
    "bytes of no encoding": SCENE.encode().replace(b"sphere", b"sph\xe8re"),
    "a NUL": SCENE[:200] + "\0" + SCENE[200:],
    "entities in entities": f'<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa">{"".join(ENTITIES)}]>'
    + SCENE.replace('value="0.2"/>', 'value="&j;"/>'),
    "an entity from outside": HEAD + '<!DOCTYPE x [<!ENTITY a SYSTEM "file:///etc/passwd">]>'
    + SCENE.replace('value="0.2"/>', 'value="&a;"/>'),
    "elements 100000 deep": _more("<shape type='sphere'>" * 100_000),
    "comments that never end": "<!--" * 300_000,
    "itself included": _more('<include filename="a.xml"/>'),
    "a file included that is not there": _more('<include filename="no.xml"/>'),
    "a folder included": _more('<include filename="folder"/>'),
    "a pipe included": _more('<include filename="pipe"/>'),
    "/dev/zero included": _more('<include filename="/dev/zero"/>'),
    "each other included": _more('<include filename="back.xml"/>'),
    "an include of an include of a pipe": _more('<include filename="leads.xml"/>'),
    "text included": _more('<include filename="mine.txt"/>'),
    "6 levels of 10 includes": _more('<include filename="fan0.xml"/>' * 10),
    "a placeholder without a value": SCENE.replace('value="60"', 'value="$power"'),
    "a reference to nothing": _more('<ref id="nothing"/>'),
    "a reference in a circle": _more(
        '<bsdf type="twosided" id="a"><ref id="b"/></bsdf>'
        '<bsdf type="twosided" id="b"><ref id="a"/></bsdf>'
        '<shape type="sphere"><ref id="a"/></shape>'
    ),
    "one id twice": _more('<shape type="sphere" id="x"/><shape type="sphere" id="x"/>'),
    "an alias of nothing": _more('<alias id="x" as="y"/>'),
    "a texture that is not there": _textured("no.png"),
    "a texture that is a scene": _textured("a.xml"),
    "a texture that is a folder": _textured("folder"),
    "a texture that is a pipe": _textured("pipe"),
    "a texture of /dev/zero": _textured("/dev/zero"),
    "a texture of no name": _textured(""),
    "a texture with a name of 5000": _textured("x" * 5000),
    "a spectrum that is not there": SCENE.replace(
        '<rgb name="radiance" value="0.2"/>', '<spectrum name="radiance" filename="no.spd"/>'
    ),
    "a spectrum of words": SCENE.replace(
        '<rgb name="radiance" value="0.2"/>', '<spectrum name="radiance" filename="mine.txt"/>'
    ),
    "a spectrum that is a pipe": SCENE.replace(
        '<rgb name="radiance" value="0.2"/>', '<spectrum name="radiance" filename="pipe"/>'
    ),
    "no shapes": SCENE[: SCENE.index('<shape type="sphere">')] + SCENE[SCENE.index("<emitter") :],
}  # fmt: skip

RENDERED = {
    "a byte order mark": "\ufeff" + SCENE,
    "10 MB of comment": SCENE.replace("<sensor", f"<!--{' long' * 2_000_000}--><sensor"),
    "lines as on Windows": SCENE.replace("\n", "\r\n"),
    "two scenes": SCENE + SCENE,
    "a version to come": SCENE.replace("3.0.0", "99.0.0"),
    "a declaration of XML": HEAD + SCENE,
}
"""Stock Mitsuba loads these, and so does a comparison."""


def _surroundings(folder: Path) -> None:
    """Write what the scenes lead to."""
    os.mkfifo(folder / "pipe")
    part = '<scene version="3.0.0">{}</scene>'
    files = {"back.xml": _more('<include filename="a.xml"/>'), "folder": None,
             "leads.xml": part.format('<include filename="pipe"/>')}  # fmt: skip
    for level in range(6):
        inner = f'<include filename="fan{level + 1}.xml"/>' * 10 if level < 5 else BALL
        files[f"fan{level}.xml"] = part.format(inner)
    written(files)(folder)


def _in_place(make) -> object:
    """Return what makes something other than a file, called a.xml."""
    return lambda folder: make(folder / "a.xml")


PLACES = {
    "a pipe": os.mkfifo,
    "a folder of nothing": os.mkdir,
    "a link to nothing": lambda path: path.symlink_to("nowhere"),
    "a link to itself": lambda path: path.symlink_to("a.xml"),
    "a link to /dev/zero": lambda path: path.symlink_to("/dev/zero"),
}


def faults() -> Iterator[Fault]:
    """Yield faults of scene files."""
    for name, content in FORMS.items():
        prepare = then(_surroundings, written({"a.xml": content}))
        # A message has to say which file.
        yield Fault(name, compare(), r"^fotismos: error: .*(a|fan\d)\b", (2,), prepare)
    for name, content in RENDERED.items():
        yield Fault(name, compare(), "a", (0,), written({"a.xml": content}), RESULTS)
    for name, make in PLACES.items():
        yield Fault(f"a scene that is {name}", compare(), "a.xml", (2,), _in_place(make))
        beside = then(_in_place(make), written({"scenes/b.xml": SCENE}), lambda folder: (
            (folder / "a.xml").rename(folder / "scenes/a.xml")))  # fmt: skip
        # In a folder, it is skipped, or a row of the page.
        yield Fault(f"a folder of scenes with {name}", compare("scenes"), "a.xml", (0, 2), beside,
                    leaves=("out/b/comparison.json",))  # fmt: skip
    hidden = then(with_scene, lambda folder: (folder / "a.xml").chmod(0))
    yield Fault("a scene without rights", compare(), "a.xml.*denied|denied", prepare=hidden,
                shell=UNPRIVILEGED + '"$@"')  # fmt: skip
    # Files without a scene element are skipped.
    batch = then(_surroundings, written({f"s/{i}.xml": text for i, text in enumerate(
        ("", "text", _more("<shpae/>"), SCENE))}))  # fmt: skip
    yield Fault("three of four no scenes", compare("s"), "2.*shpae", (2,), batch,
                leaves=("out/3/comparison.json", "out/index.html", "out/run.json"))  # fmt: skip
    yield Fault("a plan of a broken scene", ("plan", "a.xml"), "a", (2,), written({"a.xml": "x"}))
    for command in ("cost", "fit"):
        words = (command, "a.xml", "-o", "out", *SMALL)
        yield Fault(f"{command} of a broken scene", words, "a", (2,),
                    written({"a.xml": _more("<shpae/>")}))  # fmt: skip
