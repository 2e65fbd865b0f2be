"""Fields beside the picture: what a pixel holds is what the gel point has that it sees."""

import dataclasses

import numpy as np
import pytest

from tactile_core.pictures.height_map import gel_mapper, height_map
from tactile_core.pictures.perspective import lookup
from tactile_core.pictures.renderer import Renderer
from tactile_core.pictures.seen_fields import seen_fields
from tactile_core.sensors.calibration_file import load_calibration


@pytest.mark.parametrize("down_x", [1, -1])
def test_a_node_s_pixel_holds_the_node_s_values(down_x):
    unit = load_calibration()
    camera = dataclasses.replace(unit.camera, down_x=down_x * unit.camera.down_x, right_z=down_x * unit.camera.right_z)
    unit = dataclasses.replace(unit, dome_scale=1.0, camera=camera, photograph="")
    rest = camera.surface.rest
    x, z = rest[:, 0] - camera.centre_x - 1e-3, rest[:, 2] - camera.centre_z
    dent = np.exp(-(x**2 + z**2) / 2e-3**2)
    moved = np.stack([0.3e-3 * dent * x / 2e-3, 0.8e-3 * dent, 0.2e-3 * dent], 1)
    found = seen_fields(Renderer(unit, "fast"), height_map(moved, camera), moved, dent > 0.5)

    there_x, there_z, height = gel_mapper(camera).follow(moved, rest[:, 0], rest[:, 2])
    row, column = camera.to_pixel(there_x, there_z, height)
    inside = (np.abs(row - 159.5) < 158) & (np.abs(column - 119.5) < 118)
    at = lookup(row[inside].astype(np.float32)[None], column[inside].astype(np.float32)[None], camera.shape)

    def there(values):
        return at(np.ascontiguousarray(values))[0]

    # m: linear between nodes of 0.4 mm, and between pixels of 0.06 mm.
    np.testing.assert_allclose(there(found["Height"]), height[inside], atol=5e-6)
    for axis in range(3):
        np.testing.assert_allclose(there(found["Displacement"][..., axis]), moved[inside, axis], atol=6e-6)
    clear = np.abs(dent[inside] - 0.5) > 0.2
    assert ((there(found["Contact"]) > 0.5) == (dent[inside] > 0.5))[clear].all()
    # The normal leans toward the dent's middle, by the slope of its flank.
    towards_tip = np.argmin(np.hypot(x[inside] + 1.5e-3, z[inside]))
    normal = [there(found["Normal"][..., axis])[towards_tip] for axis in range(3)]
    assert normal[0] > 0.2 and normal[1] < -0.8 and np.linalg.norm(normal) == pytest.approx(1, abs=1e-3)
