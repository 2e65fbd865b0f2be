"""A whole recording in one call: the same as the command's result, whatever part of it is requested."""

import json
import shutil

import h5py
import numpy as np
import pytest

from tactile_core.errors import TactileError
from tactile_core.jobs.convert import Options, ToolOptions, convert, load_tools
from tactile_core.recordings import PrepareOptions, electrode_gains
from tactile_core.recordings.electrode_gains import FORMAT, ElectrodeGains, SensorFile
from tactile_core.translation import networks
from tactile_core.translation.answer import Answer
from tactile_core.translation.translate import translate

NAMES = ("displacement_biotac", "displacement_digit", "force", "pressure", "contact_center", "confidence")


@pytest.fixture(scope="module")
def whole(shipped):
    return translate(shipped)


def test_the_arrays_are_those_of_the_command(shipped, whole, tmp_path, no_sheet):
    convert(shipped.path, tmp_path / "out", Options(keep=("displacement",)), load_tools(ToolOptions()))
    with h5py.File(tmp_path / "out" / "frames.h5") as file:
        for name in NAMES:
            np.testing.assert_array_equal(getattr(whole, name), file[name][:], err_msg=name)


def test_gains_of_the_unit_are_taken_off(shipped, whole, tmp_path):
    gains = ElectrodeGains(note="a unit twice as sensitive", gain=[2.0] * 19, offset_counts=[0.0] * 19)
    electrode_gains.write(tmp_path / "unit.toml", SensorFile(FORMAT, unit=gains))
    halved = translate(shipped, sensor=tmp_path / "unit.toml")
    touched = np.isfinite(whole.contact_center[:, 0])
    assert np.median(halved.force[touched, 1] / whole.force[touched, 1]) < 0.8


@pytest.mark.parametrize(
    "frames", [slice(5, 5), slice(10, 2), slice(10, 2, -1), 5, (1, 2), slice(0.0, 5.0), [7, 9, 8, 10], [7, 7]]
)
def test_frames_without_order_or_content_are_refused(shipped, frames):
    with pytest.raises(TactileError, match="translate, frames"):
        translate(shipped, frames=frames)


@pytest.mark.parametrize("given", ["touch.csv", np.zeros((50, 19))])
def test_what_is_no_recording_is_refused_with_the_way_to_read_one(given):
    with pytest.raises(TactileError, match=r"a (str|ndarray); expected a Recording. tactile.read reads a file"):
        translate(given)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"prepare": {"smooth": 3}}, "translate, prepare: a dict; expected a PrepareOptions"),
        ({"answer": "mean"}, "translate, answer: a str"),
        ({"answer": Answer(samples=8)}, "translate, answer: 8 samples"),
        ({"prepare": PrepareOptions(tare=(0, 20))}, r"option tare: \(0, 20\); expected frames A:B"),
        ({"prepare": PrepareOptions(smooth="3")}, "option smooth: '3' frames; expected an odd number"),
        ({"prepare": PrepareOptions(counts_per_unit="1")}, "option counts_per_unit: '1'; expected counts a unit"),
    ],
)
def test_options_of_another_kind_are_refused(given, said, shipped):
    with pytest.raises(TactileError, match=said):
        translate(shipped, frames=slice(0, 3), **given)


@pytest.mark.parametrize(
    "given", [{"kind": "average"}, {"mount_shift_mm": 4.0}, {"mount_shift_mm": (4.0, 0.0, 0.0)}, {"samples": 2.5}]
)
def test_answers_that_there_are_not_are_refused(given):
    with pytest.raises(TactileError, match=f"Answer, {next(iter(given))}: "):
        Answer(**given)


def test_weights_that_replace_others_in_their_folder_are_the_ones_that_translate(shipped, tmp_path):
    folder = tmp_path / "weights"
    shutil.copytree(networks.WEIGHTS_FOLDER, folder)
    before = translate(shipped, frames=slice(100, 101), weights=folder)
    card = json.loads((folder / "card.json").read_text(encoding="utf-8"))  # as by training anew into the same folder
    for values in card["error_bounds"].values():
        values["digit"][0] *= 2
    (folder / "card.json").write_text(json.dumps(card), encoding="utf-8")
    after = translate(shipped, frames=slice(100, 101), weights=folder)
    np.testing.assert_allclose(after.error_bound_digit, 2 * before.error_bound_digit, rtol=1e-6)
