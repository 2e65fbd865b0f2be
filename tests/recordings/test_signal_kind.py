"""Counting long columns of whole numbers says what sorting them does."""

import numpy as np
import pytest

from tactile_core.recordings import prepare, read
from tactile_core.recordings.flags import Flag
from tactile_core.recordings.rest_level import level
from tactile_core.recordings.signal_kind import WHOLE, counted, detect, median, percentiles

SHARES = [0, 0.5, 1, 50, 95, 99.5, 100]


@pytest.fixture
def columns():
    return np.rint(np.random.default_rng(1).normal([3000, 0, -20], 40, (2**16 + 1, 3)))


def test_counted_columns_have_the_percentiles_and_levels_of_sorted_ones(columns):
    counts = counted(columns)
    for column, each in zip(columns.T, counts, strict=True):
        np.testing.assert_allclose(percentiles(each, SHARES), np.percentile(column, SHARES), rtol=1e-12)
        assert median(column) == np.median(column)
    middle = np.sort(columns, axis=0)[len(columns) // 4 : len(columns) - len(columns) // 4]
    np.testing.assert_array_equal(level(columns), middle.mean(axis=0))


def test_a_long_recording_has_the_kind_of_a_part_of_it(columns):
    changes = columns - [3000, 0, -20]
    for values in (columns, changes, np.abs(changes), columns[:, :1] / 4095):
        assert detect(values)[0] == detect(values[:5000])[0]


@pytest.mark.parametrize("odd", [0.5, float(WHOLE[-1] + 1), float(WHOLE[0] - 1)])
def test_other_numbers_are_not_counted(columns, odd):
    columns[77, 1] = odd
    assert counted(columns) is None and counted(columns[:100]) is None


@pytest.mark.parametrize("factor", [0.1, 1 / 4, 1 / 16, 3.3 / 4095, 1 / 4095])
def test_an_electrode_in_another_unit_of_measurement_is_named_and_flagged(factor, press, tmp_path):
    press.electrodes[:, 6] *= factor
    np.savez(tmp_path / "touch.npz", electrodes=press.electrodes, time=press.time)
    found = prepare(read(tmp_path / "touch.npz"))
    assert found.warnings[0].startswith("E7 at ") and "another unit of measurement" in found.warnings[0]
    assert (found.flags & Flag.OUT_OF_RANGE).all()
