"""Check the energy balance: without friction the indenter's work is the stored energy, and all of it comes back."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tactile_core.accuracy import Row, order, row
from tactile_core.mechanics.finite_strain.newton import FiniteStrainContact

from .golden import disc

ORDER, REST = 1.9, 1e-8  # targets (docs/sources.md, Targets)
_SPACING, _DEPTH = 0.1e-3, 0.8e-3  # m


def energy_gap(contact: FiniteStrainContact, depth: float, steps: int) -> float:
    """Work by the trapezoid rule over stored energy, less 1."""
    touch, forces = None, [0.0]
    for part in np.linspace(0, depth, steps + 1)[1:]:
        touch = contact.press(float(part), touch, step=depth)
        forces.append(float(touch.force @ contact.pose.direction))
    work = np.convolve(forces, [0.5, 0.5], "valid").sum() * depth / steps
    return float(work / contact.solid.energy(touch.state) - 1)


def left_after(contact: FiniteStrainContact, depth: float, step: float) -> float:
    """Return the largest displacement, as a share of the depth, that remains once the indenter has come and gone."""
    pressed = contact.press(depth, step=step)
    gone = contact.move(contact.pose.moved(-step), pressed, step)
    return float(np.abs(gone.state.displacement).max() / depth)


def rows(quick: bool) -> Iterator[Row]:
    """Order of the work in the step, and what is left after unloading."""
    contact, counts = disc(_SPACING), (4, 8, 16) if quick else (4, 8, 16, 32, 64)
    gaps = [energy_gap(contact, _DEPTH, steps) for steps in counts]
    of = f"golden disc, nodes {_SPACING * 1e3:g} mm apart, {_DEPTH * 1e3:g} mm deep"
    for steps, gap in zip(counts, gaps, strict=True):
        yield row(f"work_over_energy_{steps}_steps", 100 * gap, "percent", of=of)
    slope = order([1 / steps for steps in counts], [abs(gap) for gap in gaps])
    yield row("work_order", slope, "1", ORDER, of=of, at_least=True)
    yield row("unloaded_displacement", left_after(contact, _DEPTH, 0.2e-3), "1", REST, baseline=1.0, of=of)
