"""Electrodes in another unit of measurement than the others are found."""

import numpy as np
import pytest

from tactile_core.recordings import prepare, read
from tactile_core.recordings.flags import Flag


@pytest.mark.parametrize("factor", [0.1, 1 / 4, 1 / 16, 3.3 / 4095, 1 / 4095])
def test_an_electrode_in_another_unit_of_measurement_is_named_and_flagged(factor, press, tmp_path):
    press.electrodes[:, 6] *= factor
    np.savez(tmp_path / "touch.npz", electrodes=press.electrodes, time=press.time)
    found = prepare(read(tmp_path / "touch.npz"))
    assert found.warnings[0].startswith("E7 at ") and "another unit of measurement" in found.warnings[0]
    assert (found.flags & Flag.OUT_OF_RANGE).all()
