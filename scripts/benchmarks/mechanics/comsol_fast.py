"""The COMSOL presses of a BioTac SP against its descriptor's fast tier: gaps and force."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tactile_core import sensors
from tactile_core.accuracy import Row, row
from tactile_core.errors import TactileError
from tactile_core.geometry.indenters import Pose
from tactile_core.mechanics.finite_strain.sp_press import Plate, Pressed
from tactile_core.mechanics.first_touch import first_touch
from tactile_core.mechanics.solution import Step
from tactile_core.mechanics.solve import solve_path

from .comsol import FITTED, GAP, Press, force_ratios, gap_changes, resting_gaps_cut

SENSOR = "biotac_sp"
_LIMIT = 3e-3  # m, deeper than any press goes


def rows(press: Press) -> Iterator[Row]:
    """Yield the rows of one press; the stiffness of the descriptor's skin was fitted on ``comsol.FITTED``."""
    steps = fast_steps(press)
    press = press.first(len(steps))
    changes, expected = gap_changes(press, steps)
    off, baseline = changes - expected, resting_gaps_cut(press) - expected
    ratio = force_ratios(press, steps)
    of = f"COMSOL press {press.name}, {len(steps)} steps, fast tier of {SENSOR}"
    name, target = f"comsol_fast_{press.name}", None if press.name == FITTED else press.force_target
    yield row(f"{name}_gap_rms", _rms(off), "mm", GAP, baseline=_rms(baseline), of=of)
    yield row(f"{name}_gap_rms_at_the_end", _rms(off[-1]), "mm", of=of)
    yield row(f"{name}_force_error", 100 * float(np.abs(ratio - 1).mean()), "percent", target, baseline=100.0, of=of)
    yield row(f"{name}_force_bias", 100 * float(ratio.mean() - 1), "percent", of=of)


def fast_steps(press: Press) -> list[Pressed]:
    """The steps of a press in the fast tier, frictionless, as far as it follows them."""
    turned = np.array([[-1.0, 0, 0], [0, 0, 1.0], [0, 1.0, 0]])  # COMSOL's axes in the shared frame, even in z
    shift = sensors.from_maker(np.zeros((1, 3)), SENSOR)[0]
    axis = -turned @ press.into
    first = np.cross([0.0, 0.0, 1.0], axis)
    first /= np.linalg.norm(first)
    start = Pose(turned @ press.point + shift, np.column_stack([first, np.cross(axis, first), axis]))
    surface = sensors.sensor_surface(SENSOR)
    touch = first_touch(surface, Plate(), start)
    clearance = float((touch.apex - start.apex) @ start.direction)
    depths = np.maximum(press.advances - clearance, 0.0)
    pad = surface.rest[:, 1] < sensors.skin_of(SENSOR).axis_y + 0.2e-3
    found: list[Pressed] = []
    try:
        for advance, step in zip(
            press.advances,
            solve_path(SENSOR, Plate(), touch, map(Step, depths), friction=0.0, limit=_LIMIT),
            strict=True,
        ):
            skin = ((surface.rest + step.displacement)[pad] - shift) @ turned
            found.append(Pressed(advance - clearance, skin, step.axial_force, step.pressure, np.nan, np.nan))
    except TactileError:
        pass  # deeper than the linear tier finds
    return found


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))
