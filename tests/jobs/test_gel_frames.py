"""The deformation of one frame: found by its number in both kinds of file, refused in words where it is not there."""

import h5py
import numpy as np
import pytest

from tactile_core import sensors
from tactile_core.errors import TactileError
from tactile_core.jobs import frames_file
from tactile_core.jobs.gel_frames import frame_displacement, read_frames
from tactile_core.recordings import Truth, write_simulated

NODES = {"biotac": len(sensors.biotac_surface().rest), "digit": len(sensors.digit_surface().rest)}


def moved(sensor, frames):
    """A different even shift in each frame, in whole steps of a simulated recording's resolution."""
    return (np.arange(1, frames + 1)[:, None, None] * np.full((NODES[sensor], 3), 1e-5)).astype(np.float32)


@pytest.fixture
def converted(tmp_path):
    path = tmp_path / "frames.h5"
    with frames_file.FramesFile(path, 3, ("displacement",), {}) as file:
        file.write(0, {"frame": np.array([4, 6, 8]), **{f"displacement_{s}": moved(s, 3) for s in NODES}})
    return path


@pytest.fixture
def simulated(tmp_path):
    path, still = tmp_path / "simulated.h5", np.zeros(3, np.int16)
    truth = Truth(moved("biotac", 3), moved("digit", 3), np.zeros((3, 3)), np.zeros((3, 2)))
    write_simulated(
        path, time=np.arange(3) / 100, electrodes=np.zeros((3, 19)), pdc=still, tac=still, tdc=still, truth=truth,
        scene="", seed=0, made_by="test", note="",
    )  # fmt: skip
    return path


@pytest.mark.parametrize("sensor", NODES)
def test_a_frame_is_found_by_its_number(sensor, converted, simulated):
    np.testing.assert_allclose(frame_displacement(converted, sensor, 6), 2e-5, rtol=1e-6)  # float32
    np.testing.assert_allclose(frame_displacement(simulated, sensor, 2), 3e-5, rtol=1e-6)


@pytest.mark.parametrize("frame", [5, -1, 9])
def test_a_frame_that_is_not_there_is_refused(frame, converted):
    with pytest.raises(TactileError, match="4 to 8"):
        frame_displacement(converted, "digit", frame)


def test_other_files_are_refused(converted, tmp_path):
    with h5py.File(tmp_path / "other.h5", "w") as file:
        file.attrs["format"] = "something"
    with pytest.raises(TactileError, match="'something'"):
        frame_displacement(tmp_path / "other.h5", "digit", 0)
    with pytest.raises(TactileError, match="no such file"):
        frame_displacement(tmp_path / "absent.h5", "digit", 0)
    (tmp_path / "noise.h5").write_bytes(b"noise")
    with pytest.raises(TactileError, match="no HDF5 file"):
        frame_displacement(tmp_path / "noise.h5", "digit", 0)


def test_a_deformation_that_was_not_kept_or_is_of_another_surface_is_refused(converted):
    with h5py.File(converted, "a") as file:
        del file["displacement_digit"], file["displacement_biotac"]
        file["displacement_biotac"] = np.zeros((3, 17, 3), np.float32)
    with pytest.raises(TactileError, match="--keep displacement"):
        frame_displacement(converted, "digit", 4)
    with pytest.raises(TactileError, match="another version of the surface"):
        frame_displacement(converted, "biotac", 4)


@pytest.mark.parametrize("numbers", [[4, 4, 4], [-1, 0, 1], [0.5, 1.5, 2.5], [0, np.nan, 2], [3, 2, 1], [0, 1, 2**40]])
def test_odd_frame_numbers_are_refused(numbers, converted):
    with h5py.File(converted, "r+") as file:
        del file["frame"]
        file["frame"] = np.array(numbers)
    for read in (lambda: frame_displacement(converted, "digit", 4), lambda: read_frames(converted)):
        with pytest.raises(TactileError, match="frame: frame numbers"):
            read()


def test_a_gel_that_was_not_kept_is_asked_for(simulated):
    with pytest.raises(TactileError, match=r"displacement_gelsight_mini: missing.*--keep displacement_gelsight_mini"):
        read_frames(simulated, gel="gelsight_mini")
