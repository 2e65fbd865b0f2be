"""Smoothing: a mean round each frame, no delay, nothing lost at the ends, asked for and said."""

from __future__ import annotations

import numpy as np
import pytest

from tactile_core.errors import TactileError
from tactile_core.recordings import PrepareOptions, prepare, read
from tactile_core.recordings.repair import smooth


def test_a_mean_round_each_frame():
    values = np.array([[0.0], [3.0], [6.0], [0.0]])
    np.testing.assert_allclose(smooth(values, 3), [[1.5], [3.0], [3.0], [3.0]])
    assert smooth(values, 1) is values
    np.testing.assert_allclose(smooth(values, 101), np.full((4, 1), 2.25))


def test_what_changes_evenly_stays_and_noise_falls_by_its_root():
    line = np.arange(1000.0)[:, None] * [1.0, -2.0]
    np.testing.assert_allclose(smooth(line, 5)[2:-2], line[2:-2])
    noise = np.random.default_rng(0).standard_normal((100_000, 1))
    assert smooth(noise, 9).std() == pytest.approx(1 / 3, rel=0.02)  # 100,000 draws, nine of them together


def test_rectified_recordings_are_smoothed_others_when_told(slide_csv):
    recording = read(slide_csv())
    plain, said = prepare(recording), prepare(recording, PrepareOptions(smooth=5))
    assert plain.report["smoothed_frames"] == 1 and said.report["smoothed_frames"] == 5
    np.testing.assert_allclose(said.change, smooth(plain.change, 5))
    np.testing.assert_array_equal(said.electrodes, plain.electrodes)
    folded = prepare(recording, PrepareOptions(kind="rectified", tare="none"))
    assert folded.report["smoothed_frames"] == 3


@pytest.mark.parametrize("frames", [0, 2, -3, 103])
def test_impossible_windows_are_refused(slide_csv, frames):
    with pytest.raises(TactileError, match=r"option smooth.*an odd number from 1 to 101"):
        prepare(read(slide_csv()), PrepareOptions(smooth=frames))
