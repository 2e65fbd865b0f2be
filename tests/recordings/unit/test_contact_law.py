"""A recording of a wrong law is doubted, one as simulated is not, and what is too little says nothing."""

import dataclasses
from pathlib import Path

import h5py
import numpy as np
import pytest
from benchmarks.translation import sensor_faults
from benchmarks.translation.test_set import GAIN, NOISE

from tactile_core import recordings
from tactile_core.recordings import electrode_gains
from tactile_core.recordings.doubt import LAW, Reason, reason_of
from tactile_core.recordings.electrode_gains import ElectrodeGains
from tactile_core.recordings.flags import Flag
from tactile_core.recordings.preparation import doubt_law
from tactile_core.recordings.unit import contact_law
from tactile_core.sensors import PRESSURE_PER_COUNT

TEST_SET = Path(__file__).parents[3] / "scenes" / "training" / "test_contacts.h5"
TARGET, ALARMS, FROM = 0.9, 0.05, 20  # shares of recordings (docs/sources.md, Targets); contacts from which on
REST = np.zeros(19)  # of changes
PDC_NOISE = 1.5 * PRESSURE_PER_COUNT  # Pa (assumed, as the electrodes')
WRONG = {
    "inverted": sensor_faults.inverted,
    "gains_doubled": sensor_faults.louder,
    "channels_swapped": sensor_faults.swapped,
    "rest_off": lambda change, rest, random: change + 40.0 * random.choice([-1.0, 1.0]),
    "skin_softer": lambda change, rest, random: change,
}


def touches():
    """Changes (n, 19) counts and pressures (n,) Pa of the test set's odd presses, by which no limit was chosen."""
    with h5py.File(TEST_SET) as file:
        odd = file["press"][:] % 2 == 1
        return tuple(file[name][:].astype(float)[odd] for name in ("signal", "pressure"))


def share_doubted(name, contacts, recordings=60):
    """Share of recordings, each of a unit with gains 10 % apart, that are doubted; name : of WRONG, or right."""
    random, doubted = np.random.default_rng([2, contacts]), []
    change, pressure = touches()
    for _ in range(recordings):
        gain = 1 + GAIN * random.standard_normal(19)
        chosen = random.choice(len(change), contacts, replace=False)
        seen = WRONG.get(name, WRONG["skin_softer"])(change[chosen] * gain, REST, random)
        seen = seen + NOISE * random.standard_normal(seen.shape)
        fluid = pressure[chosen] * (0.5 if name == "skin_softer" else 1) + random.normal(0, PDC_NOISE, contacts)
        contact = contact_law.touching(seen)
        doubted.append(bool(contact_law.doubt(seen[contact], fluid[contact])))
    return np.mean(doubted)


@pytest.mark.parametrize("law", WRONG)
def test_a_hundred_contacts_of_a_wrong_law_are_doubted(law):
    assert share_doubted(law, contacts=100) >= TARGET


@pytest.mark.parametrize("law", ["gains_doubled", "channels_swapped"])
def test_twenty_contacts_show_wrong_gains_and_exchanged_electrodes(law):
    assert share_doubted(law, FROM, recordings=150) >= TARGET


def test_twenty_contacts_as_simulated_are_not_doubted():
    assert share_doubted("right", FROM, recordings=150) <= ALARMS


@pytest.mark.parametrize("pair", [(0, 5), (3, 12), (7, 16)])
def test_the_electrodes_that_are_exchanged_are_named(pair):
    change = touches()[0]
    change = change[contact_law.touching(change)]
    change[:, pair] = change[:, pair[::-1]]
    less, found = contact_law.exchanged_share(change)
    assert found == pair and less > contact_law.EXCHANGED
    assert f"if E{pair[0] + 1} and E{pair[1] + 1} are exchanged" in contact_law.doubt(change)


def test_one_contact_unlike_simulated_ones_says_nothing_of_gains_and_exchanges():
    """Within one grip of a real finger, gains and exchanges explain what makes it unlike simulated contacts."""
    noise = NOISE * np.random.default_rng(0).standard_normal((200, 19))
    grip = touches()[0][100] * np.where(np.arange(19) % 3, 1.0, 2.5) + noise
    assert contact_law.apart(grip) < contact_law.FEWEST_APART and contact_law.exchanged_share(grip)[0] > 0
    assert reason_of(contact_law.doubt(grip)) not in (Reason.LAW_GAINS, Reason.LAW_EXCHANGED)


def test_contacts_as_simulated_are_not_doubted():
    assert share_doubted("right", contacts=100) <= ALARMS


def test_a_skin_of_half_the_stiffness_is_seen_by_the_fluid_s_pressure_alone():
    change, pressure = touches()
    contact = contact_law.touching(change)
    change, pressure = change[contact], pressure[contact]
    assert contact_law.doubt(change) is contact_law.doubt(change, pressure) is None
    assert contact_law.doubt(change, np.full(len(change), np.nan)) is None
    assert "the fluid's pressure is 0.5" in contact_law.doubt(change, pressure / 2)
    assert "the fluid's pressure is 2." in contact_law.doubt(change, 2.2 * pressure)


def test_one_contact_however_strange_is_too_little():
    strange = 100 * np.random.default_rng(0).standard_normal(19)
    assert contact_law.doubt(np.tile(strange, (50, 1)), np.full(50, 1e5)) is None
    assert contact_law.doubt(np.empty((0, 19)), np.empty(0)) is None


def signals_of(change, pdc=None):
    """Signals of a tared recording, whose first frames are still."""
    still = np.zeros((40, 19))
    pdc = np.full(len(change), np.nan) if pdc is None else pdc
    arrays = recordings.Signals(
        change=np.concatenate([still, change]), rest=np.zeros(19), drift=np.zeros(19), kind="tared",
        electrodes=np.concatenate([still, change]), quiet=np.arange(40 + len(change)) < 40,
        flags=np.zeros(40 + len(change), np.uint16), pdc=np.concatenate([np.zeros(40), pdc]), warnings=(), report={},
    )  # fmt: skip
    return doubt_law(arrays)


def test_the_doubt_flags_contacts_alone_and_a_unit_s_gains_take_it_back():
    change = touches()[0]
    gain = np.where(np.arange(19) % 4 == 0, 2.5, 1.0)
    doubted = signals_of(change * gain)
    contact = contact_law.touching(change * gain)
    assert not (doubted.flags[:40] & Flag.LAW_DOUBTED).any()
    assert np.array_equal(doubted.flags[40:] & Flag.LAW_DOUBTED > 0, contact)
    assert reason_of(doubted.warnings[0]) in LAW
    mended = electrode_gains.apply(doubted, ElectrodeGains("a unit", gain.tolist(), [0.0] * 19))
    assert not (mended.flags & Flag.LAW_DOUBTED).any() and not mended.warnings
    rectified = doubt_law(dataclasses.replace(doubted, kind="rectified", flags=0 * doubted.flags, warnings=()))
    assert not rectified.flags.any()


def test_pressure_is_not_judged_where_its_rest_is_a_guess():
    change, pressure = touches()
    doubted = signals_of(change, pressure / 2 / PRESSURE_PER_COUNT)
    assert (doubted.flags & Flag.LAW_DOUBTED).any() and "pressure" in doubted.warnings[0]
    guessed = doubt_law(dataclasses.replace(doubted, flags=0 * doubted.flags + np.uint16(Flag.NO_QUIET_PART)))
    assert not (guessed.flags & Flag.LAW_DOUBTED).any() and not guessed.warnings
