"""Renew the tables of docs/mechanics.md and its rows, mechanics.csv."""

from __future__ import annotations

from pathlib import Path

from tactile_core.accuracy import Row, failed

from ..measured_rows import renew_tables, short, write_table

_TIERS = "| tier | DIGIT: time | shape | force | BioTac: time | shape | force |", "|---|---|---|---|---|---|---|"
_CHECKS = "| check | rows | with a target | errors that miss it |", "|---|---|---|---|"


def write(report: Path, parts: dict[str, list[Row]]) -> None:
    """Renew the two tables of ``report``, whose words stay, and its rows beside it.

    parts : rows by heading. Raises ValueError for a page that has not each of the tables once.
    """
    rows = [row for part in parts.values() for row in part]
    checks = [*_CHECKS, *(_check(heading, part) for heading, part in parts.items())]
    renew_tables(report, {_TIERS[0]: _tier_table(rows), _CHECKS[0]: checks})
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
