"""From the words of a command to scenes and options."""

import shlex
from pathlib import Path

import click

from heuristic.errors import InputError
from reports.asked.scripts import Script, scenes_in

VARIANTS = ("llvm_ad_rgb", "llvm_ad_spectral", "llvm_ad_mono")


class Resolution(click.ParamType):
    """``WIDTHxHEIGHT``, as two positive integers."""

    name = "WxH"

    def convert(self, value, param, ctx):
        """Parse the text, or fail with what is allowed."""
        if isinstance(value, tuple):
            return value
        width, separator, height = value.lower().partition("x")
        if not (separator and width.isdecimal() and height.isdecimal()):
            self.fail(f"{value!r} is no resolution; write it like 512x512.", param, ctx)
        return int(width), int(height)


def output_option(default):
    """Return the option for the folder of the results."""
    return click.option(
        "-o",
        "--output",
        default=default,
        show_default=True,
        type=click.Path(path_type=Path),
        help="Folder for the results.",
    )


def figures_option(command):
    """Add the option that writes figures for print."""
    return click.option(
        "--figures",
        is_flag=True,
        help="Write figures for print, as SVG and PDF, to OUTPUT/figures.",
    )(command)


def fresh_option(command):
    """Add the option that renders what is finished already."""
    return click.option(
        "--fresh",
        is_flag=True,
        help="Render all scenes; without it, finished ones are found again in OUTPUT.",
    )(command)


def rendering_options(command):
    """Add the options that all commands which render have in common."""
    options = (
        click.option("--variant", type=click.Choice(VARIANTS),
                     help="Mitsuba variant. [default: llvm_ad_rgb, or llvm_ad_spectral for a scene"
                     " with tabulated spectra]"),
        click.option("--heuristic-variant", type=click.Choice(VARIANTS),
                     help="Variant of the heuristic half, where it is another: RGB shading against"
                     " a spectral reference. [default: the scene's own, else that of --variant]"),
        click.option("--seed", default=0, show_default=True, type=click.IntRange(min=0),
                     help="Seed of the run; each pass hashes its own from it."),
        click.option("--spp", type=click.IntRange(min=2),
                     help="Samples a pixel, over all passes. [default: the plan's]"),
        click.option("--resolution", type=Resolution(),
                     help="Width and height in place of the film's own."),
        click.option("--interpolation", type=click.Choice(["flat", "gouraud", "phong"]),
                     help="Shading of polygons in the heuristic half. [default: the scene's own,"
                     " else phong]"),
        click.option("--tessellation", type=click.IntRange(min=1), metavar="N",
                     help="Mesh the shapes of the heuristic half: N edges a quarter turn or a"
                     " straight side. [default: the scene's own, else 16 for flat and gouraud]"),
        click.option("--everything", is_flag=True,
                     help="Switch off all pruning: simulate what is not called for, too."),
        click.option("--pairing", default="matched", show_default=True,
                     type=click.Choice(["literal", "matched"]),
                     help="How roughplastic and phong are paired."),
    )  # fmt: skip
    for option in reversed(options):
        command = option(command)
    return command


class Parameter(click.ParamType):
    """``NAME=VALUE`` for a placeholder ``$NAME`` of a scene file."""

    name = "NAME=VALUE"

    def convert(self, value, param, ctx):
        """Split the text, or fail with what is allowed."""
        if isinstance(value, tuple):
            return value
        key, separator, text = value.partition("=")
        if not (separator and key):
            self.fail(f"{value!r} is no parameter; write it like name=value.", param, ctx)
        return key, text


def scene_options(command):
    """Add the options that say what is taken from a scene file."""
    options = (
        click.option("-D", "define", type=Parameter(), multiple=True,
                     help="Value for a placeholder $NAME of a scene file; may be repeated."),
        click.option("--sensor", type=click.IntRange(min=0), metavar="N",
                     help="Which sensor of the scene, from 0. [default: the first]"),
    )  # fmt: skip
    for option in reversed(options):
        command = option(command)
    return command


