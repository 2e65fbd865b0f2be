"""The gap law's signals follow the films they come from."""

import numpy as np

from tactile_core import sensors
from tactile_core.mechanics.electrodes.biotac_sheet import film_floor, signal_of_gaps
from tactile_core.mechanics.fast.sensing_points import electrode_feet


def test_rest_gaps_lie_in_the_published_range():
    gap = electrode_feet().gap
    assert len(gap) == 19
    # 0.51 to 1.76 mm from the public mesh (docs/sources.md); ours from its profile table, 0.05 mm rms apart
    assert 0.46e-3 < gap.min() < 0.56e-3 and 1.71e-3 < gap.max() < 1.81e-3


def test_no_change_without_deformation_and_growth_with_thinning():
    rest = electrode_feet().gap
    np.testing.assert_array_equal(signal_of_gaps(rest), 0)
    steps = np.stack([signal_of_gaps(rest * share) for share in (1.2, 1.0, 0.8, 0.5, 0.1)])
    assert (np.diff(steps * sensors.COUNT_SIGN, axis=0) > 0).all()


def test_films_thinner_than_the_floor_do_not_blow_up():
    rest = electrode_feet().gap
    np.testing.assert_array_equal(signal_of_gaps(np.full(19, -1e-3)), signal_of_gaps(np.full(19, film_floor("biotac"))))
    assert np.isfinite(signal_of_gaps(rest * 0)).all()
