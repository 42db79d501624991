"""The page's overview: the columns that scenes are compared by, and the names that scenes go by."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from markupsafe import Markup

from reports.terminal.printing import about_noise


@dataclass(frozen=True)
class Column:
    """What scenes can be sorted by: a key, its words, and its heading with line breaks."""

    key: str
    title: str
    heading: Markup


#: The columns of the overview, in order.
COLUMNS = tuple(
    Column(key, title, Markup(heading))
    for key, title, heading in (
        ("name", "scene", "Scene"),
        ("dE2000", "ΔE2000, mean", "ΔE2000,<br>mean"),
        ("shape", "ΔE2000 after the best exposure", "ΔE2000, best<br>exposure"),
        ("noise", "ΔE2000, noise floor", "ΔE2000,<br>noise floor"),
        ("dE_ITP", "ΔE ITP, mean", "ΔE ITP,<br>mean"),
        ("dE_CAM16UCS", "CAM16-UCS, mean", "CAM16-UCS,<br>mean"),
        ("rmse", "RMSE, linear", "RMSE,<br>linear"),
        ("marked", "significant pixels", "Significant<br>pixels"),
        ("heuristic_s", "time of the heuristic", "Heuristic,<br>all passes"),
        ("reference_s", "time of the reference", "Reference,<br>all passes"),
    )
)


def keys(record: Mapping[str, Any]) -> dict[str, float]:
    """What each of `COLUMNS` but the name sorts a scene by."""
    metrics, time = record["metrics"], record["time"]
    return {
        "dE2000": metrics["dE2000"]["mean"],
        "shape": metrics["dE2000"]["after_exposure"]["mean"],
        "noise": metrics["dE2000"]["noise_floor"],
        "dE_ITP": metrics["dE_ITP"]["mean"],
        "dE_CAM16UCS": metrics["dE_CAM16UCS"]["mean"],
        "rmse": metrics["rmse"]["value"],
        "marked": metrics["significant"]["fraction"],
        "heuristic_s": time["heuristic"]["total_s"],
        "reference_s": time["reference"]["total_s"],
    }


def is_significant(record: Mapping[str, Any]) -> bool:
    """Whether a scene departs by more than noise: in some pixels, and in its mean."""
    metrics = record["metrics"]
    return metrics["significant"]["fraction"] > 0 and not about_noise(metrics["dE2000"])


def identifier(name: str, taken: set[str]) -> str:
    """A name for a scene in the page's address: plain characters; added to `taken`."""
    plain = "".join(c if (c.isascii() and c.isalnum()) or c in "-_." else "-" for c in name)
    chosen, count = plain or "scene", 1
    while chosen in taken:
        count += 1
        chosen = f"{plain or 'scene'}-{count}"
    taken.add(chosen)
    return chosen
