"""A conducting sheet against potentials that are known exactly."""

import numpy as np
import pytest

from tactile_core.geometry.lattice import cap_faces, grid_faces
from tactile_core.mechanics.electrodes.thin_sheet import ThinSheet, resistances

RADIUS, AWAY, ELECTRODE, FILM = 5e-3, 2e-3, 0.5e-3, 1e-3  # m: disc, electrodes from its middle, electrode, film
CENTERS = np.array([[AWAY, 0, 0], [-AWAY, 0, 0]])


def disc(rows: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and faces of a flat disc with ``rows`` rings."""
    columns = 2 * rows + 4
    radius, angle = np.linspace(0, RADIUS, rows + 1)[1:, None], np.arange(columns) * 2 * np.pi / columns
    ring = np.stack([radius * np.cos(angle), radius * np.sin(angle), 0 * radius * angle], -1).reshape(-1, 3)
    faces = np.concatenate([grid_faces(rows, columns, closed=True), cap_faces(len(ring), np.arange(columns))])
    return np.vstack([ring, np.zeros(3)]), faces


def strip(columns: int = 121) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and faces of a flat strip, 12 mm along x and 1 mm wide."""
    x, y = np.meshgrid(np.linspace(0, 12e-3, columns), np.linspace(0, 1e-3, 6), indexing="ij")
    return np.stack([x, y, 0 * x], -1).reshape(-1, 3), grid_faces(columns, 6, closed=False)


def between(nodes, faces, film, centers=CENTERS, radius=ELECTRODE, refine=0):
    sheet = ThinSheet(nodes, faces, centers, radius, refine)
    return float(resistances(sheet.potentials(film), 1)[0])


def exact_on_disc() -> float:
    """Ohm at 1 S/m between two electrodes on an insulated disc, by image currents; means over a disc are exact."""
    images = (RADIUS**2 + AWAY**2) / (RADIUS**2 - AWAY**2)
    return (np.log(2 * AWAY / ELECTRODE) + 0.25 + np.log(images)) / (np.pi * FILM)


def test_two_electrodes_on_a_disc_come_to_the_exact_resistance_with_the_second_order():
    errors = []
    for rows in (10, 20, 40):
        nodes, faces = disc(rows)
        errors.append(between(nodes, faces, np.full(len(nodes), FILM)) / exact_on_disc() - 1)
    assert abs(errors[2]) < 0.01  # and still falling to a quarter with each halving
    observed = np.log2(np.abs(errors[:-1]) / np.abs(errors[1:]))
    assert (observed > 1.7).all()  # 2 but for the sampled rim of the electrodes


def test_a_finer_grid_conducts_better_never_worse():
    """Resistance from below: the finite elements' energy has its minimum over more functions on a finer grid."""
    nodes, faces = disc(10)
    film = FILM * (1 + 0.5 * np.cos(300 * nodes[:, 0]))
    found = [between(nodes, faces, film, refine=refine) for refine in (0, 1, 2, 3)]
    assert (np.diff(found) > 0).all()
    steps = np.diff(found)
    assert (steps[:-1] / steps[1:] > 2.8).all()  # order 1.5 at least


def test_resistance_goes_with_one_over_thickness_and_conductivity():
    nodes, faces = disc(10)
    sheet = ThinSheet(nodes, faces, CENTERS, ELECTRODE)
    film = FILM * (1 + 0.3 * np.sin(500 * nodes[:, 1]))
    one = resistances(sheet.potentials(film), 1)
    np.testing.assert_allclose(resistances(sheet.potentials(film / 7), 1), 7 * one, rtol=1e-10)  # rounding
    np.testing.assert_allclose(resistances(sheet.potentials(film, 0.2), 1), 5 * one, rtol=1e-10)


def test_a_thin_place_in_a_strip_adds_its_own_ohms():
    """Between far electrodes the current is even across, so that the excess is the integral of 1/h over the width."""
    nodes, faces = strip()
    ends = np.array([[1e-3, 0.5e-3, 0], [11e-3, 0.5e-3, 0]])
    x = nodes[:, 0]
    film = FILM * (1 - 0.8 * np.exp(-(((x - 6e-3) / 1e-3) ** 2)))
    excess = between(nodes, faces, film, ends, 0.3e-3) - between(nodes, faces, np.full(len(x), FILM), ends, 0.3e-3)
    fine = np.linspace(0, 12e-3, 12001)
    thin = 1 / (FILM * (1 - 0.8 * np.exp(-(((fine - 6e-3) / 1e-3) ** 2)))) - 1 / FILM
    np.testing.assert_allclose(excess, thin.mean() * 12, rtol=0.01)  # 12 squares; film linear over cells of 0.1 mm


def test_current_is_balanced_and_electrodes_are_reciprocal():
    nodes, faces = disc(12)
    random = np.random.default_rng(0)
    centers = np.column_stack([random.uniform(-3e-3, 3e-3, (5, 2)), np.zeros(5)])
    sheet = ThinSheet(nodes, faces, centers, ELECTRODE)
    film = FILM * random.uniform(0.05, 2, len(nodes))
    potentials = sheet.potentials(film)
    np.testing.assert_allclose(potentials, potentials.T, rtol=1e-10)
    np.testing.assert_allclose(sheet.patches.sum(0), 1, rtol=1e-12)
    matrix = sheet.matrix(film)
    np.testing.assert_allclose(matrix @ np.ones(len(nodes)), 0, atol=1e-12 * np.abs(matrix).max())
    assert np.linalg.eigvalsh(potentials).min() > 0  # a sheet turns current into heat


def test_joined_electrodes_share_the_current_of_one():
    """Two electrodes at mirrored places, joined, take half each: the resistance is the mean of alone and across."""
    nodes, faces = disc(16)
    centers = np.array([[0, 0, 0], *CENTERS])
    sheet = ThinSheet(nodes, faces, centers, ELECTRODE)
    p = sheet.potentials(np.full(len(nodes), FILM))
    half = p[0, 0] - p[0, 1] - p[0, 2] + (p[1, 1] + p[2, 2] + 2 * p[1, 2]) / 4
    np.testing.assert_allclose(resistances(p, 1)[0], half, rtol=1e-9)


def test_what_the_grid_misses_is_the_miss_of_a_film_of_any_thickness():
    nodes, faces = disc(10)
    coarse, fine = ThinSheet(nodes, faces, CENTERS, ELECTRODE), ThinSheet(nodes, faces, CENTERS, ELECTRODE, 2)
    missed = coarse.unresolved(2)
    film = FILM * (1 + 0.2 * nodes[:, 0] / RADIUS)
    added = np.diag(missed / coarse.mean_over_electrodes(film))
    corrected = resistances(coarse.potentials(film) + added, 1)[0]
    exact = resistances(fine.potentials(film), 1)[0]
    assert abs(corrected / exact - 1) < 0.1 * abs(resistances(coarse.potentials(film), 1)[0] / exact - 1)


@pytest.mark.parametrize("thin", [0.0, -1e-6, np.nan])
def test_a_film_without_thickness_is_refused(thin):
    nodes, faces = disc(10)
    film = np.full(len(nodes), FILM)
    film[7] = thin
    with pytest.raises(ValueError, match="does not conduct"):
        ThinSheet(nodes, faces, CENTERS, ELECTRODE).potentials(film)


def test_an_electrode_beside_the_sheet_is_refused():
    nodes, faces = disc(10)
    with pytest.raises(ValueError, match="does not lie on the sheet"):
        ThinSheet(nodes, faces, CENTERS + 20e-3, ELECTRODE)
