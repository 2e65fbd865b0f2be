"""From a gel back to the skin: nearer the truth than an untouched finger, and refused where there is no gel."""

import os
import shutil

import h5py
import numpy as np
import pytest
from conftest import SHIPPED

from tactile_core import recordings
from tactile_core.cli.main import main


def test_a_gel_gives_back_the_skin_the_force_and_the_counts(shipped, tmp_path):
    """The simulated truth is what pairs are made of; an untouched finger is the baseline."""
    out = tmp_path / "skin.h5"
    words = ["convert", str(SHIPPED), "--reverse", "--frames", "60:300:10", "--out", str(out)]
    assert main(words) == 0
    rows, truth = np.arange(60, 300, 10), shipped.truth
    signals = recordings.prepare(shipped)
    with h5py.File(out) as file:
        assert file.attrs["sensor"] == "biotac" and np.array_equal(file["frame"][:], rows)
        skin, force, counts = (file[name][:] for name in ("displacement", "force", "electrodes"))
    pairs = (skin, truth.displacement_biotac[rows]), (force, truth.force[rows]), (counts, signals.typical[rows])
    for found, expected in pairs:
        assert np.square(found - expected).sum() < 0.15 * np.square(expected).sum()
    still = ~truth.force[rows].any(axis=1)
    assert still.any() and not skin[still].any() and not counts[still].any()
    before = out.read_bytes()
    assert main(words) == 2 and out.read_bytes() == before
    assert main([*words, "--overwrite"]) == 0 and out.read_bytes() == before
    out.write_bytes(b"")  # as mktemp makes it
    assert main([*words, "--overwrite"]) == 0 and out.read_bytes() == before
    own, notes = tmp_path / "own.h5", tmp_path / "notes.txt"
    shutil.copy(SHIPPED, own)
    notes.write_text("mine")
    for other in (own, notes):  # neither is an older result
        held = other.read_bytes()
        assert main(["convert", str(own), "--reverse", "--overwrite", "--out", str(other)]) == 2
        assert other.read_bytes() == held
    if os.name != "nt":
        (tmp_path / "link.h5").symlink_to("nowhere")
        assert main(["convert", str(own), "--reverse", "--overwrite", "--out", str(tmp_path / "link.h5")]) == 2


def test_what_is_no_gel_is_refused(slide_csv, tmp_path, capsys):
    np.savez(tmp_path / "heights.npz", height_map=np.zeros((2, 3, 3), np.float32))
    for path, words in ((slide_csv(), "no HDF5 file"), (tmp_path / "heights.npz", "no HDF5 file")):
        assert main(["convert", str(path), "--reverse", "--out", str(tmp_path / "skin.h5")]) == 2
        assert words in capsys.readouterr().err and not (tmp_path / "skin.h5").exists()


@pytest.mark.parametrize(
    "words", [["--plan"], ["--no-drift"], ["--keep", "height"], ["--error", "1levels"], ["--tare", ":9"]]
)
def test_options_that_the_reverse_does_not_take_are_refused(words, tmp_path, capsys):
    assert main(["convert", str(SHIPPED), "--reverse", "--out", str(tmp_path / "skin.h5"), *words]) == 2
    expected = f"{words[0]}: given with --reverse; expected --frames, --weights, --to, --overwrite alone"
    assert expected in capsys.readouterr().err and not (tmp_path / "skin.h5").exists()
