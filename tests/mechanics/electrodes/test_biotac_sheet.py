"""The BioTac's fluid as a sheet: symmetric, anchored to published gaps, and right in sign where it is pressed."""

import numpy as np
import pytest

from tactile_core import sensors
from tactile_core.mechanics.electrodes.biotac_sheet import biotac_sheet, film_floor
from tactile_core.mechanics.fast.sensing_points import electrode_feet
from tactile_core.sensors import biotac

MIRROR = np.r_[10:16, 6, 8, 7, 9, 0:6, 16:19]  # E1..E6 and E11..E16, E8 and E9 are mirror images (docs/sources.md)


def dent(electrode: int, depth: float, width: float = 1.5e-3) -> np.ndarray:
    """Displacement (n_inner, 3) m of the inner skin toward one electrode, a bell ``width`` m wide."""
    feet = electrode_feet()
    place = sensors.electrodes()[electrode] + feet.gap[electrode] * feet.outward[electrode]
    rest = biotac.skin_surface("inner").rest
    away = np.linalg.norm(rest - place, axis=1)
    return -depth * np.exp(-((away / width) ** 2))[:, None] * feet.outward[electrode]


REST = np.zeros((len(biotac.skin_surface("inner").rest), 3))


def electrode_films(sheet) -> np.ndarray:
    """Mean thickness (19,) m of the film over each electrode at rest."""
    return sheet.sheet.mean_over_electrodes(sheet.films(REST))[:19]


def test_films_over_the_electrodes_are_the_published_gaps():
    films = electrode_films(biotac_sheet())
    # a film's mean over 0.6 mm against the thickness in its middle, where films differ by up to 0.3 mm a mm
    np.testing.assert_allclose(films, electrode_feet().gap, atol=20e-6)


def test_the_mesh_has_its_core_elsewhere():
    """Where the published electrodes are: 0.25 mm under the mesh's core in the trunk, 0.6 mm over it at the tip."""
    apart = electrode_feet().gap - electrode_films(biotac_sheet(core_of_mesh=True))
    tip = np.arange(6, 10)
    np.testing.assert_allclose(np.delete(apart, tip), 0.25e-3, atol=0.04e-3)
    assert (apart[tip] < -0.3e-3).all()


def test_a_symmetric_sensor_reads_symmetrically():
    sheet = biotac_sheet()
    rest = sheet.resistances(sheet.films(REST))
    np.testing.assert_allclose(rest, rest[MIRROR], rtol=1e-3)  # nearest points of the core, 0.09 mm apart
    left, right = (sheet.resistances(sheet.films(dent(electrode, 0.5e-3))) / rest for electrode in (1, 11))
    np.testing.assert_allclose(left, right[MIRROR], rtol=0.01)  # the dents' places differ by 0.02 mm


def test_half_the_film_doubles_every_resistance():
    sheet = biotac_sheet()
    assert sheet.film.min() > film_floor("biotac")
    far = np.maximum(sheet.film, 2.2 * film_floor("biotac"))  # so that no film meets the floor on the way
    start, halved = REST.copy(), REST.copy()
    start[sheet.wet] = sheet.outward * (far - sheet.film)[:, None]
    halved[sheet.wet] = sheet.outward * (far / 2 - sheet.film)[:, None]
    whole, half = (sheet.resistances(sheet.films(moved)) for moved in (start, halved))
    np.testing.assert_allclose(half, 2 * whole, rtol=1e-8)


@pytest.mark.parametrize("electrode", [1, 6, 17])
def test_a_dent_is_felt_where_it_is_and_little_elsewhere(electrode):
    sheet = biotac_sheet()
    rest = sheet.resistances(sheet.films(REST))
    shallow, deep = (sheet.resistances(sheet.films(dent(electrode, share * electrode_feet().gap[electrode]))) / rest - 1
                     for share in (0.3, 0.6))  # fmt: skip
    assert deep[electrode] > 2 * shallow[electrode] > 0  # more than linear
    assert deep[electrode] > 3 * np.delete(deep, electrode).max()


def test_a_skin_on_its_core_leaves_the_floor():
    films = biotac_sheet().films(dent(17, 3e-3))
    assert films.min() == film_floor("biotac")
    assert np.isfinite(biotac_sheet().resistances(biotac_sheet().films(dent(17, 3e-3)))).all()


def test_excitation_stands_on_both_sides_of_the_core():
    places = sensors.excitation_electrodes()
    np.testing.assert_allclose(places[:2] * [1, 1, -1], places[[3, 2]])
    apart = np.linalg.norm(places[:, None] - sensors.electrodes(), axis=2)
    assert apart.min() > 1.2e-3  # two electrodes of 0.6 mm radius: none overlap


def test_the_interface_hides_a_part_of_the_film():
    rest, growth = biotac_sheet().resistances(biotac_sheet().film), biotac_sheet().growth
    np.testing.assert_array_equal(growth(rest, rest), 1)
    assert (growth(2 * rest, rest) < 2).all() and (growth(2 * rest, rest) > 1.3).all()
    assert (growth(0 * rest, rest) > 0).all()
