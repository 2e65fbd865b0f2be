"""A whole recording in one call: the same as the command's result, whatever part of it is requested."""

from __future__ import annotations

import h5py
import numpy as np
import pytest

from tactile_core.errors import TactileError
from tactile_core.jobs.convert import Options, ToolOptions, convert, load_tools
from tactile_core.recordings import electrode_gains, read
from tactile_core.recordings.electrode_gains import FORMAT, ElectrodeGains, SensorFile
from tactile_core.translation.answer import Answer
from tactile_core.translation.translate import translate

NAMES = ("displacement_biotac", "displacement_digit", "force", "pressure", "contact_center", "confidence")


@pytest.fixture(scope="module")
def recording():
    return read("scenes/press_roll_slide/press_roll_slide.h5")


@pytest.fixture(scope="module")
def whole(recording):
    return translate(recording)


def test_the_arrays_are_those_of_the_command(recording, whole, tmp_path):
    convert(recording.path, tmp_path / "out", Options(keep=("displacement",)), load_tools(ToolOptions()))
    with h5py.File(tmp_path / "out" / "frames.h5") as file:
        for name in NAMES:
            np.testing.assert_array_equal(getattr(whole, name), file[name][:], err_msg=name)


def test_gains_of_the_unit_are_taken_off(recording, whole, tmp_path):
    gains = ElectrodeGains(note="a unit twice as sensitive", gain=[2.0] * 19, offset_counts=[0.0] * 19)
    electrode_gains.write(tmp_path / "unit.toml", SensorFile(FORMAT, unit=gains))
    halved = translate(recording, sensor=tmp_path / "unit.toml")
    touched = np.isfinite(whole.contact_center[:, 0])
    assert np.median(halved.force[touched, 1] / whole.force[touched, 1]) < 0.8


def test_a_shift_on_the_gel_moves_the_contact(recording, whole):
    moved = translate(recording, answer=Answer(mount_shift_mm=(2.0, 0.0)))
    both = np.isfinite(whole.contact_center[:, 0]) & np.isfinite(moved.contact_center[:, 0])
    shift = np.median(moved.contact_center[both] - whole.contact_center[both], axis=0)
    np.testing.assert_allclose(shift, (2e-3, 0), atol=2e-4)  # m; the dent's centre is that of a sampled field


@pytest.mark.parametrize("frames", [slice(5, 5), slice(10, 2), slice(10, 2, -1)])
def test_frames_without_order_or_content_are_refused(recording, frames):
    with pytest.raises(TactileError, match="translate, frames"):
        translate(recording, frames=frames)
