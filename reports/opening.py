"""Opening a page in the user's browser."""

import webbrowser
from collections.abc import Callable
from pathlib import Path

import click

option = click.option(
    "--open", "is_opened", is_flag=True, help="Open the page in a browser as soon as it exists."
)


def seen(is_opened: bool) -> Callable[[Path], object]:
    """Return the function to call with the path of a new page: open it, or do nothing."""
    return _open if is_opened else lambda _: None


def _open(page: Path) -> None:
    if not webbrowser.open(page.resolve().as_uri()):
        click.echo(f"fotismos: no browser was found to open {page}. Open it yourself.", err=True)
