"""Patch test: cells of any shape reproduce an affine deformation, small or finite."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np

from tactile_core.accuracy import Row, row
from tactile_core.mechanics.solids.finite_strain import FiniteStrainSolid
from tactile_core.sensors import Material

from .block import block, equilibrium, inside

SIDE = 2e-3  # m
# Rounding of a Newton step: 1e-16 of the displacement times the matrix's condition, about 1e3 here.
TARGET = 1e-12


def bent_block() -> FiniteStrainSolid:
    """2 x 2 x 2 cells whose inner nodes are moved by up to 8 % of a cell, so that no cell is a brick."""
    planes = np.linspace(-SIDE / 2, SIDE / 2, 5)
    mesh = block(planes, planes[::-1], planes)
    nodes = mesh.nodes + inside(mesh)[:, None] * np.random.default_rng(0).uniform(-8e-5, 8e-5, mesh.nodes.shape)
    return FiniteStrainSolid(dataclasses.replace(mesh, nodes=nodes), Material(1e6, 0.49))


def patch_error(size: float) -> tuple[float, float]:
    """Largest relative error of displacement and of pressure where the sides follow F = 1 + size * (fixed numbers)."""
    solid = bent_block()
    gradient = size * np.random.default_rng(1).uniform(-1, 1, (3, 3))
    exact = solid.mesh.nodes @ gradient.T
    free = inside(solid.mesh)
    start = solid.rest()
    noise = np.random.default_rng(2).uniform(-1, 1, exact.shape) * 1e-2 * size * SIDE
    start.displacement = exact + free[:, None] * noise
    found = equilibrium(solid, start, free)
    pressure = solid.law.bulk * (np.linalg.det(np.eye(3) + gradient) - 1)
    off = found.pressure - [pressure, 0, 0, 0]
    missed = np.abs(found.displacement - exact).max() / np.abs(exact).max()
    return float(missed), float(np.abs(off).max() / abs(pressure))


def rows(quick: bool) -> Iterator[Row]:
    """Yield rows at small and at finite strain."""
    for size in (1e-4, 0.2):
        moved, pressure = patch_error(size)
        of = f"8 distorted cells, F = 1 + {size:g}, nu .49"
        yield row(f"patch_{size:g}_displacement_error", moved, "1", TARGET, baseline=1.0, of=of)
        # J - 1 of a small strain keeps 1e-16 / size of its digits
        yield row(f"patch_{size:g}_pressure_error", pressure, "1", TARGET / size, baseline=1.0, of=of)
