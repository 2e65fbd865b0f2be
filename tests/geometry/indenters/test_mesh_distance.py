"""Distance to triangles looked up in cells, against every triangle in turn, slender ones, and thin walls."""

import numpy as np
import pytest
import trimesh

from tactile_core.geometry.indenters import MeshIndenter, mesh_distance, mesh_grid
from tactile_core.geometry.indenters.mesh_distance import NearTriangles


@pytest.mark.parametrize("cell", [0.3, 1.0, 10.0])  # triangles are about 1 across: cut up, few a cell, all in one
def test_nearest_of_all_triangles(cell):
    random = np.random.default_rng(0)
    triangles = random.uniform(-2, 2, (40, 1, 3)) + random.uniform(-0.7, 0.7, (40, 3, 3))
    points, bound = random.uniform(-4, 4, (300, 3)), 1.5
    tiled = np.tile(triangles, (300, 1, 1))
    at = np.repeat(points, 40, axis=0)
    exact = np.linalg.norm(trimesh.triangles.closest_point(tiled, at) - at, axis=1).reshape(300, 40).min(axis=1)
    near = NearTriangles(triangles, cell)
    for found in (near.distance(points, bound), near._by_tree(points, bound)):
        assert 0.2 < np.isfinite(found).mean() < 0.8
        np.testing.assert_allclose(found, np.where(exact < bound, exact, np.inf), rtol=1e-9)


def test_uncompiled_grids_are_the_same(compiled_loops):
    ring = trimesh.creation.annulus(r_min=1.0, r_max=2.0, height=1.0, sections=40)
    grids = []
    for on in (True, False):
        compiled_loops(on)
        grids.append(mesh_grid.build(ring, "ring", 0.2e-3)[0])
    # m; kept in four bytes
    np.testing.assert_allclose(grids[0].coefficients, grids[1].coefficients, rtol=1e-6, atol=1e-12)


def test_slender_triangles_are_cut_along_their_length(monkeypatch):
    """Pieces grow as length over cell, not its square; of so many long triangles that they do not fit, cells grow."""
    triangles = trimesh.creation.cylinder(5.0, 30.0, sections=1000).triangles
    usual, cell = mesh_distance._LONGEST, 0.2
    for most_cells in (usual, usual // 10):
        monkeypatch.setattr(mesh_distance, "_LONGEST", most_cells)
        near = NearTriangles(triangles, cell)
        longest = np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=2).max(axis=1)
        rows = np.ceil(np.log2(longest / cell) + 0.5)
        most = 2 * (2**rows).sum()  # each is halved until its edges fit; beside its shortest, both at once
        assert len(near.middles) <= (most if most_cells == usual else 0.5 * most)
        assert len(near.middles) < 3 * most_cells
        random = np.random.default_rng(0)
        angle, height = random.uniform(0, 2 * np.pi, 100), random.uniform(-14, 14, 100)
        points = np.column_stack([5.1 * np.cos(angle), 5.1 * np.sin(angle), height])
        # Facets of 31 um lie up to 5 (1 - cos(pi / 1000)) = 25 nm under the circle.
        np.testing.assert_allclose(near.distance(points, 0.4), 0.1, atol=3e-5)


def test_a_thin_wall_keeps_its_thickness():
    """A cup whose wall is twice the grid's spacing thick, so that every coarse node is near both of its faces."""
    wall = trimesh.creation.annulus(r_min=2.3e-3, r_max=2.5e-3, height=3e-3, sections=128)
    made = MeshIndenter.from_trimesh(wall, spacing=0.1e-3)
    angle = np.linspace(0, 2 * np.pi, 50)
    for radius, exact in ((2.4e-3, -0.1e-3), (2.5e-3, 0.0), (2.3e-3, 0.0), (2.6e-3, 0.1e-3), (2.1e-3, 0.2e-3)):
        points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(50)])
        # The middle is a crease, which a spline rounds by up to a third of the spacing, and 0.27 of that a node off.
        np.testing.assert_allclose(made.distance(points)[0], exact, atol=35e-6 if exact < 0 else 9e-6)
