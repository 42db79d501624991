"""The cost of accuracy over all scenes: what each method takes, and the error that it leaves."""

METHODS = (
    "flat kernel",
    "Phong kernel",
    "kernel with shadows",
    "phong BSDF, full transport",
    "direct",
    "full plan",
)
"""The rungs that every scene has under some name, cheapest idea first."""


def rows(records):
    """Return a row for each ``cost.json``: its scene, a cell a method, and what is worth most.

    A cell is the rung's point of most samples. A method that the scene cannot tell from another one
    shares its rung, and ``merged`` is set in its cell but the first.
    """
    return [
        {
            "scene": record["scene"],
            "cells": _cells(record),
            "best": _best(record),
            "departure": record["prices"]["departure"],
        }
        for record in records
    ]


def _cells(record):
    cells, seen = [], set()
    for method in METHODS:
        rung = next((r["name"] for r in record["rungs"] if method in r["names"]), None)
        if rung is None:
            cells.append(None)
            continue
        points = [point for point in record["points"] if point["rung"] == rung]
        last = max(points, key=lambda point: point["spp"])
        cells.append(last | {"merged": rung in seen})
        seen.add(rung)
    return cells


def _best(record):
    prices = record["prices"]["effects"]
    return max(prices, key=lambda price: price["removes"]["value"]) if prices else None
