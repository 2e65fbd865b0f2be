"""The BioTac SP in the fast tier: pressed by every kind of body, its electrodes felt."""

from pathlib import Path

import numpy as np
import pytest
from coarse_sensors import SP, copy_sp

from tactile_core.geometry.indenters import Sphere
from tactile_core.mechanics.electrodes.biotac_sheet import rest_counts, signal_of
from tactile_core.mechanics.node_areas import node_areas
from tactile_core.mechanics.placement import Placement
from tactile_core.mechanics.solve import solve
from tactile_core.sensors import descriptor, excitation_electrodes
from tactile_core.simulation.pair_sampling import press_rows
from tactile_core.simulation.scene import load_scene

NAME, BALL = SP, Sphere(3.5e-3)
SCENE = Path(__file__).parents[3] / "scenes" / "training"


@pytest.fixture(scope="module", autouse=True)
def places(outside_data, tmp_path_factory):
    """The public table of electrodes, where the descriptor looks for it."""
    folder = tmp_path_factory.mktemp("own")
    copy_sp(folder, (outside_data("biotac_sp") / "locations.csv").read_bytes())
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(descriptor.OWN, str(folder))
        assert len(excitation_electrodes(NAME)) == 4
        yield


def test_it_is_even_across():
    left, right = (solve(NAME, BALL, Placement(-8e-3, z), depth=0.3e-3, friction=0.0) for z in (-3e-3, 3e-3))
    assert left.axial_force == pytest.approx(right.axial_force, rel=1e-4)
    np.testing.assert_allclose(left.force * [1, 1, -1], right.force, atol=1e-3 * right.axial_force)
    # E1..E10 and E11..E20 are each other's images, E22 and E23 too
    image = np.r_[10:20, 0:10, 20, 22, 21, 23]
    # the middle ones' feet lie in triangles that are not even: 20 um on nodes so far apart
    np.testing.assert_allclose(left.electrode_gaps[image], right.electrode_gaps, atol=30e-6)


def test_counts_fall_where_it_is_squeezed():
    pressed = solve(NAME, BALL, Placement(-9.5e-3, 0.0), depth=0.5e-3)
    squeezed = int(
        np.argmin(pressed.electrode_gaps - solve(NAME, BALL, Placement(-9.5e-3, 0.0), depth=0.0).electrode_gaps)
    )
    change = signal_of(pressed, NAME)
    assert change.shape == (24,) and change[squeezed] < 0 and np.isfinite(change).all()
    assert pressed.pressure > 0 and pressed.axial_force > 0
    rest = rest_counts(NAME)
    assert rest.shape == (24,) and (rest > 2500).all() and (rest < 4000).all()  # as real units': 2,840 to 3,720


def test_a_press_gives_pairs_with_the_digit():
    scene, _ = load_scene(SCENE)
    rows = press_rows(scene, 3, 1, (NAME, "digit"), keep=["traction"])
    assert len(rows) > 3 and rows[0]["signal"].shape == (24,)
    for row in rows:
        ratio = np.linalg.norm(row["force"]) / np.linalg.norm(row["force_digit"])
        assert 0.5 < ratio < 2  # the same along the motion; across it by friction, which differs
        for sensor, force in ((NAME, row["force"]), ("digit", row["force_digit"])):
            total = node_areas(sensor) @ row[f"traction_{sensor}"]
            np.testing.assert_allclose(total, force, atol=1e-5 * np.linalg.norm(force))  # float32 of thousands of nodes
    assert f"displacement_{NAME}" in rows[0] and rows[-1]["contact_patch_digit"].any()
