"""Bodies of the sensors: published sizes, closed solids, and a view into them for the sensor's own camera."""

import bpy
import numpy as np
import pytest

# mm along, across and up from the housing's back to the gel's highest point: docs/sources.md
SIZES = {"DIGIT": (27.0, 20.0, 18.0), "GELSIGHT_MINI": (24.0, 28.0, 32.0)}


def bodies(sensor):
    bpy.ops.tactile.add_sensor(sensor=sensor)
    return bpy.context.object, [thing for thing in bpy.context.object.children if thing.tactile.role == "BODY"]


@pytest.mark.parametrize("sensor", SIZES)
def test_a_housing_has_its_published_size(scene, sensor):
    gel, parts = bodies(sensor)
    housing = next(part for part in parts if part.name.endswith("housing"))
    low, high = (pick(np.array(housing.bound_box), axis=0) for pick in (np.min, np.max))
    size = [*(high - low)[:2], max(corner[2] for corner in gel.bound_box) - low[2]]
    assert size == pytest.approx(SIZES[sensor], abs=0.4)  # a wall is drawn with the gel's own outline


@pytest.mark.parametrize("sensor", ["BIOTAC", *SIZES])
def test_parts_are_closed_and_face_outward(scene, sensor):
    _, parts = bodies(sensor)
    assert len(parts) >= 3
    for part in parts:
        mesh = part.data
        mesh.calc_loop_triangles()
        faces = np.array([face.vertices[:] for face in mesh.loop_triangles])
        edges = faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
        ways = {tuple(edge) for edge in edges.tolist()}
        assert len(ways) == len(edges) and all((b, a) in ways for a, b in ways), part.name
        a, b, c = np.array([vertex.co for vertex in mesh.vertices])[faces].transpose(1, 0, 2)
        assert (a * np.cross(b, c)).sum() > 0, part.name
