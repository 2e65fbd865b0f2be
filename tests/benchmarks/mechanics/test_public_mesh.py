"""What the comparison with the public meshes stands on; its metrics are the report's."""

import numpy as np
import pytest
from benchmarks.isaac.tet_file import read_tet
from benchmarks.mechanics import public_mesh

from tactile_core import sensors
from tactile_core.mechanics.placement import biotac_pose


def test_without_the_data_there_are_no_rows(tmp_path):
    assert list(public_mesh.rows(True, tmp_path)) == []


def test_the_public_gel_is_read(outside_data):
    mesh = public_mesh._read_medit(outside_data("digit_mesh") / "digit_gel.mesh")
    assert len(mesh.nodes) == 1834
    assert mesh.nodes[:, 1].min() == pytest.approx(-8.301e-3, abs=1e-6)  # its lowest point (docs/sources.md, Frame)


def test_our_displacement_is_taken_where_the_nodes_lie(outside_data):
    """An affine displacement is exact on the triangles; the nodes lie up to 0.05 mm rms off them."""
    mesh = read_tet(outside_data("biotac_mesh") / "skin.tet")
    lattice, pose = sensors.biotac_surface(), biotac_pose(public_mesh._BALL, public_mesh._PLACE)
    pairs = public_mesh.Pairs(mesh, lattice, pose)
    assert len(pairs.nodes) > 50
    assert (np.linalg.norm(mesh.nodes[pairs.nodes] - pose.apex, axis=1) < 5e-3).all()
    slope = np.array([[0.1, 0.0, 0.2], [0.0, -0.1, 0.0], [0.3, 0.0, 0.0]])
    off = pairs.expected(lattice.rest @ slope.T) - mesh.nodes[pairs.nodes] @ slope.T
    assert np.sqrt((off**2).sum(1).mean()) < 0.05e-3 * 0.4  # times the slope's size
