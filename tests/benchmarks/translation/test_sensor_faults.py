"""Faults of a sensor, its cable or its driver are not translated into confident forces."""

import numpy as np
import pytest
from benchmarks.translation import sensor_faults as module

from tactile_core.recordings.flags import Flag
from tactile_core.translation.simulated_likeness import FELT

FAULTS = "three_low", "drift_all", "hum", "held_third", "frozen_short", "half_gain", "rest_under_load"


@pytest.fixture(scope="module")
def bases():
    return {base.name: base for base in module.bases(None, None)}


@pytest.fixture(scope="module")
def unbroken(bases):
    return {name: base.translated(np.asarray(base.recording.electrodes, float)) for name, base in bases.items()}


@pytest.mark.parametrize("fault", FAULTS)
@pytest.mark.parametrize("name", ["idle", "shipped"])
def test_a_fault_makes_no_confident_force(name, fault, bases, unbroken):
    assert module.share(bases[name], unbroken[name], module.FAULTS[fault]) <= module.TARGET


def test_what_is_not_broken_is_not_doubted(unbroken):
    assert all(module.confident(found).mean() > 1 - module.TARGET / 100 for found in unbroken.values())


def test_a_force_that_the_fluid_s_pressure_denies_is_flagged(bases, unbroken):
    """The same electrodes; PDC stays at rest all the while."""
    shipped, found = bases["shipped"], unbroken["shipped"]
    recording = shipped.recording
    still = np.full(len(recording), recording.pdc[0])
    base = module.replace(shipped, recording=module.replace(recording, pdc=still))
    denied = base.translated(np.asarray(recording.electrodes, float))
    pressed = denied.pressure > FELT
    assert pressed.sum() > 100 and not (found.flags[pressed] & Flag.UNEXPLAINED).any()
    assert (denied.flags[pressed] & Flag.UNEXPLAINED > 0).all()
