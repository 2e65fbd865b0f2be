"""The fast tier's correction: it learns what it is shown, mirrors, fades out, and ships small and sound."""

import dataclasses

import numpy as np
import pytest
from benchmarks.make import learn_correction

from tactile_core.files.shipped import shipped
from tactile_core.geometry.indenters import Sphere
from tactile_core.mechanics.fast import correction
from tactile_core.mechanics.fast.compliance import compliance_of
from tactile_core.mechanics.fast.correction import LINES, MIRRORED, PatchFrame, correct, features, frame
from tactile_core.mechanics.fast.press import FORCE_TOLERANCE, CorrectedPress
from tactile_core.mechanics.placement import Placement, pose_at
from tactile_core.sensors import sensor_surface

BALL = Sphere(3.5e-3)
REST = np.zeros_like(sensor_surface("digit").rest)


def press(z=1.5e-3, tilt=0.2, heading=0.7):
    return CorrectedPress(
        compliance_of("digit"), BALL, pose_at("digit", BALL, Placement(-8e-3, z, tilt, heading)), 2e-3
    )


@pytest.fixture(scope="module")
def contact():
    return press().at_depth(0.5e-3)


def test_the_shipped_file_is_small_finite_and_whole():
    assert shipped(correction.FILE).stat().st_size < 2e6  # bytes: the target
    for sensor in correction.learned().values():
        for parts in (sensor.still, sensor.rubbing):
            for field in dataclasses.fields(parts):
                assert np.isfinite(getattr(parts, field.name)).all()


def test_a_field_is_spread_where_it_belongs_and_fades():
    at = PatchFrame(np.array([-8e-3, 1e-3]), 1e-3)
    field = np.zeros((LINES, LINES, 3))
    field[LINES // 2, LINES // 2, 1] = -1.0  # outward at the centre
    moved = correction.add_field("digit", REST, at, field.reshape(-1, 3), 1.0)
    plane = correction.plane("digit")
    far = np.linalg.norm(plane - at.centre, axis=1) > 0.4e-3  # a cell of the grid at the centre is 0.2 mm
    assert not moved[far].any() and moved[:, 1].max() > 0.1 and not moved[:, [0, 2]].any()


def test_a_field_on_the_nodes_survives_the_way_to_the_grid_and_back():
    at = PatchFrame(np.array([-8e-3, 0.5e-3]), 1.5e-3)
    plane = correction.plane("digit")
    bump = np.exp(-((plane - at.centre) ** 2).sum(axis=1) / (2 * (2e-3) ** 2))
    field = np.stack([0.3 * bump, bump, -0.2 * bump], -1)
    back = correction.add_field("digit", REST, at, learn_correction.residual_on_grid("digit", at, field), 1.0)
    near = np.linalg.norm(plane - at.centre, axis=1) < 5e-3
    assert np.abs(back - field)[near].max() < 0.03  # bilinear on cells of 0.3 to 0.8 mm, a bump of 2 mm


def test_features_of_a_mirrored_contact_are_mirrored():
    pair = [press(z, 0.2, heading).at_depth(0.5e-3).linear for z, heading in ((1.5e-3, 0.7), (-1.5e-3, -0.7))]
    first, second = (features(compliance_of("digit"), c, frame(compliance_of("digit"), c)) for c in pair)
    np.testing.assert_allclose(second, first * MIRRORED, atol=2e-3)  # the first touch is found to a micrometre


def test_force_asked_for_is_the_corrected_one(contact):
    found = press().at_force(contact.axial_force)
    assert found.axial_force == pytest.approx(contact.axial_force, rel=FORCE_TOLERANCE)
    assert found.linear.depth == pytest.approx(0.5e-3, rel=2 * FORCE_TOLERANCE)
    assert press().at_force(1e3) is None


def test_learning_recovers_a_known_factor_and_field(contact, monkeypatch):
    """Presses whose truth is a smooth function of the contact: the regression finds most of it on presses apart."""
    compliance, samples = compliance_of("digit"), []
    random = np.random.default_rng(0)
    for number in range(40):
        place = Placement(random.uniform(-12e-3, -4e-3), random.uniform(-3e-3, 3e-3))
        run = CorrectedPress(compliance, BALL, pose_at("digit", BALL, place), 2e-3)
        found = run.at_depth(random.uniform(0.2e-3, 0.9e-3)).linear
        at = frame(compliance, found)
        x = features(compliance, found, at)
        grid = np.exp(-(correction.grid_places() ** 2).sum(axis=-1)).reshape(-1, 1) * [0.0, 0.05 + 0.3 * x[0], 0.0]
        full = correction.add_field("digit", found.displacement, at, grid, found.depth)
        samples.append(
            learn_correction.Sample(
                number, 0.0, x, at, found.depth, 1 + x[0], found.displacement, full.astype(np.float32)
            )
        )
    parts, rows = learn_correction.learn("digit", samples)
    by_name = {row["name"]: row for row in rows}
    assert rows
    for name, row in by_name.items():
        if name.endswith(("shape_rms", "force_error")):
            assert row["value"] < 0.3 * row["baseline"]
    monkeypatch.setattr(correction, "learned", lambda: {"digit": parts})
    made = correct(compliance, contact.linear)
    assert made.factor == pytest.approx(1 + contact.linear.depth / 4.06e-3, rel=0.02)
