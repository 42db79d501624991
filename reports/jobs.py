"""The options that commands share, and what their words ask for."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.shell_completion import CompletionItem

from heuristic.backend import VARIANTS
from reports.terminal import verbosity

if TYPE_CHECKING:
    from comparisons.case import Request


def _resolution(text):
    """Parse ``WIDTHxHEIGHT``, two positive integers."""
    width, separator, height = text.lower().partition("x")
    if not (separator and width.isdecimal() and height.isdecimal()):
        raise click.BadParameter(f"{text!r} is no resolution; write it like 512x512.")
    return int(width), int(height)


def _definition(text):
    """Parse ``NAME=VALUE`` for a placeholder ``$NAME`` of a scene file."""
    name, separator, value = text.partition("=")
    if not (separator and name):
        raise click.BadParameter(f"{text!r} is no parameter; write it like name=value.")
    return name, value


def complete_scene(context, parameter, beginning):
    """Complete a SCENE: the built-in ones that begin so, or else files."""
    from comparisons.gallery.builtin import SCENES

    named = [name for name in SCENES if name.startswith(beginning)]
    found = [CompletionItem(name, help=SCENES[name].title) for name in named]
    return found or [CompletionItem(beginning, type="file")]


scene_argument = click.argument("scene", metavar="SCENE", shell_complete=complete_scene)
scenes_argument = click.argument(
    "scenes", nargs=-1, required=True, metavar="SCENE...", shell_complete=complete_scene
)
json_option = click.option("--json", "as_json", is_flag=True, help="Print JSON.")


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


figures_option = click.option(
    "--figures", is_flag=True, help="Write figures for print, as SVG and PDF, to OUTPUT/figures."
)
fresh_option = click.option(
    "--fresh",
    is_flag=True,
    help="Render all scenes; without it, finished ones are found again in OUTPUT.",
)


def rendering_options(command):
    """Add the options that all commands which render have in common."""
    return _with(
        command,
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
        click.option("--resolution", type=_resolution, metavar="WxH",
                     help="Width and height in place of the film's own."),
        click.option("--heuristic", metavar="NAME",
                     help="Which heuristic shades: phong, blinn, or one that a package declares."
                     " [default: phong]"),
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
        click.option("--allow-empty", is_flag=True,
                     help="Take pictures in which no pixel sees a surface."),
    )  # fmt: skip


def scene_options(command):
    """Add the options that say what is taken from a scene file."""
    return _with(
        command,
        click.option("-D", "define", type=_definition, multiple=True, metavar="NAME=VALUE",
                     help="Value for a placeholder $NAME of a scene file; may be repeated."),
        click.option("--sensor", type=click.IntRange(min=0), metavar="N",
                     help="Which sensor of the scene, from 0. [default: the first]"),
    )  # fmt: skip


def _with(command, *options):
    for option in reversed(options):
        command = option(command)
    return command


def make_ready():
    """Ensure that LLVM is usable, and keep standard output for results.

    Raises
    ------
    InstallationError
        Saying what was found, what is needed and how to get it.
    """
    from heuristic import backend

    backend.check()
    verbosity.divert_mitsuba()


def expand(names: Iterable[str]) -> list[str]:
    """Return the names of scenes, with the scenes in it in place of each folder."""
    return [scene for name in names for scene in _within(Path(name)) or [name]]


def _within(folder: Path) -> list[str]:
    """Return the scenes in a folder; none for what is not one."""
    if not folder.is_dir():
        return []
    from reference.scene.script import scenes_in

    return list(map(str, scenes_in(folder)))


def request(words: Mapping[str, Any]) -> Request:
    """Return what the words of a command ask for about the rendering of its scenes."""
    from comparisons.case import Request

    return Request.of({**words, "define": dict(words.get("define") or ())})
