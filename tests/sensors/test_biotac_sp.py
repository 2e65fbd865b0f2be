"""The BioTac SP by its descriptor: stated ellipsoids in the shared frame, and electrodes that the user fetches."""

import numpy as np
import pytest
from benchmarks.make import make_biotac_sp_profile

from tactile_core import sensors
from tactile_core.errors import TactileError
from tactile_core.mechanics.fast.sensing_points import electrode_feet
from tactile_core.mechanics.solids.biotac_core import Core
from tactile_core.mechanics.solids.hex_mesh import skin_mesh
from tactile_core.sensors import descriptor, unrolling
from tactile_core.sensors.electrodes import SP_COLUMNS, places_of

NAME = "biotac_sp"
HEADER = ",".join(SP_COLUMNS)
SENSING = ["1,1,0,-7,,,,,,", "2,2,3,-6,,,,flat,,", *(f"{number},1,0,-6,,,,,," for number in range(3, 25))]
ROWS = [*SENSING, "-2,3,-4,-5,,,,excitation,,", "-1,4,4,-5,,,,excitation,,"]


def in_their_frame(points):
    """Points of the shared frame, m, in the COMSOL model's."""
    x, y, z = (points - sensors.from_maker(np.zeros((1, 3)), NAME)).T
    return np.column_stack([-x, z, y])


def test_the_skin_lies_on_the_stated_ellipsoid():
    skin = sensors.skin_of(NAME)
    for layer, axes in (
        ("outer", make_biotac_sp_profile.RESTING),
        ("inner", make_biotac_sp_profile.RESTING - skin.thickness),
    ):
        points = in_their_frame(skin.skin_surface(layer).rest) - [0, 0, make_biotac_sp_profile.RESTING_CENTRE]
        radius = np.linalg.norm(points / axes, axis=1)[points[:, 2] < 1e-9]
        assert len(radius) > 2000
        np.testing.assert_allclose(radius, 1, atol=3e-3)  # polylines 1 mm long at the ends: 20 um inside
    lowest = skin.skin_surface("outer").rest[:, 1].min()
    assert lowest == pytest.approx(sensors.biotac_surface().rest[:, 1].min(), abs=10e-6)


def test_the_core_is_the_stated_one_and_the_back_is_held():
    mesh, skin = skin_mesh(NAME), sensors.skin_of(NAME)
    inner = mesh.nodes[mesh.inner]
    back = inner[:, 1] > skin.axis_y - 1e-6
    np.testing.assert_array_equal(mesh.clamped[mesh.inner][back], True)
    ends = np.abs(inner[:, 0] + 8e-3) > 12.58e-3  # the poles
    assert not mesh.clamped[mesh.inner][~back & ~ends].any()
    pad = inner[~back & (np.abs(inner[:, 0] + 8e-3) < 9e-3) & (np.abs(inner[:, 2]) < 5e-3)]
    foot = pad - Core(NAME).distance(pad)[0][:, None] * Core(NAME).distance(pad)[1]
    away = np.linalg.norm(in_their_frame(foot) / make_biotac_sp_profile.CORE, axis=1) - 1
    assert np.abs(away).max() * 8e-3 < 0.12e-3  # the gap is exact to first order in itself, up to 1 mm


def test_the_table_of_radii_is_what_its_script_makes():
    found = descriptor.describe(NAME)
    assert (found.folder / found.skin.profile).read_text(encoding="utf-8") == make_biotac_sp_profile.table()


def test_it_is_even_across_and_rolls_onto_the_gel():
    rest = sensors.sensor_surface(NAME).rest
    nearest = np.linalg.norm(rest[:, None, :2] - rest[None, ::40, :2], axis=2) + np.abs(
        rest[:, None, 2] + rest[None, ::40, 2]
    )
    assert nearest.min(axis=0).max() < 1e-9
    for point in ([-8e-3, 0.0], [-14e-3, 4e-3], [-1e-3, -6e-3]):
        place, outward = unrolling.roll_up(np.array(point), NAME)
        nodes = unrolling.unrolled_nodes(NAME)
        near = np.nanargmin(np.linalg.norm(nodes - point, axis=1))
        assert np.linalg.norm(rest[near] - place) < 0.8e-3 and outward[1] < 0


@pytest.fixture
def own(tmp_path, monkeypatch):
    """A folder of one's own sensors, in which the table of electrodes may lie."""
    (tmp_path / NAME).mkdir()
    monkeypatch.setenv(descriptor.OWN, str(tmp_path))
    places_of.cache_clear()
    yield tmp_path / NAME / "locations.csv"
    places_of.cache_clear()


def test_electrodes_are_read_from_the_table_that_the_user_puts_there(own):
    own.write_text("\n".join([HEADER, *ROWS]))
    places = 1e3 * in_their_frame(sensors.electrodes(NAME))
    assert len(places) == sensors.electrode_count(NAME)
    np.testing.assert_allclose(places[:2], [[1, 0, -7], [2, 3, -6]], atol=1e-12)
    np.testing.assert_allclose(
        1e3 * in_their_frame(sensors.excitation_electrodes(NAME)), [[4, 4, -5], [3, -4, -5]], atol=1e-12
    )
    assert np.isnan(sensors.places_of(NAME).rest_counts).all()


def test_a_table_that_is_missing_or_bad_is_said_in_words(own):
    with pytest.raises(TactileError, match=r"locations\.csv.*github\.com/bsadr/biotac.*TACTILE_SENSORS"):
        sensors.electrodes(NAME)
    for rows, words in (
        (ROWS[1:], "numbers that leave some out"),
        ([*ROWS, "25,a,0,0,,,,,,"], "row 28: 25,a,0"),
        ([*ROWS, "25,nan,0,0,,,,,,"], "a place that is no number"),
        (SENSING, "numbers that leave some out"),
        ([*ROWS, "25,1,0,-6,,,,,,"], "25 electrodes that are read; expected the 24"),
    ):
        own.write_text("\n".join([HEADER, *rows]))
        with pytest.raises(TactileError, match=words):
            sensors.electrodes(NAME)
    own.write_text("\n".join([HEADER, "1,20,0,0,,,,,,", *ROWS[1:]]))
    with pytest.raises(TactileError, match="outside the body"):
        sensors.electrodes(NAME)


def test_the_public_places_lie_in_the_fluid(outside_data, own):
    own.write_bytes((outside_data("biotac_sp") / "locations.csv").read_bytes())
    assert len(sensors.electrodes(NAME)) == 24 and len(sensors.excitation_electrodes(NAME)) == 4
    gaps = electrode_feet.__wrapped__(NAME).gap  # what another table left in its cache is none of ours
    assert gaps.min() > 0.4e-3 and gaps.max() < 1.5e-3  # as a BioTac's, 0.51 to 1.76
