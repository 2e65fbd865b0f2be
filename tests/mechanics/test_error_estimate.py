"""The table of the tiers that ships, and what is read from it."""

import itertools

import numpy as np
import pytest

from tactile_core.geometry.indenters import Edge, Sphere
from tactile_core.mechanics.error_estimate import REFERENCE_SHARE, expected_error, measured
from tactile_core.mechanics.placement import DEPTH_LIMIT, Placement
from tactile_core.mechanics.solve import TIERS, solve

SENSORS = "digit", "biotac"
MIDDLE = Placement(-8.2e-3, 1.13e-3)


@pytest.mark.parametrize("sensor", SENSORS)
@pytest.mark.parametrize("tier", TIERS)
def test_the_table_knows_every_tier_at_every_depth(tier, sensor):
    entry = measured()["tiers"][tier][sensor]
    ends = [each["depth_share_to"] for each in entry["bins"]]
    assert entry["ms"] > 0 and ends == sorted(ends) and ends[-1] == DEPTH_LIMIT
    for each in entry["bins"]:
        assert each["contacts"] > 0 and 0 < each["shape_um"] <= each["shape_95_um"] < each["baseline_um"]
        assert 0 < each["force"] <= each["force_95"]


@pytest.mark.parametrize("sensor", SENSORS)
def test_a_slower_tier_costs_more_and_errs_less(sensor):
    for quick, slow in itertools.pairwise(TIERS):
        assert measured()["tiers"][quick][sensor]["ms"] < measured()["tiers"][slow][sensor]["ms"]
        for share in (0.1, 0.5):
            assert expected_error(slow, sensor, share)[0] < expected_error(quick, sensor, share)[0]


def test_errors_are_those_of_the_bin_and_of_the_deepest_one_beyond():
    bins = measured()["tiers"]["full"]["digit"]["bins"]
    assert expected_error("full", "digit", 0.0) == (0.0, 0.0)
    for share, row in ((1e-3, bins[0]), (bins[0]["depth_share_to"], bins[0]), (DEPTH_LIMIT, bins[-1]), (0.9, bins[-1])):
        assert expected_error("full", "digit", share) == (1e-6 * row["shape_95_um"], row["force_95"])
    shape, force = expected_error("reference", "digit", 0.1)
    assert shape == pytest.approx(REFERENCE_SHARE * 1e-6 * bins[0]["shape_95_um"], rel=1e-3)  # written in four digits
    assert force == pytest.approx(REFERENCE_SHARE * bins[0]["force_95"], rel=1e-3)


def test_a_wedge_that_leans_on_one_face_says_that_the_skin_may_lie_aside():
    """73 um : rms off the full tier; the skin lies 62 um aside of it as a whole."""
    found = solve("biotac", Edge(np.radians(60), 0.4e-3), MIDDLE, depth=0.3e-3, friction=0.0)
    assert 73e-6 < found.shape_error < 110e-6


@pytest.mark.parametrize("sensor", ["digit", "biotac"])
def test_a_blunt_indenter_states_the_error_of_its_depth(sensor):
    found = solve(sensor, Sphere(2e-3), Placement(-8.2e-3, 1.13e-3, 0.3), depth=0.3e-3, friction=0.0)
    assert found.shape_error == expected_error("fast", sensor, found.depth / found.thickness)[0]
