"""Bodies of the full tier: the mesh is fine where the indenter is, whatever its depth."""

import numpy as np
import pytest

from tactile_core.geometry.indenters import Cylinder, Sphere
from tactile_core.mechanics.finite_strain.body import _footprint, graded_body
from tactile_core.mechanics.placement import Placement, pose_at
from tactile_core.sensors import biotac_surface, digit_surface

BALL, PLACE = Sphere(3.5e-3), Placement(-5e-3, 1e-3)
LATTICES = {"digit": digit_surface, "biotac": biotac_surface}


@pytest.mark.parametrize("sensor", LATTICES)
@pytest.mark.parametrize("depth", [-1e-3, 0.0, 1e-9, 1e-3])
def test_the_footprint_lies_at_the_indenter_at_any_depth(sensor, depth):
    """Before it touches, too: no node overlaps then."""
    pose, lattice = pose_at(sensor, BALL, PLACE), LATTICES[sensor]()
    rows, columns = lattice.shape
    grid = lattice.rest[: rows * columns].reshape(rows, columns, 3)
    nearest = np.linalg.norm(grid - pose.apex, axis=-1).argmin()
    row, column = np.divmod(nearest, columns)
    footprint = _footprint(sensor, BALL, pose, depth)
    middle = (np.array(footprint.low) + footprint.high) / 2
    assert np.abs(middle - [row + (sensor == "biotac"), column]).max() < 1.6  # lattice lines


@pytest.mark.parametrize("sensor", LATTICES)
def test_a_deeper_ball_has_a_larger_footprint(sensor):
    pose = pose_at(sensor, BALL, PLACE)
    sizes = [np.ptp([f.low[1], f.high[1]]) for f in (_footprint(sensor, BALL, pose, d) for d in (0.1e-3, 1.2e-3))]
    assert sizes[1] > 1.2 * sizes[0]


def test_a_rim_that_hides_under_the_resting_nodes_is_held_out_too():
    """Round a tilted punch deep in the gel, the resting nodes near it see its blunt side alone."""
    punch, depth = Cylinder(1.75e-3, 0.4e-3), 1.1554e-3
    pose = pose_at("digit", punch, Placement(-0.962e-3, -4.745e-3, tilt=0.1768, tilt_heading=3.6407))
    body = graded_body("digit", punch, pose, depth)
    assert body.contact(punch, pose, depth, 0.0)._penalty is None
    assert body.contact(punch, pose, depth, 0.0, every_edge=True)._penalty is not None
    assert body.contact(punch, pose, depth, 0.5, every_edge=True)._penalty is None
