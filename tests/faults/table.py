"""The table of faults: a row per kind, and each trial in which something is wrong."""

from collections.abc import Iterable, Iterator

from tests.faults.trial import Trial

COLUMNS = {
    "trials": lambda trial: True,
    "message and exit code as expected": lambda trial: trial.is_expected,
    "tracebacks": lambda trial: trial.has_traceback,
    "hangs": lambda trial: trial.hangs,
    "silent": lambda trial: trial.is_silent,
    "orphans": lambda trial: trial.orphans > 0,
    "files lost": lambda trial: bool(trial.lost),
}
"""What is counted, by the heads of the columns."""


def lines(trials: Iterable[Trial]) -> Iterator[str]:
    """Yield the table in Markdown."""
    trials = list(trials)
    yield f"| kind | {' | '.join(COLUMNS)} |"
    yield "| --- |" + " ---: |" * len(COLUMNS)
    for kind in dict.fromkeys(trial.kind for trial in trials):
        yield _row(kind, [trial for trial in trials if trial.kind == kind])
    yield _row("all", trials)


def failures(trials: Iterable[Trial]) -> Iterator[str]:
    """Yield a few lines for each trial in which something is wrong."""
    for trial in trials:
        if not trial.is_good:
            wrong = [name for name, counts in list(COLUMNS.items())[2:] if counts(trial)]
            yield f"- {trial.kind}: {trial.fault}: {', '.join([*wrong, *trial.notes, *trial.lost])}"
            yield f"    code {trial.code} after {trial.seconds} s: {trial.said[-300:]!r}"


def _row(name: str, trials: list[Trial]) -> str:
    counts = (sum(map(counted, trials)) for counted in COLUMNS.values())
    return f"| {name} | {' | '.join(map(str, counts))} |"
