"""The command line.

Exit codes: 0 done; 1 a check failed; 2 bad input or installation. A mistake of the user's gets one
message on standard error, never a traceback. Mitsuba and colour-science are imported by the
commands that need them, so that ``--help`` and usage errors answer at once.
"""

import json
import shlex
import sys
from pathlib import Path
from time import perf_counter

import click

from heuristic.errors import FotismosError, InputError
from heuristic.version import __version__

START = perf_counter()
VERIFIED_AT = (128, 128)
"""Resolution at which a report verifies its plans."""

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


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__, prog_name="fotismos")
def cli():
    """Textbook shading against physically based rendering, scene by scene."""


def _rendering_options(command):
    options = (
        click.option("--variant", type=click.Choice(VARIANTS),
                     help="Mitsuba variant. [default: llvm_ad_rgb, or llvm_ad_spectral for a scene"
                     " with tabulated spectra]"),
        click.option("--heuristic-variant", type=click.Choice(VARIANTS),
                     help="Variant of the heuristic half, where it is another: RGB shading against"
                     " a spectral reference. [default: the scene's own, else that of --variant]"),
        click.option("--seed", default=0, show_default=True, type=click.IntRange(min=0),
                     help="Seed of the first pass."),
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
                     help="Switch off all pruning: simulate what no proof says is not needed."),
        click.option("--pairing", default="matched", show_default=True,
                     type=click.Choice(["literal", "matched"]),
                     help="How roughplastic and phong are paired."),
    )  # fmt: skip
    for option in reversed(options):
        command = option(command)
    return command


def _output_option(default):
    return click.option(
        "-o",
        "--output",
        default=default,
        show_default=True,
        type=click.Path(path_type=Path),
        help="Folder for the results.",
    )


@cli.command()
@click.argument("scenes", nargs=-1, required=True, metavar="SCENE...")
@_output_option("out")
@_rendering_options
def compare(scenes, output, **rendering):
    r"""Say how far textbook shading is from physics, where, and whether that is more than noise.

    SCENE is a built-in name (`fotismos scenes`) or a Mitsuba file (.xml). Writes OUTPUT/index.html
    and, for each scene, comparison.json, comparison.exr and pictures.

    \b
    Examples:
      fotismos compare fig-8-9
      fotismos compare my_scene.xml cornell-box --resolution 640x480 -o results
    """
    _compare(scenes, output, rendering)


@cli.command()
@_output_option("out/report")
@_rendering_options
def report(output, **rendering):
    """Compare all built-in scenes, verify their plans, and write one report."""
    from comparisons.scenes import SCENES
    from heuristic import equations

    names = tuple(SCENES)
    _check_installation()
    verifications = [] if rendering["everything"] else _verify(names, rendering)
    _compare(names, output, rendering, equations.index(), verifications)


@cli.command()
@click.argument("scene", metavar="SCENE")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
@click.option("--verify", is_flag=True, help="Render as planned and with everything, and compare.")
@_rendering_options
def plan(scene, as_json, verify, **rendering):
    r"""Say which effects a scene calls for, by which rule, and what will be simulated.

    \b
    Examples:
      fotismos plan cornell-box
      fotismos plan --verify fig-8-9 --resolution 128x128
    """
    _check_installation()
    from reference.scene import set_variant
    from reports import planning, progress

    source, chosen = _job(scene, rendering)
    set_variant(chosen["variant"])
    options = _options(chosen)
    if verify:
        from comparisons.verification import verify as run

        with progress.shown() as bar:
            data = run(source, options, bar.of(source.name)).data()
        lines = planning.verification_lines([data])
    else:
        from comparisons.compare import prepare

        data = planning.data(source.name, prepare(source, options), chosen["variant"])
        lines = planning.lines(data)
    if as_json:
        lines = [json.dumps(data, indent=2, ensure_ascii=False)]
    for line in lines:
        click.echo(line)


@cli.command()
def scenes():
    """List the built-in scenes."""
    from comparisons.scenes import SCENES

    width = max(map(len, SCENES))
    for scene in SCENES.values():
        click.echo(f"{scene.name:<{width}}  {scene.title}")


