"""The BioTac SP's skin as a structured solid of 27-node hexahedra: half a cubed sphere, stretched to two ellipsoids."""

from __future__ import annotations

import numpy as np

from ..solids.hex_mesh import HexMesh, hex_cells

LAYERS = 3  # nodes through the skin: one quadratic element, enough for a shell that bends


def half_ellipsoid_mesh(
    outer: np.ndarray, inner: np.ndarray, intervals: tuple[int, int, int], *, mirrored: bool = False
) -> tuple[HexMesh, np.ndarray, np.ndarray]:
    """Return the solid between two half ellipsoids z <= 0 about the origin, clamped at its rim z = 0.

    outer, inner : (3,) m, semi-axes; intervals : node intervals along x and along y in the middle patch, and from it
    to the rim, even; along y a multiple of four
    mirrored : only y >= 0, its cut free to slide in the plane y = 0
    Returns the mesh (``surface`` its outer, ``inner`` its inner nodes, in one order), its fixed degrees of freedom
    (3 n,) bool, and the faces (k, 9) of the inner side as ``QuadraticCavity`` takes them.
    The patches are the faces of a cube, seen from its centre at equal angles (Ronchi, Iacono, Paolucci,
    J. Comput. Phys. 124, 1996), so that no cell collapses and every apex lies inside an even grid.
    """
    patches = _directions(intervals, mirrored=mirrored)
    all_directions = np.concatenate([patch.reshape(-1, 3) for patch in patches])
    _, first, number = np.unique(np.round(all_directions, 9), axis=0, return_index=True, return_inverse=True)
    unit = all_directions[first]
    axes = inner + np.linspace(0, 1, LAYERS)[:, None] * (outer - inner)
    nodes = (unit[:, None] * axes).reshape(-1, 3)
    cells, faces, start = [], [], 0
    for patch in patches:
        rows, columns = patch.shape[:2]
        ids = number.reshape(-1)[start : start + rows * columns].reshape(rows, columns) * LAYERS
        start += rows * columns
        cells.append(hex_cells(ids[..., None] + np.arange(LAYERS)))
        faces.append(_faces(ids))
    clamped = np.abs(nodes[:, 2]) < 1e-9
    fixed = np.repeat(clamped, 3).reshape(-1, 3)
    if mirrored:
        fixed[np.abs(nodes[:, 1]) < 1e-9, 1] = True
    bottom = np.arange(len(unit)) * LAYERS
    mesh = HexMesh(nodes, np.concatenate(cells), clamped, bottom + LAYERS - 1, bottom)
    return mesh, fixed.ravel(), np.concatenate(faces)


def _directions(intervals: tuple[int, int, int], *, mirrored: bool) -> list[np.ndarray]:
    """Unit vectors (rows, columns, 3) of each patch; rows x columns turns right-handed about the outward normal."""
    along_x, along_y, to_rim = intervals
    x = np.tan(np.linspace(-np.pi / 4, np.pi / 4, along_x + 1))
    y = np.tan(np.linspace(-np.pi / 4, np.pi / 4, along_y + 1))
    x[along_x // 2] = y[along_y // 2] = 0.0
    if mirrored:
        y = y[along_y // 2 :]
    z = np.tan(np.linspace(0, np.pi / 4, to_rim + 1))
    one = np.ones(1)
    patches = [
        _patch(lambda a, b: (b, a, -one), y, x),
        _patch(lambda a, b: (one, b, -a), z, y),
        _patch(lambda a, b: (-one, b, -a), z, y)[:, ::-1],
        _patch(lambda a, b: (b, one, -a), z, x)[:, ::-1],
    ]
    if not mirrored:
        patches.append(_patch(lambda a, b: (b, -one, -a), z, x))
    return patches


def _patch(place, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:  # noqa: ANN001 (a function of two grids)
    a, b = np.meshgrid(rows, columns, indexing="ij")
    directions = np.stack(np.broadcast_arrays(*place(a, b)), -1)
    return directions / np.linalg.norm(directions, axis=-1, keepdims=True)


def _faces(ids: np.ndarray) -> np.ndarray:
    shifts = [(slice(i, i - 2 or None, 2), slice(j, j - 2 or None, 2)) for i in range(3) for j in range(3)]
    return np.stack([ids[shift] for shift in shifts], -1).reshape(-1, 9)
