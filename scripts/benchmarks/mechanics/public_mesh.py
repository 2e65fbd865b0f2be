"""The Isaac-like mode on the public meshes of both sensors against our own model of them.

Two differences are separated: Isaac Gym's settings against our own material with the fluid (what a user of such data
meets), and linear tetrahedra against our mixed hexahedra with one material and no fluid (locking, and nodes 1 mm apart:
on the DIGIT's mesh the ball first touches a node 72 um below where it touches the gel).
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from tactile_core import sensors
from tactile_core.accuracy import Row, row
from tactile_core.geometry.indenters import Pose, Sphere
from tactile_core.geometry.lattice import Lattice
from tactile_core.mechanics.finite_strain.body import ONE_STEP, Body, graded_body
from tactile_core.mechanics.finite_strain.newton import FiniteStrainContact
from tactile_core.mechanics.placement import Placement, biotac_pose, digit_pose
from tactile_core.mechanics.solids.finite_strain import FiniteStrainSolid
from tactile_core.sensors import Material, unrolling

from ..isaac import pressed_tets as isaac_like
from ..isaac.tet_file import TetMesh, checked, read_tet

_BALL, _PLACE = Sphere(3.5e-3), Placement(-8e-3, 0.0)
_MOVES = 10e-6  # m, nodes that move more count, as in metrics
_NEAR = 5e-3  # m from the touched place: where nodes are compared


def rows(quick: bool, data: Path) -> Iterator[Row]:
    """A press on either mesh; nothing where the folder ``data`` does not hold them."""
    if (data / "biotac_mesh" / "skin.tet").exists():
        mesh = read_tet(data / "biotac_mesh" / "skin.tet")
        held = isaac_like.near_body(mesh, data / "biotac_mesh" / "core.obj")
        yield from _biotac(mesh, held, [0.3e-3] if quick else [0.3e-3, 0.8e-3, 1.2e-3])
    if (data / "digit_mesh" / "digit_gel.mesh").exists():
        mesh = _read_medit(data / "digit_mesh" / "digit_gel.mesh")
        yield from _digit(mesh, isaac_like.on_back(mesh), [0.3e-3] if quick else [0.3e-3, 0.6e-3])


def _biotac(mesh: TetMesh, held: np.ndarray, depths: list[float]) -> Iterator[Row]:
    pose = biotac_pose(_BALL, _PLACE)
    skin, isaac = sensors.BIOTAC_SKIN, isaac_like.SKIN
    pairs = Pairs(mesh, sensors.biotac_surface(), pose)
    for depth in depths:
        started = time.perf_counter()
        as_isaac = _tets(mesh, held, pose, depth, isaac)
        ended = time.perf_counter()
        body = graded_body("biotac", _BALL, pose, depth)
        own = _own(body, pose, depth)
        where, of = f"public_biotac_{depth * 1e3:.1f}mm", "7 mm ball, mid pad, 4,246 nodes"
        yield from _against(f"{where}_isaac_settings", as_isaac, own, pairs, of + ", against own with fluid")
        yield row(f"{where}_isaac_settings_time", ended - started, "s", of=of)
        same = of + ", same material, no fluid"
        yield from _against(f"{where}_linear_tets_nu_0.316", as_isaac, _dry(body, pose, depth, isaac), pairs, same)
        ours = _tets(mesh, held, pose, depth, skin)
        yield from _against(f"{where}_linear_tets_nu_0.48", ours, _dry(body, pose, depth, skin), pairs, same)


def _digit(mesh: TetMesh, held: np.ndarray, depths: list[float]) -> Iterator[Row]:
    pose = digit_pose(_BALL, _PLACE)
    pairs = Pairs(mesh, sensors.digit_surface(), pose)
    for depth in depths:
        found = _tets(mesh, held, pose, depth, sensors.DIGIT_GEL)
        own = _own(graded_body("digit", _BALL, pose, depth), pose, depth)
        of = "7 mm ball, middle, 1,834 nodes, same material"
        yield from _against(f"public_digit_{depth * 1e3:.1f}mm_linear_tets_nu_0.48", found, own, pairs, of)


Answer = tuple[np.ndarray, np.ndarray]  # displacement (n, 3) m, of the tets' nodes or the lattice's; force (3,) N


def _tets(mesh: TetMesh, held: np.ndarray, pose: Pose, depth: float, material: Material) -> Answer:
    found = isaac_like.press(mesh, held, _BALL, pose, depth, material)
    if not found.converged:
        raise RuntimeError(f"the public mesh does not converge at {depth * 1e3:g} mm: {found.report['ended']}")
    return found.displacement, found.force


def _own(body: Body, pose: Pose, depth: float) -> Answer:
    touch = body.contact(_BALL, pose, depth, 0.0).press(depth, step=ONE_STEP)
    return body.displacement(touch), touch.force


def _dry(body: Body, pose: Pose, depth: float, material: Material) -> Answer:
    """Press our mesh of another material, without fluid and core."""
    mesh = body.solid.mesh
    near = mesh.surface[pose.moved(depth).distance(_BALL, mesh.nodes[mesh.surface])[0] < 1e-3]
    contact = FiniteStrainContact(FiniteStrainSolid(mesh, material, body.solid.pattern), near, _BALL, pose)
    touch = contact.press(depth, step=isaac_like.LOAD_STEP)
    return body.displacement(touch), touch.force


def _against(name: str, found: Answer, own: Answer, pairs: Pairs, of: str) -> Iterator[Row]:
    """Force and shape of the tetrahedra against ours, at their own nodes near the touched place."""
    ratio = np.linalg.norm(found[1]) / np.linalg.norm(own[1])
    yield row(f"{name}_force_error", 100 * (ratio - 1), "percent", baseline=-100.0, of=of)
    expected = pairs.expected(own[0])
    moved = np.linalg.norm(expected, axis=1) > _MOVES
    off = np.linalg.norm(found[0][pairs.nodes] - expected, axis=1)[moved]
    baseline = np.linalg.norm(expected, axis=1)[moved]
    yield row(
        f"{name}_shape_rms", 1e6 * np.sqrt((off**2).mean()), "um", baseline=1e6 * np.sqrt((baseline**2).mean()), of=of
    )
    yield row(f"{name}_shape_max", 1e6 * off.max(), "um", baseline=1e6 * baseline.max(), of=of)


class Pairs:
    """Nodes of a tetrahedral mesh near a place on our surface, and where they lie on it."""

    def __init__(self, mesh: TetMesh, lattice: Lattice, pose: Pose) -> None:
        nodes = np.unique(mesh.surface)
        nodes = nodes[np.linalg.norm(mesh.nodes[nodes] - pose.apex, axis=1) < _NEAR]
        faces, weights, place = unrolling.closest_on_triangles(lattice, mesh.nodes[nodes])
        here = np.linalg.norm(place - mesh.nodes[nodes], axis=1) < 0.2e-3  # the skin's inner side is 1.58 mm away
        self.nodes, self.corners, self.weights = nodes[here], lattice.faces[faces[here]], weights[here]

    def expected(self, displacement: np.ndarray) -> np.ndarray:
        """Displacement (n, 3) m of our mesh at those nodes."""
        return np.einsum("nk,nkd->nd", self.weights, displacement[self.corners])


def _read_medit(path: Path) -> TetMesh:
    """Vertices and tetrahedra of a Medit ``.mesh``, whose numbers start at 1."""
    lines = [line.strip() for line in path.read_text(encoding="utf-8").splitlines()]

    def block(name: str, width: int) -> np.ndarray:
        start = lines.index(name)
        wanted = lines[start + 2 : start + 2 + int(lines[start + 1])]
        return np.array([[float(word) for word in line.split()[:width]] for line in wanted])

    nodes, cells = block("Vertices", 3), block("Tetrahedra", 4).astype(int) - 1
    used, numbers = np.unique(cells, return_inverse=True)
    return checked(nodes[used], numbers.reshape(-1, 4), path)
