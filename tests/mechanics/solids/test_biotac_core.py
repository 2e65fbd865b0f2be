"""The core's gap: smooth, with the normal that belongs to it, over the nodes that may touch it."""

import numpy as np

from tactile_core.mechanics.solids.biotac_core import Core, facing_core
from tactile_core.sensors import skin_of

SKIN = skin_of("biotac")


def on_core(count=200, seed=0):
    """Places on the core's surface under the pad."""
    random = np.random.default_rng(seed)
    x, theta = random.uniform(-17e-3, 4e-3, count), random.uniform(-1.6, 1.6, count)
    points = np.column_stack([x, SKIN.axis_y - 5e-3 * np.cos(theta), 5e-3 * np.sin(theta)])
    for _ in range(8):
        gap, normal = Core("biotac").distance(points)
        points = points - gap[:, None] * normal
    return points


def test_the_normal_is_the_gaps_gradient_where_it_is_closed():
    points, step = on_core(), 1e-7
    gap, normal = Core("biotac").distance(points)
    assert np.abs(gap).max() < 1e-9
    for axis in range(3):
        shift = np.eye(3)[axis] * step
        slope = (Core("biotac").distance(points + shift)[0] - Core("biotac").distance(points - shift)[0]) / (2 * step)
        np.testing.assert_allclose(slope, normal[:, axis], atol=1e-5)  # the step's square over the tip's 1 mm radius


def test_curvature_is_symmetric_and_bounded():
    blocks = Core("biotac").curvature(on_core())
    np.testing.assert_allclose(blocks, blocks.swapaxes(1, 2), atol=1e-9)
    assert np.abs(np.linalg.eigvalsh(blocks)).max() < 1 / 0.5e-3  # no edge sharper than half a millimetre


def test_the_smoothed_table_stays_with_the_table():
    table = SKIN.table
    row = int(np.argmin(np.abs(table["x"] + 8e-3)))
    theta = table["theta"][np.abs(table["theta"]) < 1.7]
    radius = table["core"][row][np.abs(table["theta"]) < 1.7]
    points = np.column_stack([
        np.full(len(theta), table["x"][row]), SKIN.axis_y - radius * np.cos(theta), radius * np.sin(theta)
    ])  # fmt: skip
    assert np.sqrt((Core("biotac").distance(points)[0] ** 2).mean()) < 20e-6  # the table's own roughness


def test_nodes_that_may_touch_lie_over_the_pad_and_off_the_core():
    inner = SKIN.skin_surface("inner").rest
    facing = facing_core("biotac", inner)
    gap = Core("biotac").distance(inner[facing])[0]
    assert 0.3 < facing.mean() < 0.7 and gap.min() > 0.1e-3
    assert 2.3e-3 < gap.max() < 2.6e-3  # docs/sources.md, BioTac fluid: the film is 2.45 mm at most
