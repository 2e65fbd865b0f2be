"""Rows of a report: one figure each, with its target and the figure of doing nothing."""

from __future__ import annotations

from typing import Any

import numpy as np

Row = dict[str, Any]
HEADER = "| name | value | unit | target | null | set | |\n|---|---|---|---|---|---|---|"
COSTS = ("s", "ms", "MB")  # units of time and memory: their rows may miss a target without failing a run


def row(
    name: str,
    value: float | None,
    unit: str,
    target: float | None = None,
    *,
    null: float | None = None,
    of: str = "",
    at_least: bool = False,
) -> Row:
    """One figure, rounded to four digits; ``of`` says on what it was measured.

    ok : |value| <= target, or value >= target for ``at_least``; None where there is no target
    """
    ok = None if target is None else bool(value >= target if at_least else abs(value) <= target)
    value, target, null = (None if number is None else float(f"{number:.4g}") for number in (value, target, null))
    return {"name": name, "value": value, "unit": unit, "target": target, "ok": ok, "null": null, "set": of}


def line(row: Row) -> str:
    """A row as a line of the table."""
    mark = {None: "", True: "ok", False: "MISSED"}[row["ok"]]
    cells = [row["name"], row["value"], row["unit"], row["target"], row["null"], row["set"], mark]
    return "| " + " | ".join("" if cell is None else str(cell) for cell in cells) + " |"


def failed(rows: list[Row]) -> list[Row]:
    """Rows of errors that miss their target."""
    return [found for found in rows if found["ok"] is False and found["unit"] not in COSTS]


def order(sizes: list[float], errors: list[float]) -> float:
    """Observed order of accuracy: slope of a straight line through log(error) over log(size)."""
    return float(np.polyfit(np.log(sizes), np.log(errors), 1)[0])
