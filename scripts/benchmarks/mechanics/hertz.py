"""Compare a small contact on a deep block with Hertz's solution."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np

from tactile_core.accuracy import Row, row
from tactile_core.geometry.indenters import Sphere
from tactile_core.mechanics.finite_strain.newton import FiniteStrainContact
from tactile_core.mechanics.finite_strain.solved_contact import ContactState
from tactile_core.sensors import Material

from .axisymmetric import contact_radius, disc_mesh, pressed

TARGET = 1.0  # percent (docs/sources.md, Targets)
BALL, YOUNGS = 10e-3, 1e6  # m, Pa
# Contact radius over the block's thickness and half width: 0.05 would still leave 5 % of the bonded back in the force.
_BLOCK = 200
_NODES = 50  # along the contact radius


def force(depth: float, ball: float, youngs: float, poisson: float) -> float:
    """Return Hertz's force, N, on a rigid ball of radius ``ball`` m, ``depth`` m in a half space of ``youngs`` Pa and
    Poisson's ratio ``poisson``. Johnson, Contact Mechanics, 1985, eq. 4.23."""
    return 4 / 3 * youngs / (1 - poisson**2) * np.sqrt(ball) * depth**1.5


def solve(poisson: float, slope: float) -> tuple[FiniteStrainContact, ContactState, float]:
    """Solve the contact whose radius is by Hertz ``slope`` times the ball's; return problem, contact, that radius, m.
    poisson : Poisson's ratio of the block"""
    radius = slope * BALL
    block = _BLOCK * radius
    mesh = disc_mesh(block, block, 1.3 * radius, radius / _NODES, radius, growth=1.2)
    contact = pressed(mesh, Material(YOUNGS, poisson), Sphere(BALL), 1.29 * radius)
    depth = radius**2 / BALL
    return contact, contact.press(depth, step=depth / 2), radius


def rows(quick: bool) -> Iterator[Row]:
    """Yield errors of force and contact radius against Hertz, at nu = .3 and .48; quick : one contact for each nu"""
    for poisson in (0.3, 0.48):
        for slope in (0.05,) if quick else (0.05, 0.025):
            started = time.perf_counter()
            contact, touch, radius = solve(poisson, slope)
            of = f"nu {poisson:g}, contact radius {slope:g} of the ball, {1 / _BLOCK:g} of the block"
            name = f"hertz_{poisson:g}_{slope:g}"
            ratio = touch.force[1] / force(touch.depth, BALL, YOUNGS, poisson)
            yield row(f"{name}_force_error", 100 * (ratio - 1), "percent", TARGET, baseline=-100.0, of=of)
            edge = contact_radius(contact, touch) / radius
            yield row(f"{name}_radius_error", 100 * (edge - 1), "percent", TARGET, baseline=-100.0, of=of)
            yield row(f"{name}_time", time.perf_counter() - started, "s", of=of)
