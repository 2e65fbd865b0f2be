"""Poisson's ratio up to .4999: Newton's method takes no more iterations, and cells keep their shape."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from tactile_core.accuracy import Row, row
from tactile_core.geometry.indenters import Sphere, pose_on
from tactile_core.mechanics.finite_strain.newton import FiniteStrainContact
from tactile_core.mechanics.solids.finite_strain import FiniteStrainSolid
from tactile_core.mechanics.solids.hex_mesh import HexMesh
from tactile_core.sensors import Material

from .axisymmetric import disc_mesh, pressed
from .block import block
from .bonded_layer import GOLDEN_BALL, GOLDEN_RADIUS, GOLDEN_THICKNESS

ITERATIONS = 10  # prototypes took 3 to 7 (docs/sources.md, Mechanics); more says that the tangent does not belong
_DEPTHS = np.arange(1, 10) * 0.2e-3  # m, to 60 % of the disc


def on_disc(poisson: float, depths: np.ndarray = _DEPTHS) -> tuple[int, int, float]:
    """Return the most iterations of a step, steps, and smallest det F down the golden disc."""
    mesh = disc_mesh(GOLDEN_RADIUS, GOLDEN_THICKNESS, 4e-3, 0.1e-3, 0.4e-3)
    contact = pressed(mesh, Material(1e6, poisson), Sphere(GOLDEN_BALL), 4e-3)
    touch, most, steps = None, 0, 0
    for depth in depths:
        touch = contact.press(float(depth), touch, step=0.2e-3)
        most, steps = max(most, touch.iterations), steps + touch.steps
    return most, steps, float(contact.solid.deformation(touch.state.displacement)[1].min())


def on_block(poisson: float) -> int:
    """Iterations of one step of 0.2 mm on a block of the production element."""
    across = np.linspace(-3e-3, 3e-3, 9)
    mesh = block(across, -np.linspace(0, 2e-3, 5), across)
    ball = Sphere(3e-3)
    pose = pose_on(ball, np.array([0, -2e-3, 0]), np.array([0, -1.0, 0]))
    contact = FiniteStrainContact(FiniteStrainSolid(mesh, Material(1e6, poisson)), mesh.surface, ball, pose)
    return contact.press(0.2e-3, step=0.2e-3).iterations


def scaled_jacobian(mesh: HexMesh, displacement: np.ndarray) -> float:
    """Smallest sine-like quality of the deformed cells at their Gauss points, 1 for a brick, 0 for a flat cell.

    det(dx / dxi) over the product of its columns' lengths. Knupp, SIAM J. Sci. Comput. 23, 2001, at Gauss points,
    because cells at the poles of a skin are collapsed at their corners.
    """
    from tactile_core.mechanics.solids.elasticity import reference_gradients

    moved = (mesh.nodes + displacement)[mesh.cells]
    jacobian = np.einsum("qak,ead->eqdk", reference_gradients()[2], moved, optimize=True)
    return float((np.linalg.det(jacobian) / np.linalg.norm(jacobian, axis=2).prod(-1)).min())


def quality_rows(name: str, solve: Callable[[], tuple[FiniteStrainSolid, np.ndarray]]) -> Iterator[Row]:
    """Cells of a solved press: ``solve`` gives the solid and the displacement (n, 3) m of its nodes."""
    solid, displacement = solve()
    smallest = float(solid.deformation(displacement)[1].min())
    yield row(f"{name}_smallest_volume_ratio", smallest, "1", 0.5, of="Gauss points", at_least=True)
    shape, rest = (scaled_jacobian(solid.mesh, moved) for moved in (displacement, np.zeros_like(displacement)))
    yield row(f"{name}_smallest_scaled_jacobian", shape, "1", 0.1, baseline=rest, of="baseline: at rest", at_least=True)


def rows(quick: bool) -> Iterator[Row]:
    """Iterations at three ratios."""
    for poisson in (0.49, 0.499, 0.4999):
        most, steps, smallest = on_disc(poisson, _DEPTHS[:4] if quick else _DEPTHS)
        of = f"disc, {(0.8 if quick else 1.8):g} mm deep, steps of 0.2 mm"
        yield row(f"nu_{poisson:g}_disc_iterations", most, "1", ITERATIONS, of=of)
        yield row(f"nu_{poisson:g}_disc_steps", steps, "1", of=of)
        yield row(f"nu_{poisson:g}_disc_smallest_volume_ratio", smallest, "1", 0.5, of=of, at_least=True)
        of = "block, one step of 0.2 mm"
        yield row(f"nu_{poisson:g}_block_iterations", on_block(poisson), "1", ITERATIONS, of=of)
