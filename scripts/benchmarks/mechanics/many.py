"""Random contacts of nine indenters on both sensors: how many settle, and how long one takes."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np

from tactile_core.accuracy import Row, row
from tactile_core.errors import TactileError
from tactile_core.mechanics.placement import FRICTION, depth_at, pose_at
from tactile_core.mechanics.solve import Sensor, Solution, Step, Tier, solve_path

from .random_contacts import RandomContact, random_contacts
from .tiers import TIME_TARGETS

SETTLED_TARGET, PENETRATION = 99.0, 1e-6  # per cent, m: targets (docs/sources.md, Targets)
_COUNT, _QUICK = 450, 45  # contacts
_STEPS = 10  # of a path: what `tactile pairs` and scenes take, for every step is a contact


def settle(
    sensor: Sensor, contact: RandomContact, tier: Tier, friction: float, steps: int = 1
) -> tuple[Solution | None, float]:
    """The contact at the end of a path of depths, or None where one of them does not settle, and CPU seconds a step."""
    depth = depth_at(contact.depth, sensor, contact.indenter, pose_at(sensor, contact.indenter, contact.place))
    depths = [Step(depth=depth * step / steps) for step in range(1, steps + 1)]
    began = time.process_time()
    try:
        path = list(solve_path(sensor, contact.indenter, contact.place, depths, tier, friction))
    except TactileError:
        path = []
    settled = bool(path) and all(found.converged for found in path)
    return (path[-1] if settled else None), (time.process_time() - began) / steps


def rows(quick: bool) -> Iterator[Row]:
    """The fast tier, each contact alone and as the end of a path, without and with friction."""
    contacts = list(random_contacts(_QUICK if quick else _COUNT))
    for sensor in ("digit", "biotac"):
        settle(sensor, contacts[0], "fast", 0.0)  # the matrices are read
        for friction in (0.0, FRICTION):
            for steps in (1, _STEPS):
                yield from _metrics(sensor, contacts[:: 1 if steps == 1 else 5], friction, steps)


def _metrics(sensor: Sensor, contacts: list[RandomContact], friction: float, steps: int) -> Iterator[Row]:
    done = [settle(sensor, contact, "fast", friction, steps) for contact in contacts]
    found, took = [solution for solution, _ in done], 1e3 * np.array([seconds for _, seconds in done])
    name = f"{sensor}_fast_{'alone' if steps == 1 else 'on_a_path'}{f'_friction_{friction:g}' if friction else ''}"
    share = 100 * sum(solution is not None for solution in found) / len(found)
    of = f"{len(found)} random contacts" + (f", each a path of {steps} depths" if steps > 1 else "")
    yield row(f"{name}_settled", share, "percent", SETTLED_TARGET, of=of, at_least=True)
    wrong = sum(solution is not None and solution.penetration > PENETRATION for solution in found)
    yield row(f"{name}_silently_wrong", wrong, "1", 0.0, of=of)
    yield row(f"{name}_mean_time", took.mean(), "ms", TIME_TARGETS["fast", sensor], of=f"{of}, CPU time with set-up")
    yield row(f"{name}_median_time", float(np.median(took)), "ms", of=f"{of}, likewise")