def check_installation():
    """See that LLVM is usable, before anything compiles.

    Raises
    ------
    InstallationError
        Saying what was found, what is needed and how to get it.
    """
    from heuristic import backend

    backend.check()


def expand(names):
    """Return the names of scenes, with the scenes in it in place of each folder."""
    return [
        scene
        for name in names
        for scene in (map(str, scenes_in(Path(name))) if Path(name).is_dir() else [name])
    ]


def find(name):
    """Return the name that a scene goes by, without reading it.

    All scenes of a command are found before anything is rendered: a typing mistake costs nothing.
    """
    from comparisons.gallery.builtin import builtin

    path = _file(name)
    return builtin(name).name if path is None else path.stem


def _file(name):
    """Return the path of a scene that is a file, None for a built-in one."""
    path = Path(name)
    if path.suffix not in (".xml", ".py") and not path.exists():
        return None
    if not path.is_file():
        raise InputError(
            f"{name}: there is no such file. Give a Mitsuba scene (.xml), a Python file"
            " that makes one (.py), a folder of such, or the name of a built-in scene;"
            " `fotismos scenes` lists them."
        )
    return path


def defined(rendering):
    """Return the values for the placeholders of a scene file, by name, as text."""
    return {name: str(value) for name, value in dict(rendering.get("define") or ()).items()}


def job(name, rendering):
    """Find a scene, and complete the options with what it asks for."""
    from comparisons.gallery.builtin import Scene, builtin
    from reference.planning.planner import wants_spectra
    from reference.scene.graph import Source

    path = _file(name)
    if path is not None:
        content = Script(path) if path.suffix == ".py" else path
        source = Source(path.stem, content, defined(rendering))
        spectral = rendering["variant"] is None and wants_spectra(source.parse())
        scene = Scene(path.stem, "", dict, "llvm_ad_spectral" if spectral else "llvm_ad_rgb")
    else:
        scene = builtin(name)
        source = scene.source()
    own = {
        "variant": scene.variant,
        "heuristic_variant": scene.heuristic_variant,
        "interpolation": scene.interpolation,
        "tessellation": scene.tessellation,
    }
    if rendering["variant"] is not None:
        own["heuristic_variant"] = None  # who names the variant means both halves
    chosen = {key: value for key, value in rendering.items() if value is not None}
    return source, dict.fromkeys(rendering) | own | chosen


def options(rendering):
    """Turn the command's options into those of a comparison."""
    from comparisons.compare import Options
    from heuristic.interpolation import Interpolation
    from reference.pairing.factors import Convention

    return Options(
        seed=rendering["seed"],
        spp=rendering["spp"],
        noise=rendering.get("noise"),
        resolution=rendering["resolution"],
        convention=Convention(rendering["pairing"]),
        heuristic_variant=rendering["heuristic_variant"],
        interpolation=Interpolation(rendering["interpolation"]),
        tessellation=rendering["tessellation"],
        everything=rendering["everything"],
        sensor=rendering.get("sensor") or 0,
    )


def _word(source):
    """Return the word that names a scene in a command."""
    if isinstance(source.content, Script):
        return str(source.content.path)
    return source.name if callable(source.content) else str(source.content)


def command(source, rendering, verb="compare"):
    """Return the command that repeats what was done with one scene."""
    scene = _word(source)
    words = ["fotismos", verb, scene]
    for name, value in source.parameters.items():
        words += ["-D", f"{name}={value}"]
    for key, value in rendering.items():
        if key == "define":
            continue
        if value is True:
            words.append(f"--{key.replace('_', '-')}")
        elif value not in (None, False):
            text = "x".join(map(str, value)) if key == "resolution" else str(value)
            words += [f"--{key.replace('_', '-')}", text]
    return shlex.join(words)
