"""What counts do where a film thins is read from the recording, said with how surely, and never guessed in silence."""

import dataclasses

import h5py
import numpy as np
import pytest

from tactile_core import recordings, sensors
from tactile_core.recordings import PrepareOptions, polarity
from tactile_core.recordings.flags import Flag
from tactile_core.sensors import PRESSURE_PER_COUNT, contact_pressures_of, divider


def pressed(sign: float, *, pdc: bool, frames: int = 400, seed: int = 0, share: float = 1.0) -> recordings.Recording:
    """Rest, simulated contacts one after another, rest; whole counts of a unit that rests at 3,300.

    share : of the fluid's pressure as simulated
    """
    random = np.random.default_rng(seed)
    contacts = polarity.contact_signals()
    which = random.choice(len(contacts), 8, replace=False)
    chosen, fluid = contacts[which], share * contact_pressures_of("biotac")[which] / PRESSURE_PER_COUNT
    strength = np.clip(np.sin(np.linspace(0, 8 * np.pi, frames - 120)), 0, 1)
    change = np.zeros((frames, 19))
    order = np.arange(frames - 120) * 8 // (frames - 120)
    change[60:-60] = strength[:, None] * chosen[order]
    own = divider.of_unit(change, np.full(19, 3300.0)) * np.exp(0.1 * random.standard_normal(19))
    electrodes = np.rint(3300 + sign * own)
    electrodes += np.rint(random.normal(0, 1, electrodes.shape))
    pressure = np.zeros(frames)
    pressure[60:-60] = strength * fluid[order]
    return recordings.Recording(
        name="made", path="made", layout="made", time=np.arange(frames) / 100, start_time=0.0, electrodes=electrodes,
        rows=np.arange(frames), flags=np.zeros(frames, np.uint16), pdc=1000 + np.rint(pressure) if pdc else None,
    )  # fmt: skip


@pytest.mark.parametrize("pdc", [True, False])
@pytest.mark.parametrize(("sign", "name"), [(1.0, "falls"), (-1.0, "rises")])
@pytest.mark.parametrize("seed", range(5))
def test_it_is_found_and_the_change_is_that_of_a_raw_reading(pdc, sign, name, seed):
    film = PrepareOptions(film=1.0)  # it is looked for in falling counts alone
    found = recordings.prepare(pressed(sign, pdc=pdc, seed=seed), film)
    assert found.report["polarity"] == name and not found.flags.any() and not found.warnings
    raw = recordings.prepare(pressed(1.0, pdc=pdc, seed=seed), film)
    np.testing.assert_allclose(found.change, raw.change, atol=10)  # noise of the counts, which does not turn round


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_fluid_whose_conductivity_moves_shows_no_rising_counts(sign):
    warmed = np.linspace(0, sign * 0.2, 400)[:, None]
    counts = divider.of_films(np.exp(-warmed), sensors.REST_COUNTS) + np.random.default_rng(0).normal(0, 1, (400, 19))
    still = dataclasses.replace(pressed(1.0, pdc=False), electrodes=np.rint(counts))
    assert recordings.prepare(still, PrepareOptions(tare=slice(0, 20))).report["polarity"] == "falls"


def test_what_shows_nothing_is_taken_to_fall_and_flagged():
    still = pressed(1.0, pdc=True, share=0.05)
    flicker = 3300.0 + np.arange(400)[:, None] % 2 * np.ones(19)
    for recording in (still, dataclasses.replace(still, electrodes=flicker, pdc=None)):
        found = recordings.prepare(recording)
        assert found.report["polarity"] == "falls"
        assert (found.flags & Flag.POLARITY_ASSUMED > 0).all()
        assert any("--polarity rises" in warning for warning in found.warnings)


def test_a_steady_grip_decides_nothing():
    """Its electrodes creep by more than its pressure changes, and look like rest: real ones were misread."""
    recording = pressed(1.0, pdc=True)
    recording = dataclasses.replace(recording, pdc=np.full(400, 1000.0) + np.arange(400) % 3)
    evidence = recordings.prepare(recording).report["polarity_evidence"]
    assert evidence.startswith("assumed: the fluid's pressure changes by 2 counts")


def test_a_word_that_contradicts_the_recording_is_taken_and_flagged():
    found = recordings.prepare(pressed(1.0, pdc=True), PrepareOptions(polarity="rises"))
    assert found.report["polarity"] == "rises" and (found.flags & Flag.POLARITY_DOUBTED > 0).all()
    assert any("contradicts the recording" in warning for warning in found.warnings)
    np.testing.assert_array_equal(found.change, -recordings.prepare(pressed(1.0, pdc=True)).change)


def test_simulated_files_say_theirs_and_old_ones_rise(request, tmp_path):
    path = request.config.rootpath / "scenes/press_roll_slide/press_roll_slide.h5"
    assert recordings.read(path).about["polarity"] == "falls"
    old = tmp_path / "old.h5"
    old.write_bytes(path.read_bytes())
    with h5py.File(old, "r+") as file:
        del file.attrs["polarity"]
        counts = file["electrodes"][()].astype(int)
        file["electrodes"][...] = 2 * np.rint(np.median(counts[:50], axis=0)).astype(int) - counts
    found, new = recordings.prepare(recordings.read(old)), recordings.prepare(recordings.read(path))
    assert found.report["polarity"] == "rises" and not found.flags.any()
    np.testing.assert_allclose(found.change, new.change, atol=1.5)


def test_real_fingers_fall(outside_data):
    """Trials 01 to 03 alone: 04 and 05 are kept for reports."""
    paths = [path for path in sorted(outside_data("biotac_phac").glob("*.mat")) if path.stem.split("_")[-2] < "04"]
    pytest.importorskip("scipy", reason="scipy is absent: pip install tactile-core[matlab]")
    evidence = [
        (report["polarity"], report["polarity_evidence"].startswith("assumed"))
        for path in paths
        for finger in (0, 1)
        for report in [recordings.prepare(recordings.read(f"{path}#{finger}")).report]
    ]
    assert {name for name, _ in evidence} == {"falls"}
    assert sum(not assumed for _, assumed in evidence) >= 16  # those whose pressure changes
