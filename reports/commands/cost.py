"""``fotismos cost``: what each step of accuracy costs in time."""

import click

from comparisons.pool import Task
from reports import jobs
from reports.run import tasks
from reports.terminal import verbosity


@click.command()
@jobs.scene_argument
@jobs.output_option("out")
@jobs.figures_option
@jobs.timeout_option
@jobs.rendering_options
@jobs.scene_options
@verbosity.quiet_option
@verbosity.verbose_option
@click.option("--rounds", type=click.IntRange(2), help="Timed repeats of each method. [default: 7]")
@jobs.json_option
def cost(scene, output, figures, rounds, as_json, timeout, **rendering):
    """Say what each step of accuracy costs in time, and which effect is worth paying for.

    Renders a ladder of methods, from flat shading to the full plan, at several sample counts, and
    prices each effect in which textbook shading differs. Writes OUTPUT/SCENE/cost.json, cost.svg
    and pictures, and OUTPUT/tables. Without --resolution the film is reduced to 128 pixels of
    width; --spp gives the samples a pixel of the largest count, 64 where it is not given.

    \b
    Examples:
      fotismos cost cornell-box
      fotismos cost my_scene.xml --resolution 256x256 --rounds 11 --figures
    """  # noqa: D301 click reads the \b as: keep these lines
    jobs.require_known([scene])
    with jobs.pool(timeout) as pool:
        pool.start()
        from comparisons.case import name_of
        from comparisons.records import to_json
        from reports.files import ownership
        from reports.run.output import FIGURES, TABLES, folder_name, prepare
        from reports.terminal import cost_tables, progress, tables

        folder = prepare(output)
        name = name_of(scene)
        place = folder / folder_name(name, ())
        for_print = folder / FIGURES if figures else None
        for used in (place, folder / TABLES, *filter(None, [for_print])):
            ownership.require_free_folder(used)
        with progress.shown() as bar:
            words = (scene, jobs.request(rendering), rounds, place, for_print)
            record = pool.do(Task(name, tasks.priced, words, bar.of(name)))
    tables.write_cost(folder / TABLES, place.name, record)
    if as_json:
        click.echo(to_json(record), nl=False)
        return
    verbosity.tell(cost_tables.lines(record))
    verbosity.tell_where(place / "cost.svg")
