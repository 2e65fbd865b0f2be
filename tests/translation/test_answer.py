"""Which contact answers a frame, where it lies on the gel, and which others it may be."""

import h5py
import numpy as np
import pytest
from conftest import SHIPPED

from tactile_core import accuracy, recordings
from tactile_core.cli.main import main
from tactile_core.errors import TactileError
from tactile_core.translation import gel_place, translator
from tactile_core.translation.answer import Answer, parse_shift
from tactile_core.translation.contact_frame import PLACE_UNIT
from tactile_core.translation.translate import load_translator

pytestmark = pytest.mark.usefixtures("no_sheet")

CELL = 0.6e-3  # m, the largest of the gel's lattice


@pytest.fixture(scope="module")
def touched(shipped):
    """Signals of 20 frames in contact of the shipped recording, and which they are."""
    frames = np.flatnonzero(np.linalg.norm(shipped.truth.force, axis=1) > 0.4)[::9][:20]
    return recordings.prepare(shipped).at(frames), frames


@pytest.fixture(scope="module")
def frame():
    return load_translator().nets.frames["MVD"]


def test_places_on_the_gel_are_found_again(frame):
    random = np.random.default_rng(0)
    half = (np.array([frame.rows, frame.columns]) - 1) / 2 / PLACE_UNIT
    place = random.uniform(-half, half, (300, 2))
    assert np.allclose(gel_place.place_on(frame, gel_place.on_gel(frame, place)), place, atol=1e-9)
    beside = gel_place.place_on(frame, np.array([[0.1, 0.0], [-8e-3, 0.05]]))  # a point 10 cm away, and one 5 cm
    assert (np.abs(beside) <= half + 1e-9).all()


@pytest.mark.parametrize("shift", [(3.0, -2.0), (-4.0, 0.0), (0.0, 1.0)])
def test_a_mount_s_shift_moves_the_dent_and_keeps_it(touched, shift):
    signals, _ = touched
    there, moved = (load_translator(answer=answer)(signals) for answer in (None, Answer(mount_shift_mm=shift)))
    step = moved.contact_center - there.contact_center
    assert np.abs(np.median(step, axis=0) - 1e-3 * np.array(shift)).max() < 0.1 * CELL
    depth = [accuracy.lengths(each.displacement_digit).max(axis=1) for each in (there, moved)]
    assert np.median(depth[1] / depth[0]) > 0.95  # what interpolation between nodes takes off a peak
    assert np.array_equal(there.force, moved.force)
    assert np.array_equal(there.displacement_biotac, moved.displacement_biotac)


def test_what_is_shifted_off_the_gel_is_flagged(touched):
    signals, _ = touched
    found = load_translator(answer=Answer(mount_shift_mm=(-20.0, 0.0)))(signals)
    assert (found.flags & recordings.flags.Flag.BEYOND_DIGIT > 0).all()
    assert accuracy.lengths(found.displacement_digit).max() < 0.1 * accuracy.lengths(found.displacement_biotac).max()


def test_the_mean_is_another_answer(touched):
    signals, _ = touched
    likely, mean = (load_translator(answer=Answer(kind)) for kind in ("likely", "mean"))
    said = likely.encode(signals)
    assert np.array_equal(mean(signals).force, likely.decode(signals, said, said.average).force)
    assert not np.array_equal(mean(signals).force, likely(signals).force)
    assert not mean.answer.follows and likely.answer.follows


def test_drawn_contacts_spread_as_the_posterior_says(touched):
    signals, frames = touched
    said = load_translator().encode(signals)
    drawn = said.drawn(frames, 40_000)
    spread = np.sqrt((said.weight[..., None] * (said.spread**2 + (said.mean - said.average[:, None]) ** 2)).sum(1))
    assert np.abs((drawn.mean(1) - said.average) / spread).max() < 5 / np.sqrt(40_000)  # 80 means, 5 standard errors
    assert np.allclose(drawn.std(1) / spread, 1, atol=0.25)  # rare far components are drawn a few times
    assert np.array_equal(said.drawn(frames, 7), said.drawn(frames, 7))


def test_drawn_contacts_lie_round_the_answer(tmp_path):
    path, out = str(SHIPPED), ["--out", str(tmp_path), "--keep", ""]
    assert main(["convert", path, *out, "--samples", "30", "--frames", "60:160:5"]) == 0
    with h5py.File(tmp_path / "press_roll_slide" / "frames.h5") as file:
        center, drawn, force = file["contact_center"][:], file["sample_center"][:], file["sample_force"][:]
    known = np.isfinite(center[:, 0])
    assert drawn.shape == (20, 30, 2) and force.shape == (20, 30) and known.any()
    away = np.linalg.norm(np.nanmedian(drawn[known], axis=1) - center[known], axis=1)
    assert np.median(away) < 1e-3  # what a frame alone leaves open of its place
    lost = np.isnan(drawn[..., 0])
    assert (force[lost] == 0).all() and (force[~lost] > 0.03).all()


def test_a_frame_s_draws_do_not_depend_on_the_other_frames(touched):
    signals, frames = touched
    network = load_translator(answer=Answer(samples=5))
    some = signals.at(slice(3, 7))
    whole, part = (network.plausible(network.encode(each), at) for each, at in ((signals, frames), (some, frames[3:7])))
    for name in translator.SAMPLES:
        assert np.allclose(part[name], whole[name][3:7], rtol=1e-5, atol=1e-8, equal_nan=True)


@pytest.mark.parametrize("text", ["", "3", "3,4,5", "nan,1", "1e3,0", "26,0", "a,b", "3;4"])
def test_a_shift_that_is_none_is_told(text):
    with pytest.raises(TactileError, match="--mount-shift"):
        parse_shift(text)
    assert parse_shift("-4, 1.5") == (-4.0, 1.5)
