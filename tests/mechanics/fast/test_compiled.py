"""Compiled loops give what numpy gives, on 2,000 random contacts of nine indenters."""

import numpy as np
import pytest
from benchmarks.mechanics.random_contacts import random_contacts

from tactile_core.errors import TactileError
from tactile_core.files import compiled
from tactile_core.mechanics.fast.active_set import UnsolvedError
from tactile_core.mechanics.fast.compliance import compliance_of
from tactile_core.mechanics.fast.press import CorrectedPress, FastContact
from tactile_core.mechanics.placement import FRICTION, pose_at
from tactile_core.mechanics.thickness import DEPTH_LIMIT, thickness_under

SEED, EACH = 20261124, 500  # contacts a sensor, with friction and without


def pressed(sensor, contact, friction) -> FastContact | None:
    pose = pose_at(sensor, contact.indenter, contact.place)
    thick = thickness_under(sensor, contact.indenter, pose)
    press = CorrectedPress(compliance_of(sensor), contact.indenter, pose, DEPTH_LIMIT * thick, friction)
    try:
        found = press.at_depth(contact.depth * thick)
    except (TactileError, UnsolvedError):
        return None
    return found if found.linear.converged else None


@pytest.mark.parametrize("friction", [0.0, FRICTION])
@pytest.mark.parametrize("sensor", ["digit", "biotac"])
def test_contacts_are_numpys_within_rounding(sensor, friction, compiled_loops):
    """Sums are taken in another order: gaps agree to nanometres, but where an edge's contact is nearly indifferent.

    Solvers end where gaps are below 0.2 um, so that answers may differ by a few times that at worst.
    """
    apart, force, settled = [], [], []
    for contact in random_contacts(EACH, SEED):
        compiled_loops(False)
        plain = pressed(sensor, contact, friction)
        compiled_loops(True)
        fast = pressed(sensor, contact, friction)
        settled.append((plain is not None, fast is not None))
        if plain and fast:
            apart.append(np.abs(fast.corrected.displacement - plain.corrected.displacement).max())
            force.append(np.linalg.norm(fast.force - plain.force) / max(np.linalg.norm(plain.force), 1e-3))
    either = np.array(settled)
    assert (either[:, 0] != either[:, 1]).mean() <= 0.004  # those that one of them finds and the other does not
    assert either[:, 1].mean() >= either[:, 0].mean() - 0.002 and either[:, 1].mean() > 0.97
    assert np.median(apart) < 1e-9 and np.quantile(apart, 0.99) < 1e-6  # m
    assert np.median(force) < 1e-6 and np.quantile(force, 0.99) < 1e-4
    assert np.mean(np.array(apart) > 5e-6) <= 0.004  # another of two equilibria, as at an edge


def test_the_switch_leaves_everything_to_numpy(compiled_loops):
    compiled_loops(False)
    assert not compiled.available()
    compiled_loops(True)
    assert compiled.available()
