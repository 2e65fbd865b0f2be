"""A part of a recording is converted with what it needs of it in memory, and is the same as in the whole."""

import dataclasses
import tracemalloc

import h5py
import numpy as np
import pytest

from tactile_core.jobs import convert
from tactile_core.pictures import renderer
from tactile_core.recordings import PrepareOptions
from tactile_core.recordings.assemble import assemble
from tactile_core.recordings.electrode_gains import ElectrodeGains
from tactile_core.recordings.preparer import Preparer
from tactile_core.translation.answer import Answer
from tactile_core.translation.contact_track import BLOCK, MARGIN
from tactile_core.translation.translate import PreparedRows

ARRAYS = "change", "rest", "drift", "electrodes", "quiet", "flags", "pdc"


def repeated(shipped, times, single=False):
    """The shipped recording's counts, one after another."""
    counts = np.tile(shipped.electrodes, (times, 1))
    stamps = np.arange(len(counts)) / 100
    kind = np.float32 if single else np.float64
    return assemble("long.npz", "NPZ", electrodes=counts.astype(kind), stamps=stamps, pdc=np.tile(shipped.pdc, times))


@pytest.mark.parametrize("kind", ["raw", "rectified", "glitches", "guessed", "unit"])
def test_signals_of_some_frames_are_those_of_the_whole(kind, shipped):
    recording, options, unit = repeated(shipped, 3), PrepareOptions(), None
    if kind == "rectified":
        change = np.abs(recording.electrodes - np.rint(recording.electrodes[0]))
        recording, options = dataclasses.replace(recording, electrodes=change), PrepareOptions(kind="rectified")
    if kind == "glitches":
        recording.electrodes[[100, 505], [3, 7]] -= 900.0
    if kind == "guessed":
        recording = recording.at(np.arange(100, 140))
    if kind == "unit":
        unit = ElectrodeGains("a unit", np.linspace(0.8, 1.2, 19).tolist(), [1.0] * 19)
    whole, rows = Preparer(options, unit)(recording), np.arange(3, len(recording), 7)
    some = Preparer(options, unit)(recording, rows)
    for name in ARRAYS:
        expected = getattr(whole, name)
        np.testing.assert_array_equal(getattr(some, name), expected if expected.ndim == 1 and len(expected) == 19 else
                                      expected[rows], err_msg=name)  # fmt: skip
    assert some.report == whole.report and some.warnings == whole.warnings


@pytest.mark.usefixtures("no_sheet")
def test_a_part_of_a_long_recording_is_as_in_the_whole(shipped, tmp_path):
    np.savez(tmp_path / "long.npz", electrodes=np.tile(shipped.electrodes, (5, 1)), pdc=np.tile(shipped.pdc, 5))
    tools, held = convert.load_tools(convert.ToolOptions()), {}
    for name, frames in (("whole", slice(0, None, 20)), ("part", slice(700, 900, 60))):
        options = convert.Options(frames, keep=("displacement", "latent"))
        convert.convert(tmp_path / "long.npz", tmp_path / name, options, tools)
        with h5py.File(tmp_path / name / "frames.h5") as file:
            held[name] = {key: data[:] for key, data in file.items()}
    assert held["part"]["frame"].tolist() == [700, 760, 820, 880]
    for name in ("electrodes", "time", "flags", "pressure_measured"):
        np.testing.assert_array_equal(held["part"][name], held["whole"][name][35:45:3], err_msg=name)
    for name, values in held["part"].items():  # other frames in a chunk: matrix products sum in another order
        whole = held["whole"][name][35:45:3]
        np.testing.assert_allclose(values, whole, atol=1e-5 * np.nanmax(np.abs(whole), initial=1e-9), err_msg=name)


def test_only_the_frames_that_decide_a_selection_are_kept(shipped):
    recording = repeated(shipped, 10)
    frames = np.arange(5 * BLOCK, 5 * BLOCK + 10)
    part = PreparedRows(recording, frames, Answer())
    rows = np.arange(5 * BLOCK - MARGIN, 6 * BLOCK + MARGIN)
    np.testing.assert_array_equal(part.at(rows), np.arange(len(rows)))
    assert part.count == len(recording)
    assert len(part.recording) == len(part.signals.change) == BLOCK + 2 * MARGIN
    np.testing.assert_array_equal(part.read(frames)[0], recording.time[frames])
    assert len(PreparedRows(recording, frames, Answer(frames_apart=True)).signals.change) == len(frames)
    most = PreparedRows(recording, np.arange(len(recording)), Answer())
    assert most.recording is recording and len(most.signals.change) == len(recording)
    np.testing.assert_array_equal(shipped.at(frames[:3] - 1200).truth.force, shipped.truth.force[frames[:3] - 1200])


def test_a_part_of_a_long_recording_takes_little_beside_it(shipped):
    """All changes, in double precision, are twice the recording's counts, which are in single precision.

    Sums over windows, by which rest is found, are as large as the counts, masks a quarter; comparing 2,000 contacts
    with simulated ones takes 30 MB however long the recording is. 31 MB measured here, 57 with all changes.
    """
    recording = repeated(shipped, 250, single=True)
    tracemalloc.start()
    try:
        part = PreparedRows(recording, np.arange(10), Answer())
        kept, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert part.count == len(recording) and kept < 0.05 * recording.electrodes.nbytes
    assert peak < 2.2 * recording.electrodes.nbytes + 20e6


def test_the_renderer_is_made_with_the_first_picture(monkeypatch):
    made = []
    monkeypatch.setattr(renderer, "Renderer", lambda unit, preset: made.append(unit) or (lambda height: height))
    tools = convert.load_tools(convert.ToolOptions())
    assert not made
    tools.drawer.warm_up()
    tools.drawer.warm_up()
    assert len(made) == 1
