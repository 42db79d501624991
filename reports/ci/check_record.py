"""The results of checks as records, for ``--json`` and for the files of a failure."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any, Literal

from msgspec import Meta

from comparisons.check.moved import Move
from comparisons.records import VERSION, Amount, Count, Record, Share

if TYPE_CHECKING:
    from reports.ci.checks import Result

Status = Literal["passed", "failed", "error", "created", "updated", "unchanged"]


class Before(Record):
    """A metric in the baseline, and now."""

    before: float
    after: float


class VersionChange(Record):
    """The version of a library when the baseline was made, and today's."""

    before: str
    after: str


class CheckRecord(Record, kw_only=True, omit_defaults=True):
    """The result for one baseline; without numbers if it was not compared."""

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
        Meta(description="By half: each object's share of the change."),
    ] = None
    pictures: Annotated[str, Meta(description="Folder of the pictures of a failure.")] | None = None


class Checks(Record, kw_only=True):
    """The results of one command."""

    record_version: int = VERSION
    passed: bool
    significance: Share
    checks: tuple[CheckRecord, ...]


def of(result: "Result") -> CheckRecord:
    """Return the record of one result."""
    compared: dict[str, Any] = {}
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
        pictures=result.folder.as_posix() if result.folder else None,
    )


def of_all(results: Sequence["Result"], level: float) -> Checks:
    """Return the record of one command's results."""
    passed = all(result.exit_code == 0 for result in results)
    return Checks(passed=passed, significance=level, checks=tuple(map(of, results)))
