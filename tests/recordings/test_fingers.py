"""Files of several fingers: one recording a finger, MATLAB files read without running anything, odd ones refused."""

from pathlib import Path

import numpy as np
import pytest

from tactile_core import recordings
from tactile_core.cli.main import main
from tactile_core.errors import TactileError
from tactile_core.jobs import convert
from tactile_core.recordings import array_store, assemble
from tactile_core.recordings.readers import each_finger
from tactile_core.recordings.recording import name_of

pytestmark = pytest.mark.usefixtures("no_sheet")

savemat = pytest.importorskip("scipy.io", reason="scipy is absent: pip install tactile-core[matlab]").savemat


@pytest.fixture
def hand(tmp_path, press):
    """hand(F2Electrodes=...) -> a file of two fingers, the second pressed half as hard, with these arrays beside."""

    def write(**more):
        half = np.rint(press.rest + 0.5 * (press.electrodes - press.rest))
        arrays = {"F0Electrodes": press.electrodes.T, "F0pdc": press.pdc[None], "F1Electrodes": half.T, **more}
        path = tmp_path / "hand.mat"
        savemat(path, {name: value for name, value in arrays.items() if value is not None})
        return str(path)

    return write


def test_each_finger_is_a_recording_of_its_own(hand, press):
    path = hand()
    assert each_finger(path) == [f"{path}#0", f"{path}#1"]
    first, second = (recordings.read(one) for one in each_finger(path))
    np.testing.assert_array_equal(first.electrodes, press.electrodes)
    assert (first.name, second.name) == ("hand_finger0", "hand_finger1") and second.pdc is None
    assert (first.section, second.section) == ("finger0", "finger1")  # of a file of `tactile adapt`
    assert name_of(f"{path}#1") == "hand_finger1" and name_of(path) == "hand"
    assert recordings.read(path).warnings[0] == "finger 0 is read; others: 1 (ask for one as hand.mat#1)"


def test_a_file_of_one_finger_keeps_its_name(hand):
    path = hand(F1Electrodes=None)
    assert each_finger(path) == [path] and recordings.read(path).name == "hand"
    path = hand(F0Electrodes=None, F0pdc=None)  # of a hand whose other finger is missing
    assert each_finger(path) == [f"{path}#1"]


def test_convert_and_batch_give_a_result_a_finger(hand, tmp_path, monkeypatch, capsys):
    import fake_tools

    monkeypatch.setattr(convert, "load_tools", lambda *files, **options: fake_tools.tools())
    path, out = hand(), tmp_path / "out"
    assert main(["convert", path, "--out", str(out), "--keep", "latent"]) == 0
    assert {folder.name for folder in out.iterdir()} == {"hand_finger0", "hand_finger1"}
    assert main(["convert", f"{path}#1", "--out", str(tmp_path / "one"), "--keep", "latent"]) == 0
    assert [folder.name for folder in (tmp_path / "one").iterdir()] == ["hand_finger1"]
    assert main(["info", path]) == 0
    assert capsys.readouterr().out.count("layout ") == 2


def test_what_is_no_plain_hand_is_refused_in_words(hand, tmp_path, press):
    cases = {
        "fingers of 700 and 500 frames": {"F1Electrodes": press.electrodes.T[:, :500]},
        "24 electrodes: a BioTac SP": {"F0Electrodes": np.zeros((24, 700))},
        "values of type": {"F0Electrodes": np.full((19, 700), "a", dtype=object)},
    }
    for said, arrays in cases.items():
        with pytest.raises(TactileError, match=said):
            recordings.read(hand(**arrays))
    with pytest.raises(TactileError, match="finger 4; expected one that it holds: 0, 1"):
        recordings.read(hand() + "#4")
    savemat(tmp_path / "other.mat", {"x": np.zeros(3)})
    with pytest.raises(TactileError, match="no known recording: arrays 'x'"):
        recordings.read(tmp_path / "other.mat")
    (tmp_path / "new.mat").write_bytes(b"MATLAB 7.3 MAT-file".ljust(600, b" "))
    with pytest.raises(TactileError, match=r"damaged HDF5|not an HDF5"):
        recordings.read(tmp_path / "new.mat")


def test_a_damaged_file_is_refused(hand):
    path = hand()
    whole = Path(path).read_bytes()
    for cut in (130, 200, len(whole) // 2):
        Path(path).write_bytes(whole[:cut])
        with pytest.raises(TactileError):
            recordings.read(path)


def test_a_file_with_objects_is_refused(tmp_path, monkeypatch):
    import scipy.io

    savemat(tmp_path / "a.mat", {"F0Electrodes": np.zeros((19, 50))})
    listed = [("F0Electrodes", (19, 50), "double"), ("thing", (1, 1), "opaque")]
    monkeypatch.setattr(scipy.io, "whosmat", lambda path: listed)
    with pytest.raises(TactileError, match="thing: a MATLAB opaque"):
        recordings.read(tmp_path / "a.mat")


def test_variables_that_are_there_twice_complex_or_huge_are_refused(tmp_path, press):
    savemat(tmp_path / "a.mat", {"F0Electrodes": press.electrodes.T})
    savemat(tmp_path / "b.mat", {"F0Electrodes": np.array([[{}]], dtype=object)})
    twice = (tmp_path / "a.mat").read_bytes() + (tmp_path / "b.mat").read_bytes()[128:]
    (tmp_path / "twice.mat").write_bytes(twice)
    with pytest.raises(TactileError, match="1 of them twice"):
        recordings.read(tmp_path / "twice.mat")
    savemat(tmp_path / "complex.mat", {"F0Electrodes": press.electrodes.T + 1j})
    with pytest.raises(TactileError, match="damaged"):
        recordings.read(tmp_path / "complex.mat")
    long = np.broadcast_to(np.uint8(0), (19, assemble.MAX_FRAMES + 1))
    savemat(tmp_path / "long.mat", {"F0Electrodes": long}, do_compression=True)
    with pytest.raises(TactileError, match="2,000,001 frames; expected at most 2,000,000"):
        recordings.read(tmp_path / "long.mat")


def test_what_unpacks_to_more_than_its_share_is_refused(tmp_path, press, monkeypatch):
    savemat(tmp_path / "a.mat", {"F0Electrodes": press.electrodes.T}, do_compression=True)
    monkeypatch.setattr(array_store, "MOST_UNPACKED", 10_000)
    with pytest.raises(TactileError, match="unpacks to more than 0 MB"):
        recordings.read(tmp_path / "a.mat")
