"""The results of checks as records, for ``--json`` and for the files of a failure."""

from typing import Annotated, Literal

from msgspec import Meta

from comparisons.check.moved import Move
from comparisons.records import VERSION, Amount, Count, Record, Share

Status = Literal["passed", "failed", "error", "created", "updated", "unchanged"]


class Before(Record):
    """A metric, as the baseline has it and now."""

    before: float
    after: float


class VersionChange(Record):
    """The version of a library when the baseline was made, and today's."""

    before: str
    after: str


class CheckRecord(Record, kw_only=True, omit_defaults=True):
    """What became of one baseline; of one that was not compared, the numbers are left out."""

    record_version: int
    baseline: Annotated[str, Meta(description="Path of its file.")]
    scene: str
    status: Status
    passed: bool
    seconds: Amount
    message: str = ""
    tested: Count | None = None
    significance: Share | None = None
    moved: tuple[Move, ...] | None = None
    metrics: dict[str, Before] | None = None
    versions: dict[str, VersionChange] | None = None
    causes: Annotated[
        tuple[str, ...], Meta(description="Why, as far as the numbers tell, in sentences.")
    ] = ()
    objects: Annotated[
        dict[str, dict[str, Share]] | None,
        Meta(description="By half: the share of the change that each object has."),
    ] = None
    pictures: Annotated[str, Meta(description="Folder of the pictures of a failure.")] | None = None


class Checks(Record, kw_only=True):
    """The results of one command."""

    record_version: int = VERSION
    passed: bool
    significance: Share
    checks: tuple[CheckRecord, ...]


def of(result):
    """Return the record of one :class:`reports.ci.checks.Result`."""
    compared = {}
    if result.check is not None:
        check = result.check
        compared = {
            "tested": len(check.moves),
            "significance": check.level,
            "moved": check.moved,
            "metrics": {
                name: Before(metric.value, check.after.metrics[name].value)
                for name, metric in check.before.metrics.items()
            },
        }
    return CheckRecord(
        record_version=VERSION,
        baseline=result.path.as_posix(),
        scene=result.scene,
        status=result.status,
        passed=result.exit_code == 0,
        seconds=round(result.seconds, 3),
        message=result.message,
        **compared,
        versions=result.versions or None,
        causes=result.causes,
        objects=result.objects,
        pictures=result.folder and result.folder.as_posix(),
    )


def of_all(results, level):
    """Return the record of the results of one command."""
    passed = all(result.exit_code == 0 for result in results)
    return Checks(passed=passed, significance=level, checks=tuple(map(of, results)))
