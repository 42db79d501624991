"""``fotismos scenes``: list the built-in scenes."""

import click


@click.command()
def scenes() -> None:
    """List the built-in scenes, each with a sentence.

    \b
    Examples:
      fotismos scenes
      fotismos scenes | grep sphere
    """  # noqa: D301 click reads the \b as: keep these lines
    from comparisons.gallery.builtin import SCENES

    width = max(map(len, SCENES))
    for scene in SCENES.values():
        click.echo(f"{scene.name:<{width}}  {scene.title}")
