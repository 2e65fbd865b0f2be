"""A steady grip's level is told from a unit at rest where a contact explains most of it."""

import numpy as np
import pytest

from tactile_core.recordings import prepare, read
from tactile_core.recordings.assemble import assemble
from tactile_core.recordings.flags import Flag
from tactile_core.recordings.polarity import contact_signals
from tactile_core.recordings.readers import each_finger
from tactile_core.recordings.signals import PrepareOptions
from tactile_core.recordings.unit.contact_law import as_contact
from tactile_core.sensors import REST_COUNTS, divider

HARD = np.argsort(np.linalg.norm(contact_signals(), axis=1))[-50::10]


def unit(seed: int) -> np.ndarray:
    """Return the rest (19,) counts of a unit whose films' impedances are 10 % apart, its fluid .45 to 1.3 times one."""
    random = np.random.default_rng(seed)
    conductivity = np.exp(random.uniform(np.log(0.45), np.log(1.3)))
    return divider.of_films(np.exp(0.1 * random.standard_normal(19)) / conductivity, REST_COUNTS)


def test_units_at_rest_are_not_under_load():
    """One in a hundred, whose films are apart as a contact has them, is taken for one: seed 8 of these."""
    assert [seed for seed in range(20) if as_contact(unit(seed), "biotac") is not None] in ([], [8])


def test_electrodes_that_stand_still_in_one_recording_or_nearly_all_of_a_quiet_finger_are_no_faults():
    still, random = np.tile(REST_COUNTS, (400, 1)), np.random.default_rng(0)
    few = still + random.integers(0, 2, still.shape) * (np.arange(19) < 6)
    assert [seed for seed in range(20) if as_contact(unit(seed), "biotac", [few]) is not None] in ([], [8])
    level = REST_COUNTS + contact_signals()[HARD[-1]]
    grips = [level + random.normal(0, 1, (400, 19)), level[None]]  # a row alone
    assert as_contact(level, "biotac", grips) == as_contact(level, "biotac")


@pytest.mark.parametrize("contact", HARD)
def test_a_hard_grip_is(contact):
    rest = divider.of_films(1.2, REST_COUNTS)
    assert as_contact(rest + divider.of_unit(contact_signals()[contact], rest), "biotac") > 0.5


def test_a_recording_of_a_steady_grip_has_no_quiet_part_unless_the_user_names_one():
    level = REST_COUNTS + contact_signals()[HARD[-1]]
    counts = np.rint(level + np.random.default_rng(0).normal(0, 1, (400, 19)))
    recording = assemble("a", "text", electrodes=counts, stamps=None)
    found, named = prepare(recording), prepare(recording, PrepareOptions(tare="0:400"))
    assert (found.flags & Flag.NO_QUIET_PART > 0).all() and "--sensor" in " ".join(found.warnings)
    assert not (named.flags & Flag.NO_QUIET_PART).any()


def test_real_hard_grips_are_under_load(outside_data):
    files = [file for name in ("acrylic", "steel") for file in outside_data("biotac_phac").glob(f"{name}*.mat")]
    loaded = [prepare(read(one)).flags[0] & Flag.NO_QUIET_PART for file in files for one in each_finger(file)]
    assert len(loaded) == 20 and all(loaded)
