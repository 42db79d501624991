"""The results of checks as plain data, for ``--json`` and for the files of a failure."""

from comparisons import record


def data(result):
    """Return one result as plain data; numbers are finite."""
    found = {
        "baseline": result.path.as_posix(),
        "scene": result.scene,
        "status": result.status,
        "passed": result.exit_code == 0,
        "seconds": round(result.seconds, 3),
    }
    if result.message:
        found["message"] = result.message
    if result.check is not None:
        check = result.check
        found |= {
            "tested": len(check.moves),
            "significance": check.level,
            "moved": [move_data(move) for move in check.moved],
            "metrics": {
                name: {"before": metric.value, "after": check.after.metrics[name].value}
                for name, metric in check.before.metrics.items()
            },
        }
    if result.versions:
        found["versions"] = {
            name: {"before": old, "after": new} for name, (old, new) in result.versions.items()
        }
    if result.folder is not None:
        found["pictures"] = result.folder.as_posix()
    return found


def move_data(move):
    """Return one quantity, before and after, as plain data; ``block`` counts from 1."""
    block = move.before.block
    return {
        "quantity": move.before.name,
        "half": move.before.half,
        "block": [block[0] + 1, block[1] + 1] if block else None,
        "before": move.before.value,
        "after": move.after.value,
        "error": move.error,
        "standard_errors": move.standard_errors,
        "p": move.p,
        "p_corrected": move.corrected,
    }


def summary(results, level):
    """Return the results of one command as plain data."""
    return {
        "passed": all(result.exit_code == 0 for result in results),
        "significance": level,
        "checks": [data(result) for result in results],
    }


def other_versions(baseline):
    """Return ``{name: (then, now)}`` of the versions that changed since a baseline was made."""
    now = record.versions()
    return {
        name: (old, now.get(name, "none"))
        for name, old in baseline.versions.items()
        if now.get(name) != old
    }
