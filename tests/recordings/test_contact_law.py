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


def share_doubted(law, contacts=100):
    found = wrong_laws.recordings(wrong_laws.signals(odd=True), contacts, law, seed=2)[:60]
    return np.mean([bool(contact_law.doubt(each)) for each in found])


@pytest.mark.parametrize("law", wrong_laws.WRONG.values(), ids=wrong_laws.WRONG)
def test_a_hundred_contacts_of_a_wrong_law_are_doubted(law):
    assert share_doubted(law) >= wrong_laws.TARGET


def test_contacts_as_simulated_are_not_doubted():
    assert share_doubted(wrong_laws.right) <= wrong_laws.ALARMS


def test_one_contact_however_strange_is_too_little():
    strange = 100 * np.random.default_rng(0).standard_normal(19)
    assert contact_law.doubt(np.tile(strange, (50, 1))) == ""
    assert contact_law.doubt(np.empty((0, 19))) == ""


def signals_of(change):
    """Signals of a tared recording, whose first frames are still."""
    still = np.zeros((40, 19))
    arrays = recordings.Signals(
        change=np.concatenate([still, change]), rest=np.zeros(19), drift=np.zeros(19), kind="tared",
        electrodes=np.concatenate([still, change]), quiet=np.arange(40 + len(change)) < 40,
        flags=np.zeros(40 + len(change), np.uint16), pdc=np.full(40 + len(change), np.nan), warnings=(), report={},
    )  # fmt: skip
    return doubt_law(arrays)


def test_the_doubt_flags_contacts_alone_and_a_unit_s_gains_take_it_back():
    change = wrong_laws.signals(odd=True)
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
