"""The share of the electrodes' change that a translated contact explains: right laws against wrong ones."""

import dataclasses

import numpy as np
import pytest

from tactile_core import recordings
from tactile_core.recordings import PrepareOptions, Signals
from tactile_core.recordings.polarity import contact_signals
from tactile_core.sensors import REST_COUNTS, divider
from tactile_core.translation import translate


def explained(recording, **options):
    touch = translate.translate(recording, prepare=PrepareOptions(**options))
    assert np.array_equal(np.isnan(touch.explained), np.isnan(touch.contact_center[:, 0]))
    assert np.nanmax(touch.explained) <= 1
    return np.nanmedian(touch.explained)


def test_wrong_laws_explain_less(shipped):
    """Loose: what is tested is that networks and law belong together, not how good the weights are."""
    right, order = explained(shipped), np.random.default_rng(0).permutation(19)
    assert right > 0.5
    assert right > explained(shipped, polarity="rises") + 0.2
    assert right > explained(dataclasses.replace(shipped, electrodes=shipped.electrodes[:, order])) + 0.2


def test_rectified_changes_are_compared_without_signs(shipped):
    rest = recordings.prepare(shipped).rest
    folded = dataclasses.replace(shipped, electrodes=np.abs(shipped.electrodes - rest).round())
    assert explained(folded, kind="rectified") > 0.2


@pytest.mark.parametrize("film", [0.5, 1.0, 1.2])
def test_a_typical_change_is_taken_back_to_the_unit_that_was_read(film):
    typical, rest = contact_signals()[::10], REST_COUNTS - 400
    here = signals(typical, rest, film)
    own = here.of_typical(typical, REST_COUNTS)
    back = divider.typical(divider.of_typical_film(own, rest, film), rest)
    thinned = 1 - divider.film_impedance(REST_COUNTS) / divider.film_impedance(REST_COUNTS + typical)
    borne = thinned < 0.95 * film  # where the unit's skin does not meet the core: 95 % is as thin as films get
    assert borne.mean() > 0.99
    np.testing.assert_allclose(back[borne], typical[borne], atol=1e-6)  # rounding: each is a closed formula
    assert np.median(np.abs(own) / np.abs(typical)) > 1 / film  # a thinner film, and counts lower at rest, change more


def test_changes_that_are_not_raw_are_of_no_known_unit():
    change = contact_signals()[:3]
    here = dataclasses.replace(signals(change, REST_COUNTS - 400, 0.5), kind="tared")
    assert here.of_typical(change, REST_COUNTS) is change


def signals(change, rest, film):
    count = len(change)
    return Signals(
        change=change, rest=rest, drift=np.zeros(19), electrodes=rest + change, kind="raw", quiet=np.zeros(count, bool),
        flags=np.zeros(count, np.uint16), pdc=np.full(count, np.nan), warnings=(), report={}, film=film,
    )  # fmt: skip
