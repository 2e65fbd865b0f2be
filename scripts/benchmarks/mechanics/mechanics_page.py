"""Renew the tables of docs/mechanics.md, its rows, mechanics.csv, and three plots beside it."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from tactile_core.accuracy import Row, failed
from tactile_core.files import atomic

from ..measured_rows import png_of, renew_tables, short, write_table
from .bonded_layer import GOLDEN_FORCE

_TIERS = "| tier | DIGIT: time | shape | force | BioTac: time | shape | force |", "|---|---|---|---|---|---|---|"
_CHECKS = "| check | rows | with a target | errors that miss it |", "|---|---|---|---|"


def write(report: Path, parts: dict[str, list[Row]]) -> None:
    """Renew the two tables of ``report``, whose words stay, its rows beside it and its plots.

    parts : rows by heading. Raises ValueError for a page that has not each of the tables once.
    """
    rows = [row for part in parts.values() for row in part]
    checks = [*_CHECKS, *(_check(heading, part) for heading, part in parts.items())]
    renew_tables(report, {_TIERS[0]: _tier_table(rows), _CHECKS[0]: checks})
    for name, draw in (("spacing", _spacing), ("force", _force), ("speed", _speed)):
        _save(report.with_name(f"mechanics_{name}.png"), lambda axes, draw=draw: draw(axes, rows))
    write_table(report.with_suffix(".csv"), parts)


def _check(heading: str, rows: list[Row]) -> str:
    """Return a check's line: its rows, how many have a target, and which errors miss it."""
    missed = ", ".join(f"`{row['name']}` {row['value']:g} {row['unit']}" for row in failed(rows))
    return f"| {heading} | {len(rows)} | {sum(row['ok'] is not None for row in rows)} | {missed} |"


def _tier_table(rows: list[Row]) -> list[str]:
    """Return the table of the tiers' time and errors at 0.6 mm; a cell is empty where nothing was measured."""
    found = {row["name"]: row for row in rows}

    def number(name: str, unit: str, scale: float = 1.0, field: str = "value") -> str:
        value = found[name][field] if name in found else None
        return "" if value is None else f"{short(abs(scale * value))} {unit}"

    lines = [*_TIERS]
    for tier in ("fast", "full", "reference"):
        cells = [tier]
        for sensor in ("digit", "biotac"):
            name, quick = f"{sensor}_{tier}_0.6mm", tier == "fast"
            cells += [
                number(f"{name}_time", "ms" if quick else "s", 1e-3 if tier == "full" else 1.0),
                number(f"{name}_shape_rms", "um"),
                number(f"{name}_force_error", "%"),
            ]
        lines.append(f"| {' | '.join(cells)} |")
    cells = ["nothing computed"]
    for sensor in ("digit", "biotac"):
        base = f"{sensor}_fast_0.6mm"
        cells += ["", number(f"{base}_shape_rms", "um", field="baseline")]
        cells += [number(f"{base}_force_error", "%", field="baseline")]
    return [*lines, f"| {' | '.join(cells)} |"]


def _save(path: Path, draw: Any) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6, 3.6), dpi=100, layout="constrained")
    draw(figure.add_subplot())
    atomic.write_bytes(path, png_of(figure))


def _series(rows: list[Row], pattern: str) -> tuple[np.ndarray, np.ndarray]:
    """Numbers caught by ``pattern``'s group in the rows' names, sorted, and the size of their values."""
    found = [(float(match[1]), abs(row["value"])) for row in rows if (match := re.fullmatch(pattern, row["name"]))]
    return tuple(np.array(sorted(found)).reshape(-1, 2).T)


def _spacing(axes: Any, rows: list[Row]) -> None:
    for pattern, label in (
        (r"disc_force_error_0.6mm_([\d.]+)", "force, 0.6 mm deep, %"),
        (r"disc_force_error_1.4mm_([\d.]+)", "force, 1.4 mm deep, %"),
        (r"disc_shape_rms_1.4mm_([\d.]+)", "shape rms, 1.4 mm deep, um"),
    ):
        axes.loglog(*_series(rows, pattern), "o-", label=label)
    axes.set(xlabel="node spacing, mm (ball of 3.5 mm on 3 mm)", ylabel="error against 0.025 mm")
    axes.legend(fontsize=8)


def _force(axes: Any, rows: list[Row]) -> None:
    depths = np.array(list(GOLDEN_FORCE)) * 1e3
    axes.plot(depths, list(GOLDEN_FORCE.values()), "-", label="golden (docs/sources.md)")
    errors = {row["name"]: row["value"] for row in rows}
    forces = [
        force * (1 + errors[f"golden_force_{1e3 * depth:.1f}mm_error"] / 100) for depth, force in GOLDEN_FORCE.items()
    ]
    axes.plot(depths, forces, "o", label="reference tier, axisymmetric")
    axes.set(xlabel="depth, mm, of 3 mm", ylabel="force, N")
    axes.legend(fontsize=8)


def _speed(axes: Any, rows: list[Row]) -> None:
    for sensor, mark in (("digit", "o"), ("biotac", "s")):
        for tier in ("fast", "full"):
            _, error = _series(rows, rf"{sensor}_{tier}_([\d.]+)mm_shape_rms")
            _, taken = _series(rows, rf"{sensor}_{tier}_([\d.]+)mm_time")
            if len(error) and len(error) == len(taken):
                axes.loglog(taken, error, mark, label=f"{sensor}, {tier}")
    axes.set(xlabel="time a contact, ms", ylabel="shape rms against reference, um")
    axes.legend(fontsize=8)
