"""Write docs/mechanics.md: the rows as tables, and three plots beside it."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from tactile_core.accuracy import HEADER, Row, line
from tactile_core.files import atomic

from .bonded_layer import GOLDEN_FORCE

_INTRODUCTION = """# Contact mechanics against known answers

`tactile.solve` presses an indenter into a fingertip by one of three tiers: `fast` (milliseconds: linear, with friction
and a learned correction), `full` (seconds: finite strain) and `reference` (a minute: the same on cells half as large).
This page holds them against formulas, exact solutions, another solver and finer meshes; [accuracy](accuracy.md) has
their errors in one table. Made by `python scripts/validate_mechanics.py`. *Baseline* is the error of doing nothing
(`baseline` in the rows of `--json`); shape errors are vector rms over surface nodes that move more than 10 um, and the
maximum. Times are from one shared 2-core machine.

The golden forces, Hertz and the layers run the reference tier's material and contact (`newton.FiniteStrainContact`) on
an axisymmetric mesh of the same element (`benchmarks/mechanics/axisymmetric.py`), so that nodes can lie 0.05 mm apart;
the rows `golden_quarter` run the production cell itself on quarter discs.
Dimitriadis's formula ends its series early: against the exact small-strain solution (`bonded_layer.exact_layer`, the
dual integral equations of a bonded layer) it is 0.2 % low at sqrt(R d) / h = 0.1, 0.9 % at 0.19, 4 % at 0.35 and 12 %
at 0.6 (nu = .5). The solver follows the exact solution, so the formula is asked for 1 % up to 0.15 only.
The contact's edge falls between nodes: a force at a small depth scatters with the spacing (0.2 % at 0.1 mm), the shape
does not.
What each tier is off by on many contacts, by depth, is in `tactile_core/data/mechanics_tiers.json`, made by
`scripts/benchmarks/measure_tiers.py`; [benchmark](benchmark.md) shows how well its bounds hold.

A contact is refused where the surface has let the indenter through between its nodes: where some carry force on its
back, as round a ring's wire pressed deeper than its radius, and in the finite-strain tiers also where the surface lies
deeper in it, halfway between nodes, than two fifths of the depth. What is hidden less deep is stated as error. Friction
holds nodes at edges. Without it they slide off those that are sharper than their spacing: where that lets the indenter
in, or no contact is found, springs halfway between nodes keep it out (full tier: `penalty_points.py`; fast tier:
`edge_contact.py`), and where that is not enough the full tier tries again with half the spacing. Of random contacts
of nine indenters to half of the thickness (`random_contacts(1000, 20)`, full tier) there settled 948 of 954 on the
DIGIT with a friction of 0.78, all of 562 without and of 40 with friction on the BioTac (these three before there were
springs, which friction does not use), and 121 of 123 on the DIGIT without, where nodes alone settled 95: all but a ring
and a bumpy cube, in 11 s on average, 4 in the median, beside other programs. No node of the first three, or of the 95,
lay more than 1 um in the indenter; of the 121 that was not counted. Of the first of another draw
(`random_contacts(300, 31)`, DIGIT) 34 of 35 settled without friction, in 6.2 CPU s in the median, 64 s in 95 of 100,
balls in 1.7 s: all but a bumpy cube at 47 %, which took 4 min to fail; and all of 18 with 0.78, in 10.8 and 34 s. No
node of these lay more than 1 um in the indenter. In the fast tier there settled, of 10,000 each
(`scripts/benchmarks/count_contacts.py SENSOR --count 10000 --seed 20`), 9,998 and 9,959 on the DIGIT, without friction
and with 0.78, and all on the BioTac; no node of these lay more than 1 um in the indenter.
"""


def write(report: Path, parts: dict[str, list[Row]]) -> None:
    """Write ``report`` and its plots; ``parts`` maps a heading to its rows."""
    rows = [row for part in parts.values() for row in part]
    plots = {
        "mechanics_spacing.png": ("Error against node spacing", _spacing),
        "mechanics_force.png": ("Force against depth", _force),
        "mechanics_speed.png": ("Speed against error", _speed),
    }
    text = _INTRODUCTION
    for name, (title, draw) in plots.items():
        _save(report.with_name(name), lambda axes, draw=draw: draw(axes, rows))
        text += f"\n![{title}]({name})\n"
    for heading, part in parts.items():
        text += f"\n## {heading}\n\n{HEADER}\n" + "".join(line(row) + "\n" for row in part)
    atomic.write_bytes(report, text.encode())


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
