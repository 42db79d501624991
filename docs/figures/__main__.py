"""Makes the generated parts of the documentation: ``./run docs``; ``--all`` also measures again.

``--accuracy`` and ``--engines`` make only one page, ``--prices`` only the first part of one, and
``--site`` only builds the site. Pictures and tables come from renderings with fixed seeds. Marked
parts of pages are replaced; the rest is written by hand.
"""

import sys
from collections.abc import Callable, Iterator, Sequence

import nbformat
from nbclient import NotebookClient

from docs.figures import (
    accuracy,
    audits,
    charts,
    engines,
    examples,
    guarantees,
    hero,
    lessons,
    measured,
    model_figures,
    other_tools,
    outputs,
    prices,
    renderers,
    schemes,
    two_pictures,
)
from docs.figures.documents import DOCS, ROOT, fact, replace, run, write_table
from docs.website import sources
from fotismos.comparisons import atomic
from fotismos.reference.planning.rules import RULES
from fotismos.reference.scene.graph import set_variant


def main(words: Sequence[str]) -> None:
    """Make everything, or what the words name."""
    if words == ["--site"]:
        return _site()
    if words not in ([], ["--all"]) and not (len(words) == 1 and words[0] in MEASURED):
        sys.exit(__doc__)
    set_variant("llvm_ad_rgb")
    if words and words[0] in MEASURED:
        return MEASURED[words[0]]()
    if words:
        for measure in (measured.write, *MEASURED.values()):
            measure()
    for write in PARTS:
        write()


def _rules() -> None:
    """Write the rules of pruning."""
    replace("plans.md", "rules", rules())


def rules() -> Iterator[str]:
    """Yield the rules of pruning: what each leaves out, and its premises, numbered once."""
    numbers: dict[str, int] = {}
    for rule in RULES:
        known = ", ".join(str(numbers[p.sentence]) for p in rule.premises if p.sentence in numbers)
        if rule is not RULES[0]:
            yield ""
        yield f"### {rule.name[0].upper()}{rule.name[1:]}"
        yield from ("", f"*Left out:* {rule.omits}, because {rule.absent}.", "")
        yield f"*Premises*{' ' * bool(known)}{known}:"
        yield ""
        for premise in rule.premises:
            if premise.sentence not in numbers:
                numbers[premise.sentence] = len(numbers) + 1
                yield f"{len(numbers)}. {premise.sentence}"


def _site() -> None:
    """Build the site from what is there, in out/site, with a page for the lessons' scenes."""
    folder = ROOT / "out/site"
    if sources.build(folder):
        raise SystemExit(f"The site in {folder} is not whole: mend the faults above.")
    # The lessons' scenes, with live shading: nothing has to be installed to move the sliders.
    size = f"{lessons.SIDE}x{lessons.SIDE}"
    live = str(folder / "live")
    run("compare", *lessons.scenes(), "--resolution", size, "--output", live)
    print(folder / "index.html")


def _witnesses() -> None:
    """Run the cases of docs/witnesses.md, and write their results."""
    found = fact("witnesses")
    write_table("closed-forms", found.pop("closed forms"))
    for part, lines in found.items():
        replace("witnesses.md", part, lines)


def _notebook() -> None:
    """Execute the tutorial; keep the output of its cells, but not their times.

    Of a comparison only the picture is kept: hosts of code do not show frames.
    """
    path = DOCS / "tutorial.ipynb"
    notebook = nbformat.read(path, as_version=4)
    NotebookClient(notebook, resources={"metadata": {"path": str(ROOT)}}).execute()
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)
        for output in cell.get("outputs", ()):
            if "image/png" in output.get("data", ()):
                output.data.pop("text/html", None)
    atomic.write(path, nbformat.writes(notebook) + "\n")


MEASURED: dict[str, Callable[[], None]] = {
    "--accuracy": accuracy.write,
    "--engines": engines.write,
    "--prices": prices.write,
}
"""What measures times of many scenes, by the word that asks for it alone."""

PARTS: tuple[Callable[[], None], ...] = (
    guarantees.write,
    _rules,
    hero.write,
    outputs.write_page,
    outputs.write_study,
    schemes.write,
    model_figures.write,
    _witnesses,
    charts.write,
    examples.write,
    renderers.write,
    audits.write,
    lessons.write,
    two_pictures.write,
    other_tools.write,
    _notebook,
)
"""All other parts, in order: what is drawn from a table comes after what writes it."""


if __name__ == "__main__":
    main(sys.argv[1:])
