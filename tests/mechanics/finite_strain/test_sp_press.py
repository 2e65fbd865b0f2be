"""The BioTac SP: its mesh, its inflated skin, a plate pressed onto it, and the COMSOL presses themselves."""

import dataclasses

import numpy as np
import pytest
from benchmarks.mechanics import comsol

from tactile_core.errors import TactileError
from tactile_core.mechanics.finite_strain.sp_mesh import half_ellipsoid_mesh
from tactile_core.mechanics.finite_strain.sp_press import SpPress
from tactile_core.mechanics.solids.finite_strain import FiniteStrainSolid
from tactile_core.mechanics.solids.fluid_cavity import FluidCavity
from tactile_core.mechanics.solids.mooney_rivlin import MooneyRivlin
from tactile_core.sensors import biotac_sp

COARSE = (12, 8, 4)
APEX, UP = np.array([0.0, 0.0, -10.35e-3]), np.array([0.0, 0.0, 1.0])
LEANING = np.array([np.sin(0.3), 0.0, np.cos(0.3)])


@pytest.mark.parametrize("mirrored", [False, True])
def test_mesh_fills_the_space_between_two_half_ellipsoids(mirrored):
    outer, inner = biotac_sp.OUTER, biotac_sp.OUTER - 1e-3
    mesh, fixed, faces = half_ellipsoid_mesh(outer, inner, COARSE, mirrored=mirrored)
    solid = FiniteStrainSolid(mesh, MooneyRivlin(1e5, 0.0, 1e9))
    part = 0.5 if mirrored else 1.0
    # 2/3 pi abc; quadratic cells are good to the fourth order of 11 degrees
    assert solid.weight.sum() == pytest.approx(part * 2 / 3 * np.pi * (np.prod(outer) - np.prod(inner)), rel=1e-3)
    fluid = FluidCavity(faces, len(mesh.nodes)).volume(mesh.nodes)
    assert fluid == pytest.approx(part * 2 / 3 * np.pi * np.prod(inner), rel=1e-3)
    np.testing.assert_allclose(np.linalg.norm(mesh.nodes[mesh.surface] / outer, axis=1), 1, atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(mesh.nodes[mesh.inner] / inner, axis=1), 1, atol=1e-12)
    np.testing.assert_array_equal(fixed.reshape(-1, 3)[:, 2], mesh.nodes[:, 2] > -1e-9)


def test_the_curved_volume_has_exact_derivatives():
    mesh, _, faces = half_ellipsoid_mesh(biotac_sp.OUTER, biotac_sp.OUTER / 2, (4, 4, 2))
    cavity = FluidCavity(faces, len(mesh.nodes))
    random = np.random.default_rng(0)
    at, way = mesh.nodes + 1e-4 * random.standard_normal(mesh.nodes.shape), random.standard_normal(mesh.nodes.shape)
    step = 1e-6  # m; a cubic's central difference is off by step^2 of 1e-2 m
    ahead, behind = at + step * way, at - step * way
    slope = (cavity.volume(ahead) - cavity.volume(behind)) / (2 * step)
    assert slope == pytest.approx(cavity.gradient(at) @ way.ravel(), rel=1e-6)
    rows, columns, blocks = cavity.hessian(at)
    turned = np.zeros_like(at)
    np.add.at(turned, rows, np.einsum("kij,kj->ki", blocks, way[columns]))
    numeric = (cavity.gradient(ahead) - cavity.gradient(behind)) / (2 * step)
    np.testing.assert_allclose(numeric, turned.ravel(), atol=1e-9 * np.abs(turned).max())  # quadratic: round-off


def test_radii_along_rays():
    axes = np.diag([1.0, 1.0, -1.0])
    np.testing.assert_allclose(biotac_sp.core_radius(5 * axes), biotac_sp.CORE)
    mesh, _, _ = half_ellipsoid_mesh(biotac_sp.OUTER, biotac_sp.OUTER / 2, (24, 16, 8))
    rays = np.random.default_rng(0).standard_normal((50, 3)) * [1, 1, 0.5] - [0, 0, 2]
    exact = 1 / np.linalg.norm(rays / np.linalg.norm(rays, axis=1, keepdims=True) / biotac_sp.OUTER, axis=1)
    # a cubic between nodes 0.9 mm apart on radii of 10 to 20 mm
    np.testing.assert_allclose(biotac_sp.radius_along(mesh.nodes[mesh.surface], rays), exact, atol=2e-6)
    assert np.isnan(biotac_sp.radius_along(mesh.nodes[mesh.surface], np.array([[0.0, 0.0, 1.0]]))).all()


@pytest.fixture(scope="module")
def upright():
    return SpPress(APEX, UP, COARSE)


