"""Measure the order of accuracy by a manufactured solution: prescribe a smooth finite deformation, compute its load and
solve for it on finer and finer meshes."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tactile_core.accuracy import Row, order, row
from tactile_core.mechanics.solids.elasticity import quadratic, reference_gradients
from tactile_core.mechanics.solids.finite_strain import FiniteStrainSolid, State
from tactile_core.sensors import Material

from .block import block, equilibrium, inside

# The orders that theory gives are 3 and 2; a line through coarse meshes comes to within a tenth.
DISPLACEMENT_ORDER, STRAIN_ORDER = 2.8, 1.9
_COMPLEX_STEP = 1e-30  # a derivative without cancellation: Im f(x + i h) / h


def deformed(points: np.ndarray) -> np.ndarray:
    """Deform points (..., 3) of the unit cube: three shears, which keep volumes, then at most 1 % of swelling."""
    x, y, z = np.moveaxis(points, -1, 0)
    x = x + 0.1 * np.sin(np.pi * y)
    y = y + 0.1 * np.sin(np.pi * z)
    z = z + 0.1 * np.sin(np.pi * x)
    return np.stack([x + 0.005 * x**2, y, z], -1)


def gradient(points: np.ndarray) -> np.ndarray:
    """Return the deformation gradient (..., 3, 3) of ``deformed`` at points (..., 3), exact."""
    columns = [deformed(points + 1j * _COMPLEX_STEP * axis).imag / _COMPLEX_STEP for axis in np.eye(3)]
    return np.stack(columns, -1)


def errors(cells: int, poisson: float) -> tuple[float, float]:
    """Return rms errors of displacement and its gradient in a cube of side 1 with ``cells`` along each side.
    poisson : Poisson's ratio"""
    planes = np.linspace(0, 1, 2 * cells + 1)
    mesh = block(planes, planes[::-1], planes)
    solid = FiniteStrainSolid(mesh, Material(1.0, poisson))
    reference = reference_gradients()[0]
    values = [quadratic(reference[:, k])[0] for k in range(3)]
    shape = np.einsum("qa,qb,qc->qcba", *values).reshape(27, 27)
    points = np.einsum("qa,ead->eqd", shape, mesh.nodes[mesh.cells])
    truth, f = deformed(points) - points, gradient(points)
    j = np.linalg.det(f)
    stress = solid.law.stress_tangent(f, j, solid.law.bulk * (j - 1))[0]
    local = np.einsum("eq,eqij,eqaj->eai", solid.weight, stress, solid.gradient, optimize=True)
    load = np.bincount(solid.dofs.ravel(), local.ravel())
    start = State(deformed(mesh.nodes) - mesh.nodes, solid.rest().pressure)
    found = equilibrium(solid, start, inside(mesh), load)
    off = np.einsum("qa,ead->eqd", shape, found.displacement[mesh.cells]) - truth
    twisted = solid.deformation(found.displacement)[0] - f
    return _rms(solid.weight, off), _rms(solid.weight, twisted)


def _rms(weight: np.ndarray, values: np.ndarray) -> float:
    return float(np.sqrt((weight * (values.reshape(*weight.shape, -1) ** 2).sum(-1)).sum()))


def rows(quick: bool) -> Iterator[Row]:
    """Yield errors and orders of accuracy, of displacement (L2) and its gradient (H1); quick : orders alone, coarse"""
    counts = (2, 3, 4) if quick else (2, 3, 4, 6, 8)
    for poisson in (0.49,) if quick else (0.3, 0.49):
        found = []
        for cells in counts:
            found.append(errors(cells, poisson))
            if not quick:
                of = f"nu {poisson:g}, {cells} cells a side of 1"
                yield row(f"manufactured_{poisson:g}_displacement_{cells}", found[-1][0], "1", of=of)
                yield row(f"manufactured_{poisson:g}_gradient_{cells}", found[-1][1], "1", of=of)
        of = f"nu {poisson:g}, {counts[0]} to {counts[-1]} cells a side"
        sizes = [1 / count for count in counts]
        for k, (name, target) in enumerate((("displacement", DISPLACEMENT_ORDER), ("gradient", STRAIN_ORDER))):
            slope = order(sizes, [pair[k] for pair in found])
            yield row(f"manufactured_{poisson:g}_{name}_order", slope, "1", target, of=of, at_least=True)
