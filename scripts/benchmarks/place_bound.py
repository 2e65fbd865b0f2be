"""Compute how well one frame of 19 signals can tell a contact's place and depth at best (Cramer and Rao's bound).

    python scripts/benchmarks/place_bound.py [--every N]

The law of the electrodes, the body pressed and the scatter of readings are known; place, lean and depth are sought, of
which only their spread over training contacts is known before. Where signals change evenly with the contact, no
estimate errs less on average, whether a network makes it or a fit; where the body is not known, all err more. Needs
scipy, of the extra [fem].
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # `benchmarks` is no package that is installed

from benchmarks.translation.evaluation import TEST_SET
from tactile_core.accuracy import HEADER, Row, line, row
from tactile_core.errors import TactileError
from tactile_core.geometry.indenters import Indenter
from tactile_core.mechanics.electrodes.law import signal_of
from tactile_core.mechanics.placement import Placement
from tactile_core.mechanics.solve import solve
from tactile_core.simulation.pairs_file import Pairs, read_pairs
from tactile_core.simulation.scene import load_scene

DEEP = 0.3e-3  # m
READINGS = {
    "noise 1.5, gains 10 %": (1.5, 0.1),
    "noise 1.5, gains known": (1.5, 0.0),
    "noise 0.5, gains 3 %": (0.5, 0.03),
}
STEPS = np.array([5e-5, 5e-5, 0.02, 0.02, 1e-5])  # m, m, tangents of the lean, m of depth, for differences
PRIOR = np.array([6e-3, 4e-3, 0.25, 0.25, 0.4e-3])  # standard deviations over training contacts, about
DRAWS = 2000


def main(arguments: list[str] | None = None) -> int:
    """Measure, print; the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--every", type=int, default=1, metavar="N", help="one of N test contacts (default: all)")
    options = parser.parse_args(arguments)
    pairs = read_pairs(TEST_SET)
    chosen = np.flatnonzero(~pairs.slide.any(axis=1) & (pairs.depth_biotac >= DEEP))[:: options.every]
    print(HEADER)
    for each in bound_rows(pairs.select_rows(chosen)):
        print(line(each))
    return 0


def bound_rows(pairs: Pairs) -> list[Row]:
    """Rows of the medians over contacts of the least error of place, mm, and of depth, per cent, by readings."""
    pressed = {spec.name: spec.build() for spec in load_scene(TEST_SET.parent)[0].indenters}
    errors: dict[str, list[tuple[float, float]]] = {name: [] for name in READINGS}
    for contact in range(len(pairs.press)):
        state = _state(pairs, contact)
        try:
            signal, slopes = _slopes(pressed[pairs.indenter_names[pairs.indenter[contact]]], state)
        except TactileError:  # at the limit of depth, or of the gel's rim
            continue
        for name, (noise, gain) in READINGS.items():
            errors[name].append(_least(slopes, noise**2 + np.square(gain * signal), state))
    found = []
    for name, values in errors.items():
        place, depth = np.median(values, axis=0)
        of = f"{len(values)} contacts from {1e3 * DEEP:g} mm; {name}"
        found += [
            row("least_place_mm", float(place), "mm", of=of),
            row("least_depth_percent", float(depth), "%", of=of),
        ]
    return found


def _state(pairs: Pairs, contact: int) -> np.ndarray:
    x, z, tilt, heading = pairs.place[contact].astype(float)
    lean = np.tan(tilt) * np.array([np.cos(heading), np.sin(heading)])
    return np.array([x, z, *lean, float(pairs.depth_biotac[contact])])


def _slopes(body: Indenter, state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Signal (19,) counts of a press, and its derivatives (19, 5) with respect to its state."""

    def signal(at: np.ndarray) -> np.ndarray:
        place = Placement(at[0], at[1], float(np.arctan(np.hypot(*at[2:4]))), float(np.arctan2(at[3], at[2])))
        return signal_of(solve("biotac", body, place, depth=float(at[4]))).astype(float)

    changes = [(signal(state + one) - signal(state - one)) / (2 * one.sum()) for one in np.diag(STEPS)]
    return signal(state), np.stack(changes, axis=1)


def _least(slopes: np.ndarray, variance: np.ndarray, state: np.ndarray) -> tuple[float, float]:
    """Median distance, mm, of places drawn from the bound's covariance, and its deviation of depth, per cent."""
    information = (slopes.T / variance) @ slopes + np.diag(1 / PRIOR**2)
    covariance = np.linalg.inv(information)
    drawn = np.random.default_rng(0).multivariate_normal(np.zeros(2), covariance[:2, :2], DRAWS)
    return 1e3 * float(np.median(np.hypot(*drawn.T))), 100 * float(np.sqrt(covariance[4, 4]) / state[4])


if __name__ == "__main__":
    raise SystemExit(main())