@cli.command()
def doctor():
    """Check the installation: versions, LLVM, and a test rendering in each variant."""
    from reports.doctor import examine

    for line in examine(VARIANTS):
        click.echo(line)


def main():
    """Run the command line; the exit code says how it went."""
    try:
        cli(prog_name="fotismos", standalone_mode=False)
    except click.exceptions.Abort:
        click.echo("fotismos: interrupted; finished scenes are kept.", err=True)
        sys.exit(130)
    except click.ClickException as error:
        error.show()
        sys.exit(2)
    except FotismosError as error:
        click.echo(f"fotismos: error: {error}", err=True)
        sys.exit(error.exit_code)


def _verify(names, rendering):
    """Hold the plan of each scene against everything simulated, at a small size."""
    from comparisons.verification import verify
    from reference.scene import set_variant
    from reports import progress

    with progress.shown() as bar:
        results = []
        for source, chosen in (_job(name, rendering) for name in names):
            set_variant(chosen["variant"])
            options = _options(chosen | {"resolution": VERIFIED_AT, "spp": None})
            results.append(verify(source, options, bar.of(source.name)).data())
    return results


def _compare(names, folder, rendering, equations=(), verifications=()):
    _check_installation()
    from comparisons.compare import compare as run
    from reference.scene import set_variant
    from reports import output, progress

    folder = output.prepare(folder)
    jobs = [_job(name, rendering) for name in names]
    views = {}
    with progress.shown() as bar:
        for source, chosen in jobs:
            start_up = perf_counter() - START if not views else 0.0
            set_variant(chosen["variant"])
            result = run(source, _options(chosen), bar.of(source.name), _command(source, chosen))
            begin = perf_counter()
            name = output.folder_name(source.name, views)
            views[name] = output.write_scene(folder, name, result)
            stages = result.data["time"]["stages"]
            stages |= {"start-up": start_up, "files": perf_counter() - begin}
    begin = perf_counter()
    output.write_page(folder, list(views.values()), equations, verifications)
    share = (perf_counter() - begin) / len(views)
    for name, view in views.items():
        view["record"]["time"]["stages"]["page"] = share
        output.rewrite_record(folder, name, view["record"])
    for line in progress.summary(view["record"] for view in views.values()):
        click.echo(line)
    click.echo(f"\n{folder / 'index.html'}")


def _check_installation():
    from heuristic import backend

    backend.check()


def _job(name, rendering):
    """Find a scene, and complete the options with what it asks for.

    All scenes of a command are found before anything is rendered: a typing mistake costs nothing.
    """
    from comparisons.scenes import Scene, builtin
    from reference.plan import wants_spectra
    from reference.scene import Source

    path = Path(name)
    if path.suffix == ".xml" or path.exists():
        if not path.is_file():
            raise InputError(
                f"{name}: there is no such file. Give a Mitsuba scene (.xml) or the name of a"
                " built-in scene; `fotismos scenes` lists them."
            )
        source = Source(path.stem, path)
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


def _options(rendering):
    """Turn the command's options into those of a comparison."""
    from comparisons.compare import Options
    from heuristic.interpolation import Interpolation
    from reference.pairing import Convention

    return Options(
        seed=rendering["seed"],
        spp=rendering["spp"],
        resolution=rendering["resolution"],
        convention=Convention(rendering["pairing"]),
        heuristic_variant=rendering["heuristic_variant"],
        interpolation=Interpolation(rendering["interpolation"]),
        tessellation=rendering["tessellation"],
        everything=rendering["everything"],
    )


def _command(source, rendering):
    """Return the command that repeats one comparison."""
    scene = source.name if callable(source.content) else str(source.content)
    words = ["fotismos", "compare", scene]
    for key, value in rendering.items():
        if value is True:
            words.append(f"--{key.replace('_', '-')}")
        elif value not in (None, False):
            text = "x".join(map(str, value)) if key == "resolution" else str(value)
            words += [f"--{key.replace('_', '-')}", text]
    return shlex.join(words)
