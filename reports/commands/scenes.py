"""``fotismos scenes``: list the built-in scenes."""

import click


@click.command()
def scenes():
    """List the built-in scenes."""
    from comparisons.scenes import SCENES

    width = max(map(len, SCENES))
    for scene in SCENES.values():
        click.echo(f"{scene.name:<{width}}  {scene.title}")
