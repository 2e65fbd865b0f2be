"""A flat elastic layer bonded below, as a sensor: the textbook cases of contact mechanics live on it."""

import numpy as np

from tactile_core.geometry.lattice import Lattice, grid_faces
from tactile_core.mechanics.fast.compliance import Compliance, Solid, assembled, condensed
from tactile_core.mechanics.solids.elasticity import cell_stiffness
from tactile_core.mechanics.solids.hex_mesh import HexMesh, hex_cells
from tactile_core.sensors import Material


def slab_mesh(x: np.ndarray, z: np.ndarray, y: np.ndarray) -> tuple[HexMesh, Lattice]:
    """A block with node planes x, z (m) and y (m, from the bonded back down to the surface at the lowest y)."""
    grid = np.stack(np.meshgrid(x, z, y, indexing="ij"), -1)[..., [0, 2, 1]]
    ids = np.arange(grid[..., 0].size).reshape(grid.shape[:-1])
    clamped = np.zeros(ids.size, bool)
    clamped[ids[..., 0]] = True
    lattice = Lattice(grid[:, :, -1].reshape(-1, 3), grid_faces(len(x), len(z), closed=False), (len(x), len(z)))
    return HexMesh(grid.reshape(-1, 3), hex_cells(ids), clamped, ids[..., -1].ravel(), np.empty(0, int)), lattice


def slab_compliance(x: np.ndarray, z: np.ndarray, y: np.ndarray, material: Material, reach: float) -> Compliance:
    """Its compliance, touchable within ``reach`` m of the middle."""
    mesh, lattice = slab_mesh(x, z, y)
    touchable = np.flatnonzero(np.hypot(lattice.rest[:, 0], lattice.rest[:, 2]) < reach)
    solid = Solid("slab", lattice, touchable, mesh, material)
    return Compliance("slab", lattice, touchable, **dict(assembled(solid, *condensed(solid))))


def assemble(mesh: HexMesh, material: Material):
    """Assemble the global stiffness, scipy CSC (3 n, 3 n) N/m, degree of freedom 3 node + axis, nothing clamped."""
    import scipy.sparse

    local = cell_stiffness(mesh.nodes[mesh.cells], material)
    dofs = (3 * mesh.cells[..., None] + np.arange(3)).reshape(len(mesh.cells), 81)
    rows = np.repeat(dofs, 81, axis=1).ravel()
    columns = np.tile(dofs, (1, 81)).ravel()
    size = 3 * len(mesh.nodes)
    return scipy.sparse.coo_matrix((local.ravel(), (rows, columns)), shape=(size, size)).tocsc()
