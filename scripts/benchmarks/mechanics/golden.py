"""Compare the finite-strain solver with the golden forces of docs/sources.md: a ball pressed into a bonded layer."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np

from tactile_core.accuracy import Row, row
from tactile_core.geometry.indenters import Sphere, pose_on
from tactile_core.mechanics.finite_strain.newton import FiniteStrainContact
from tactile_core.mechanics.finite_strain.solved_contact import ContactState
from tactile_core.mechanics.solids.finite_strain import FiniteStrainSolid
from tactile_core.sensors import Material

from .axisymmetric import disc_mesh, pressed
from .bonded_layer import GOLDEN_BALL, GOLDEN_FORCE, GOLDEN_RADIUS, GOLDEN_THICKNESS, quarter_disc

TARGET = 0.5  # percent (docs/sources.md, Targets)
MATERIAL = Material(1e6, 0.49)
_REACH = 4e-3  # m; the contact of 1.8 mm depth ends at 2.5 mm
_STEP = 0.2e-3  # m
# Quarter discs: node intervals inside and outside of the even part, its side in m, layers from the back, depths in m.
_QUARTERS = (
    ((16, 12), 1.6e-3, [0, 0.3, 0.55, 0.75, 0.87, 0.935, 1], [0.2e-3]),
    ((20, 8), 4.0e-3, [0, 0.2, 0.4, 0.575, 0.75, 0.825, 0.9, 0.95, 1], [0.6e-3, 1.0e-3, 1.4e-3, 1.8e-3]),
)


def disc(spacing: float) -> FiniteStrainContact:
    """Return the contact problem of the golden forces, with nodes ``spacing`` m apart near the contact."""
    mesh = disc_mesh(GOLDEN_RADIUS, GOLDEN_THICKNESS, _REACH, spacing, 0.4e-3)
    return pressed(mesh, MATERIAL, Sphere(GOLDEN_BALL), _REACH)


def path(contact: FiniteStrainContact) -> Iterator[ContactState]:
    """Yield the solved contacts at the depths of the golden forces, each going on from the one before."""
    touch = None
    for depth in GOLDEN_FORCE:
        touch = contact.press(depth, touch, _STEP)
        yield touch


def rows(quick: bool) -> Iterator[Row]:
    """Yield the errors, %, of forces solved in axial symmetry from the golden ones, the smallest volume ratio, and the
    time; unless ``quick`` also ``in_space``'s errors."""
    started = time.perf_counter()
    of = "axisymmetric, nodes 0.05 mm apart"
    contact = disc(0.05e-3)
    for touch in path(contact):
        error = 100 * (touch.force[1] / GOLDEN_FORCE[touch.depth] - 1)
        yield row(f"golden_force_{touch.depth * 1e3:.1f}mm_error", error, "percent", TARGET, baseline=-100.0, of=of)
    quality = float(contact.solid.deformation(touch.state.displacement)[1].min())
    yield row("golden_smallest_volume_ratio_1.8mm", quality, "1", 0.5, of=of, at_least=True)
    yield row("golden_time", time.perf_counter() - started, "s", of="five depths")
    if not quick:
        yield from in_space()


def in_space() -> Iterator[Row]:
    """Yield the errors, %, from the golden forces in space, with the 27-node cells of the sensors, on quarter discs."""
    for (inside, outside), side, layers, depths in _QUARTERS:
        mesh, fixed = quarter_disc(GOLDEN_RADIUS, GOLDEN_THICKNESS, side, (inside, outside), np.array(layers))
        ball = Sphere(GOLDEN_BALL)
        pose = pose_on(ball, np.array([0, -GOLDEN_THICKNESS, 0]), np.array([0, -1.0, 0]))
        near = np.hypot(*mesh.nodes[mesh.surface][:, [0, 2]].T) < side
        contact = FiniteStrainContact(
            FiniteStrainSolid(mesh, MATERIAL), mesh.surface[near], ball, pose, fixed=fixed
        )  # fmt: skip
        touch, of = None, f"quarter disc in space, nodes {1e3 * side / inside:.1f} mm apart"
        for depth in depths:
            started = time.perf_counter()
            touch = contact.press(depth, touch, step=0.2e-3)
            error = 100 * (4 * touch.force[1] / GOLDEN_FORCE[depth] - 1)
            name = f"golden_quarter_{depth * 1e3:.1f}mm"
            yield row(f"{name}_error", error, "percent", TARGET, baseline=-100.0, of=of)
            yield row(f"{name}_time", time.perf_counter() - started, "s", of=of)
