"""Made-up units: the typical one reads as the simulated law has it; film and fluid show at rest; the rows."""

import numpy as np
import pytest
from benchmarks.translation import made_up_units
from benchmarks.translation.made_up_units import Unit

from tactile_core.geometry.indenters import Sphere
from tactile_core.mechanics.electrodes.biotac_sheet import signal_of
from tactile_core.mechanics.placement import Placement
from tactile_core.recordings.preparer import Preparer
from tactile_core.sensors import REST_COUNTS
from tactile_core.translation.translate import load_translator


def test_a_typical_unit_reads_as_the_law_has_it():
    contact = Unit().press(Sphere(4e-3), Placement(-8e-3, 1e-3), 0.5).at_depth(0.6e-3).linear
    rest, (pressed,) = Unit().rest(), Unit().readings([contact])
    np.testing.assert_allclose(rest, REST_COUNTS)
    change = signal_of(contact)
    assert np.linalg.norm(pressed - rest - change) < 0.1 * np.linalg.norm(change)  # the reduced sheet leaves .06 here


@pytest.mark.parametrize(("film", "conductivity"), [(0.5, 1.0), (1.0, 0.5)])
def test_a_thin_film_and_a_weak_fluid_raise_the_impedance_at_rest_alike(film, conductivity):
    np.testing.assert_allclose(Unit(film, conductivity).rest(), Unit(0.5).rest())
    assert (Unit(0.5).rest() < REST_COUNTS).all()


def test_light_touches_do_not_hide_a_thin_film():
    """All are lighter than the lightest simulated contacts over some of the films that are tried."""
    thin, weak, typical = (
        Preparer()(made_up_units.played(0, unit, presses=5).recording) for unit in (Unit(0.5), Unit(1.0, 0.5), Unit())
    )
    assert "different contacts" in thin.report["film"]["evidence"]
    assert 0.4 < thin.film < 0.8 and typical.film == 1 and not typical.warnings
    for each in (thin, weak):  # which rest alike
        assert each.film < 0.8 and any("another fluid over a typical film rests alike" in one for one in each.warnings)


def test_rows_of_units_given_found_and_unknown():
    found = made_up_units.rows(load_translator(), units=2, presses=2)
    names = [
        f"unit_{taken}_{name}" for taken in ("given", "found", "unknown") for name in ("force", "place", "gel", "ms")
    ]
    assert [each["name"] for each in found] == names
    assert all(np.isfinite(each["value"]) for each in found)


def test_confidence_is_the_share_of_errors_below_their_bound():
    found = made_up_units.reliability(load_translator(), units=2, presses=6)
    assert [each["name"] for each in found][-1] == "confidence_to_1"
    assert all(each["ok"] for each in found)  # nowhere less than the confidence
