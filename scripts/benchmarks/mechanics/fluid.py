"""Check a block with a cavity full of incompressible fluid: its volume must stay, or grow by what is pumped in."""

from __future__ import annotations

import functools
from collections.abc import Iterator

import numpy as np

from tactile_core.accuracy import Row, row
from tactile_core.geometry.indenters import Sphere, pose_on
from tactile_core.mechanics.finite_strain.newton import FiniteStrainContact
from tactile_core.mechanics.finite_strain.solved_contact import ContactState
from tactile_core.mechanics.solids.finite_strain import FiniteStrainSolid
from tactile_core.mechanics.solids.fluid_cavity import FluidCavity
from tactile_core.mechanics.solids.hex_mesh import HexMesh
from tactile_core.sensors import Material

from .block import block

TARGET = 1e-12  # relative, of the volume (docs/sources.md, Targets)
_SIDE, _DEPTH = 4.5e-3, 0.6e-3  # m


@functools.cache
def hollow() -> tuple[HexMesh, FluidCavity]:
    """Make a block of 3 x 3 x 3 cells without the middle one, clamped at the back, and the cavity that this leaves."""
    planes = np.linspace(0, _SIDE, 7)
    full = block(planes, -planes, planes)
    cells = np.delete(full.cells, 13, axis=0)
    used, renumbered = np.unique(cells, return_inverse=True)
    new = np.full(len(full.nodes), -1)
    new[used] = np.arange(len(used))
    cube = new[full.cells[13]].reshape(3, 3, 3)
    sides = [np.moveaxis(cube, axis, 0)[end] for axis in range(3) for end in (0, -1)]
    nodes = full.nodes[used]
    middle = nodes[np.concatenate(sides)].reshape(-1, 3).mean(0)
    faces = np.stack([_outward(side, nodes, middle).ravel() for side in sides])
    mesh = HexMesh(nodes, renumbered.reshape(cells.shape), full.clamped[used], new[full.surface], np.unique(faces))
    return mesh, FluidCavity(faces, len(nodes))


def _outward(side: np.ndarray, nodes: np.ndarray, middle: np.ndarray) -> np.ndarray:
    """Return a face's node numbers ``side`` (3, 3), transposed if need be: its two directions and the way out of the
    body must be right-handed. nodes : (n, 3) m; middle : (3,) m, of the body"""
    across = np.cross(nodes[side[2, 1]] - nodes[side[0, 1]], nodes[side[1, 2]] - nodes[side[1, 0]])
    return side if across @ (nodes[side[1, 1]] - middle) > 0 else side.T


def pressed(*, full: bool, pumped: float = 0.0) -> tuple[ContactState, float]:
    """Press a ball into the block; return the contact, and the cavity's volume, m3, under it.
    full : true for a cavity full of fluid, to which ``pumped`` m3 are added; false for an empty one"""
    mesh, cavity = hollow()
    ball = Sphere(2e-3)
    pose = pose_on(ball, np.array([_SIDE / 2, -_SIDE, _SIDE / 2]), np.array([0, -1.0, 0]))
    solid = FiniteStrainSolid(mesh, Material(1e6, 0.48))
    fluid = {"cavity": cavity, "pre_inflation": pumped} if full else {}
    contact = FiniteStrainContact(solid, mesh.surface, ball, pose, **fluid)
    touch = contact.press(_DEPTH, step=_DEPTH / 3)
    return touch, cavity.volume(mesh.nodes + touch.state.displacement)


def rows(quick: bool) -> Iterator[Row]:
    """Yield relative errors of a full cavity's volume under a ball, and the ball's force divided by that without fluid.
    quick : changes nothing"""
    mesh, cavity = hollow()
    rest = cavity.volume(mesh.nodes)
    empty, lost = pressed(full=False)
    of = f"hollow block of {_SIDE * 1e3:g} mm, 2 mm ball {_DEPTH * 1e3:g} mm deep"
    for name, pumped in (("fluid", 0.0), ("pumped_fluid", 0.02 * rest)):
        touch, volume = pressed(full=True, pumped=pumped)
        yield row(f"{name}_volume_error", volume / (rest + pumped) - 1, "1", TARGET, baseline=lost / rest - 1, of=of)
    touch, _ = pressed(full=True)
    stiffer = float(touch.force[1] / empty.force[1])
    yield row("fluid_force_over_empty", stiffer, "1", 1.0, baseline=1.0, of=of, at_least=True)
