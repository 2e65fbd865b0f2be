"""Write docs/mechanics.md, its rows as mechanics.csv and three plots beside it."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from tactile_core.accuracy import Row, failed
from tactile_core.files import atomic

from ..measured_rows import short, write_table
from .bonded_layer import GOLDEN_FORCE

_PURPOSE = """# Contact mechanics against known answers

`tactile.solve` presses an indenter into a fingertip and returns force and deformation. It has three tiers: `fast`
(linear, with friction and a learned correction), `full` (finite strain) and `reference` (the same on cells half as
large). This page shows how far each can be trusted: against formulas, exact solutions, another solver and finer meshes.

## What to expect

A ball of 7 mm diameter pressed 0.6 mm deep, without friction; errors against the reference tier:

"""
_GUIDANCE = """
Take `fast` for anything in a loop and for training data; `full` where a sharp edge or a deep press matters. Errors over
many contacts and all depths: [accuracy](accuracy.md); what each contact states as its own error, and how often that
holds: [benchmark](benchmark.md).

## Limits

- A contact is refused where the surface has let the indenter through between its nodes: where some carry force on its
  back, as round a ring's wire pressed deeper than its radius, and in the finite-strain tiers also where the surface
  lies deeper in it, halfway between nodes, than two fifths of the depth. Less is stated as error.
- Edges sharper than the spacing of nodes are hardest. Friction holds nodes there; without it springs halfway between
  nodes keep the indenter out (full tier: `penalty_points.py`; fast tier: `edge_contact.py`), and where that is not
  enough the full tier tries again with half the spacing.
- A force at a small depth scatters with the spacing (0.2 % at 0.1 mm), since the contact's edge falls between nodes;
  the shape does not.

## How it is measured

`python scripts/validate_mechanics.py` makes this page, and `docs/mechanics.csv`, which holds every row: *baseline* is
the error of doing nothing. Shape errors are vector rms over surface nodes that move more than 10 um, and the maximum.
Times are from one shared 2-core machine.

The golden forces, Hertz and the layers run the reference tier's material and contact (`newton.FiniteStrainContact`) on
an axisymmetric mesh of the same element (`benchmarks/mechanics/axisymmetric.py`), so that nodes can lie 0.05 mm apart;
the rows `golden_quarter` run the production cell itself on quarter discs.
Dimitriadis's formula ends its series early: against the exact small-strain solution (`bonded_layer.exact_layer`, the
dual integral equations of a bonded layer) it is 0.2 % low at sqrt(R d) / h = 0.1, 0.9 % at 0.19, 4 % at 0.35 and 12 %
at 0.6 (nu = .5). The solver follows the exact solution, so the formula is asked for 1 % up to 0.15 only.
What each tier is off by on many contacts, by depth, is in `tactile_core/data/mechanics_tiers.json`, made by
`scripts/benchmarks/measure_tiers.py`.
"""
_SETTLED = """
## Random contacts of nine indenters: how many the finite-strain tiers solve

Contacts to half of the thickness, full tier. No node lay more than 1 um in the indenter where that was counted.

| draw | sensor, friction | solved | CPU time: median, 95 of 100 | not solved |
|---|---|---|---|---|
| `random_contacts(1000, 20)` | DIGIT, 0.78 | 948 of 954 (1) | | |
| | BioTac, none | 562 of 562 (1) | | |
| | BioTac, 0.78 | 40 of 40 (1) | | |
| | DIGIT, none | 121 of 123 (2) | 4 s; mean 11 s, beside other programs | a ring, a bumpy cube |
| the first of `random_contacts(300, 31)` | DIGIT, none | 34 of 35 | 6.2 s, 64 s; balls 1.7 s | a bumpy cube (3) |
| | DIGIT, 0.78 | 18 of 18 | 10.8 s, 34 s | |
| `random_contacts(300, 1)` | DIGIT, none | 298 of 300 (4) | 2.5 s, 25 s | a ring, a bumpy cube (3) |
| | BioTac, none | 300 of 300 | 1.6 s, 23 s | |
| | DIGIT, 0.78 | 60 of 60 | 6.2 s, 21 s | |
| | BioTac, 0.78 | 60 of 60 | 11 s, 27 s | |

(1) Before there were springs, which friction does not use. (2) Nodes alone settled 95, of which none lay more than 1 um
in the indenter; of the 121 that was not counted. (3) At 47 and 48 % of the thickness; they take 3 to 5 min to fail.
(4) Three of them, a cube and two small tilted cylinders, by short steps, where all else had failed for 1 to 3 min.

In the fast tier there settled, of 10,000 each (`random_contacts(10000, 20)`), 9,998 and 9,959 on the DIGIT, without
friction and with 0.78, and all on the BioTac; no node of these lay more than 1 um in the indenter.
"""
_CHECKS = """
## The checks

| check | rows | with a target | errors that miss it |
|---|---|---|---|
"""
_ONCE = """
Measured once, with scripts that are in commit d537259 and rows on this page there: the electrodes' law against the
thin sheet, the law and the skin's stiffness against real fingers, the public meshes with Isaac Gym's settings, and
COMSOL's presses of a BioTac SP ([sources](sources.md)).
"""


def write(report: Path, parts: dict[str, list[Row]]) -> None:
    """Write ``report`` and its plots; ``parts`` maps a heading to its rows."""
    rows = [row for part in parts.values() for row in part]
    plots = {
        "mechanics_spacing.png": ("Error against node spacing", _spacing),
        "mechanics_force.png": ("Force against depth", _force),
        "mechanics_speed.png": ("Speed against error", _speed),
    }
    text = _PURPOSE + _tier_table(rows) + _GUIDANCE
    for name, (title, draw) in plots.items():
        _save(report.with_name(name), lambda axes, draw=draw: draw(axes, rows))
        text += f"\n![{title}]({name})\n"
    text += _SETTLED
    text += _CHECKS + "".join(_check(heading, part) for heading, part in parts.items()) + _ONCE
    atomic.write_bytes(report, text.encode())
    write_table(report.with_suffix(".csv"), parts)


def _check(heading: str, rows: list[Row]) -> str:
    """Return a check's line: its rows, how many have a target, and which errors miss it."""
    missed = ", ".join(f"`{row['name']}` {row['value']:g} {row['unit']}" for row in failed(rows))
    return f"| {heading} | {len(rows)} | {sum(row['ok'] is not None for row in rows)} | {missed} |\n"


def _tier_table(rows: list[Row]) -> str:
    """Return the table of the tiers' time and errors at 0.6 mm; a cell is empty where nothing was measured."""
    found = {row["name"]: row for row in rows}

    def number(name: str, unit: str, scale: float = 1.0, field: str = "value") -> str:
        value = found[name][field] if name in found else None
        return "" if value is None else f"{short(abs(scale * value))} {unit}"

    lines = ["| tier | DIGIT: time | shape | force | BioTac: time | shape | force |", "|---|---|---|---|---|---|---|"]
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
    return "\n".join([*lines, f"| {' | '.join(cells)} |"]) + "\n"


def _save(path: Path, draw: Any) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6, 3.6), dpi=100, layout="constrained")
    FigureCanvasAgg(figure)
    draw(figure.add_subplot())
    with atomic.new_file(path) as partial:
        figure.savefig(partial, format="png", metadata={"Software": None})


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
