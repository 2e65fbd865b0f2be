"""Contacts followed through a recording, by the shipped networks: in every way of asking for the same frames."""

import h5py
import numpy as np
import pytest
from conftest import SHIPPED

from tactile_core.cli.main import main

ARRAYS = ("force", "contact_center", "displacement_digit", "latent_biotac", "confidence")


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return converted(tmp_path_factory.mktemp("whole"))


@pytest.fixture(scope="module")
def apart(tmp_path_factory):
    return converted(tmp_path_factory.mktemp("apart"), "--frames-apart")


def converted(folder, *words):
    with pytest.MonkeyPatch.context() as patch:  # without the sheet: see no_sheet
        patch.setattr("tactile_core.jobs.conversion_report.ConversionReport.draw_sheet", lambda _, path: path.touch())
        assert main(["convert", str(SHIPPED), "--out", str(folder), "--keep", "latent,displacement", *words]) == 0
    return arrays(folder / "press_roll_slide" / "frames.h5")


def arrays(file):
    with h5py.File(file) as found:
        return {name: found[name][:] for name in (*ARRAYS, "frame")}


def alike(found, whole):
    """Whether arrays are equal to 1e-5 of the largest number: blocks of the networks' passes begin elsewhere.

    Some processors' matrix products round by a row's place in the block: 6e-7 of the largest number was measured.
    """
    return np.allclose(found, whole, rtol=0, atol=1e-5 * np.nanmax(np.abs(whole)), equal_nan=True)


@pytest.mark.parametrize("frames", ["70:75", "::37", "300:"])
def test_frames_are_the_same_whichever_are_asked_for(tmp_path, whole, frames):
    some = converted(tmp_path, "--frames", frames)
    for name in ARRAYS:
        assert alike(some[name], whole[name][some["frame"]]), name


def test_shards_are_the_same_as_a_conversion(tmp_path, whole):
    words = ["--keep", "latent,displacement", "--shard-frames", "100", "--workers", "1"]
    assert main(["batch", str(SHIPPED), "--out", str(tmp_path / "job"), *words]) == 0
    files = sorted((tmp_path / "job").rglob("*.h5"))
    shards = sorted((arrays(file) for file in files if "prepared" not in file.parts), key=lambda one: one["frame"][0])
    assert len(shards) > 1
    for name in ARRAYS:
        found = np.concatenate([shard[name] for shard in shards])
        assert alike(found, whole[name]), name


def test_following_steadies_the_place_and_finds_the_touched_frames(shipped, whole, apart):
    force = np.linalg.norm(shipped.truth.force, axis=1)
    said = [np.isfinite(each["contact_center"][:, 0]) for each in (whole, apart)]
    wrong = [np.mean(np.where(force > 0.1, ~each, each & (force == 0))) for each in said]
    assert wrong[0] <= wrong[1] and wrong[0] < 0.005
    both = said[0] & said[1]
    pairs = both[1:] & both[:-1]
    steps = [np.linalg.norm(np.diff(each["contact_center"], axis=0)[pairs], axis=1) for each in (whole, apart)]
    assert np.median(steps[0]) < 0.5 * np.median(steps[1])