def test_the_initial_pressure_makes_the_resting_shape_of_the_presses(upright):
    """Their note gives it as an ellipsoid of 13.84 x 9.74 x 10.11 mm about z = -0.242 mm."""
    assert upright.rest.fluid == pytest.approx(biotac_sp.INITIAL_PRESSURE, rel=1e-5)
    (rest,) = upright.steps(np.array([upright.clearance]))
    below = rest.skin[rest.skin[:, 2] < -2e-3]  # their rays end above
    from_centre = below - [0, 0, -0.242e-3]
    radius = np.linalg.norm(from_centre, axis=1)
    off = radius * (1 - 1 / np.linalg.norm(from_centre / [13.84e-3, 9.74e-3, 10.11e-3], axis=1))
    assert np.sqrt((off**2).mean()) < 40e-6  # 20 um of the fit, 12 of their ellipsoid, the rest of a coarse mesh


def test_the_published_volume_belongs_to_the_published_pressure():
    found = comsol.published_volume((16, 12, 6))
    assert found["ok"], found
    assert abs(found["baseline"]) > 5  # percent that the pressure swells


def test_the_plate_presses_as_the_stored_energy_grows(upright):
    advances = upright.clearance + np.linspace(0, 0.8e-3, 9)
    touch, energy, force = upright.rest, [upright.solid.energy(upright.rest.state)], [0.0]
    for advance in advances[1:]:
        touch = upright.contact.press(advance, touch)
        energy.append(upright.solid.energy(touch.state))
        force.append(float(touch.force @ UP))
    work = (np.convolve(force, [0.5, 0.5], "valid") * np.diff(advances)).sum()
    # the fluid keeps its volume, so all work goes into the skin; 1 %: trapezoid on eight steps, where nodes jump in
    assert energy[-1] - energy[0] == pytest.approx(work, rel=0.01)
    moved = upright.mesh.nodes + touch.state.displacement
    assert 2 * upright.cavity.volume(moved) == pytest.approx(upright.fluid_volume, rel=1e-8)  # Newton's tolerance


def test_half_of_the_skin_answers_as_the_whole(monkeypatch):
    half = SpPress(np.array([2e-3, 0, -10e-3]), LEANING, COARSE)
    monkeypatch.setattr("tactile_core.mechanics.finite_strain.sp_press.MIRROR_TOLERANCE", -1.0)
    whole = SpPress(np.array([2e-3, 0, -10e-3]), LEANING, COARSE)
    assert half.mirrored and not whole.mirrored
    advances = half.clearance + np.array([0.2e-3, 0.4e-3])
    for one, other in zip(half.steps(advances), whole.steps(advances), strict=True):
        assert one.force == pytest.approx(other.force, rel=1e-6)  # both balance to 1e-8
        assert one.volume == pytest.approx(other.volume, rel=1e-6)
        assert len(one.skin) == len(other.skin)


def test_a_press_of_comsol_on_a_coarse_mesh(outside_data):
    press = comsol.read(outside_data("biotac_comsol") / "004")
    rows = slice(0, 9)
    press = dataclasses.replace(
        press,
        advances=press.advances[rows],
        force=press.force[rows],
        electrodes=press.electrodes[rows],
        skin=press.skin[rows],
    )
    steps = SpPress(press.point, press.into, COARSE).steps(press.advances)
    found = {row["name"].removeprefix("comsol_004_"): row for row in comsol.compare(press, steps)}
    for name in ("gap_rms", "gap_most_squeezed_behind", "enclosed_volume", "fluid_volume_change"):
        assert found[name]["ok"], found[name]
        if found[name]["baseline"] is not None:
            assert found[name]["baseline"] > found[name]["value"]
    assert found["force_error"]["value"] < 10  # twice the target: nodes 1.8 mm apart under patches of 4 mm


def test_folders_of_another_layout_are_refused(tmp_path):
    with pytest.raises(TactileError, match="no folder with a config"):
        list(comsol.comsol(tmp_path))
    case = tmp_path / "009"
    case.mkdir()
    (case / "config.csv").write_text("Parameter,Value,Details,Expression\nitheta,ten,,\n", encoding="utf-8")
    with pytest.raises(TactileError, match="no number for"):
        comsol.read(case)
    keys = ("itheta", "iphi", "ix", "iy", "iz", "itx", "ity", "itz", "istep")
    text = "Parameter,Value\n" + "".join(f"{key},1\n" for key in keys)
    (case / "config.csv").write_text(text, encoding="utf-8")
    with pytest.raises(TactileError, match="forces_009"):
        comsol.read(case)
    for table in ("forces", *(f"{what}_{axis}" for what in ("sensor", "skin") for axis in "xyz")):
        (case / f"{table}_009.csv").write_text("1,2,3\n4,5,6\n", encoding="utf-8")
    with pytest.raises(TactileError, match="8 columns of forces"):
        comsol.read(case)
    (case / "skin_x_009.csv").write_text("1,2\n4,5\n", encoding="utf-8")
    with pytest.raises(TactileError, match="one shape"):
        comsol.read(case)
