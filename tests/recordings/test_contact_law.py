"""A recording of a wrong law is doubted, one as simulated is not, and what is too little says nothing."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from benchmarks.translation import wrong_laws

from tactile_core import recordings
from tactile_core.recordings import contact_law, electrode_gains
from tactile_core.recordings.electrode_gains import ElectrodeGains
from tactile_core.recordings.flags import Flag
from tactile_core.recordings.signals import doubt_law
from tactile_core.sensors import PRESSURE_PER_COUNT


def share_doubted(law, contacts):
    found = wrong_laws.recordings(True, contacts, law, seed=2)[:60]
    return np.mean([bool(contact_law.doubt(*each)) for each in found])


@pytest.mark.parametrize("law", wrong_laws.WRONG.values(), ids=wrong_laws.WRONG)
def test_a_hundred_contacts_of_a_wrong_law_are_doubted(law):
    assert share_doubted(law, contacts=100) >= wrong_laws.TARGET


def test_contacts_as_simulated_are_not_doubted():
    assert share_doubted(wrong_laws.right, contacts=100) <= wrong_laws.ALARMS


def test_a_skin_of_half_the_stiffness_is_seen_by_the_fluid_s_pressure_alone():
    change, pressure, _ = wrong_laws.touches(odd=True)
    contact = contact_law.touching(change)
    change, pressure = change[contact], pressure[contact]
    assert contact_law.doubt(change) == contact_law.doubt(change, pressure) == ""
    assert contact_law.doubt(change, np.full(len(change), np.nan)) == ""
    assert "the fluid's pressure is 0.5" in contact_law.doubt(change, pressure / 2)
    assert "the fluid's pressure is 2." in contact_law.doubt(change, 2.2 * pressure)


def test_one_contact_however_strange_is_too_little():
    strange = 100 * np.random.default_rng(0).standard_normal(19)
    assert contact_law.doubt(np.tile(strange, (50, 1)), np.full(50, 1e5)) == ""
    assert contact_law.doubt(np.empty((0, 19)), np.empty(0)) == ""


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
    change = wrong_laws.touches(odd=True)[0]
    gain = np.where(np.arange(19) % 4 == 0, 2.5, 1.0)
    doubted = signals_of(change * gain)
    contact = contact_law.touching(change * gain)
    assert not (doubted.flags[:40] & Flag.LAW_DOUBTED).any()
    assert np.array_equal(doubted.flags[40:] & Flag.LAW_DOUBTED > 0, contact)
    assert doubted.warnings[0].startswith(contact_law.BEGINNING)
    mended = electrode_gains.apply(doubted, ElectrodeGains("a unit", gain.tolist(), [0.0] * 19))
    assert not (mended.flags & Flag.LAW_DOUBTED).any() and not mended.warnings
    rectified = doubt_law(dataclasses.replace(doubted, kind="rectified", flags=0 * doubted.flags, warnings=()))
    assert not rectified.flags.any()


def test_pressure_is_not_judged_where_its_rest_is_a_guess():
    change, pressure, _ = wrong_laws.touches(odd=True)
    doubted = signals_of(change, pressure / 2 / PRESSURE_PER_COUNT)
    assert (doubted.flags & Flag.LAW_DOUBTED).any() and "pressure" in doubted.warnings[0]
    guessed = doubt_law(dataclasses.replace(doubted, flags=0 * doubted.flags + np.uint16(Flag.NO_QUIET_PART)))
    assert not (guessed.flags & Flag.LAW_DOUBTED).any() and not guessed.warnings
