"""PDC beside raw electrodes, in counts or as a pressure that was made of them, absolute or over rest."""

import dataclasses

import numpy as np
import pytest

from tactile_core.recordings.preparer import Preparer
from tactile_core.recordings.signal_kind import OF_ELECTRODES, PRESSURES, counts_a_unit, in_counts

COUNT = 36.5  # Pa
RNG = np.random.default_rng(0)
RISE = np.rint(np.r_[np.zeros(100), 60 * np.sin(np.linspace(0, np.pi, 200)), np.zeros(50)] + RNG.normal(0, 0.8, 350))


@pytest.mark.parametrize("rest", [0, 962, 2405], ids="{} at rest".format)
@pytest.mark.parametrize(("words", "decimals"), [("Pa", 1), ("hPa", 1), ("kPa", 2), ("psi", 3), ("kPa", 9)])
def test_a_pressure_is_told_by_its_steps(words, decimals, rest):
    found = counts_a_unit(np.round((rest + RISE) * COUNT / PRESSURES[words], decimals), 1.0, "biotac")
    assert found == (pytest.approx(PRESSURES[words] / COUNT), words)


@pytest.mark.parametrize("rest", [0.0, 0.3, 80.0, 962.0, 2405.0])
@pytest.mark.parametrize("averaged", [1, 5, 20])
def test_counts_stay_counts_tared_or_averaged(rest, averaged):
    pdc = np.convolve(rest + RISE, np.full(averaged, 1 / averaged), "valid")
    assert counts_a_unit(pdc, 1.0, "biotac") == (1.0, "")


def test_a_single_glitch_makes_no_pressure_of_counts():
    assert counts_a_unit(np.where(np.arange(350) == 7, 65535.0, 962 + RISE), 1.0, "biotac") == (1.0, "")


@pytest.mark.parametrize(("words", "decimals", "rest"), [("kPa", 1, 2405), ("psi", 2, 2405), ("Pa", -2, 2405)])
def test_a_coarsely_rounded_pressure_is_told_by_its_level(words, decimals, rest):
    assert counts_a_unit(np.round((rest + RISE) * COUNT / PRESSURES[words], decimals), 1.0, "biotac")[1] == words


@pytest.mark.parametrize("full", [1.0, 3.3, 5.0, 100.0])  # shares, volts, percent
@pytest.mark.parametrize("rest", [0, 962, 2405], ids="{} at rest".format)
def test_pdc_in_the_unit_of_the_electrodes_is_told(full, rest):
    unit = 4095 / full
    assert counts_a_unit(np.round((rest + RISE) / unit, 6), unit, "biotac") == (unit, OF_ELECTRODES)
    if rest:  # by its level
        assert counts_a_unit((rest + RISE + RNG.uniform(-0.5, 0.5, 350)) / unit, unit, "biotac")[0] == unit
    assert counts_a_unit(rest + RISE, unit, "biotac") == (1.0, "")
    if rest and full == 100.0:
        assert counts_a_unit(np.round((rest + RISE) / unit), unit, "biotac") == (unit, "")
    assert counts_a_unit(np.round((rest + RISE) * COUNT / 1e3, 4), unit, "biotac")[1] == "kPa"


def test_a_held_or_whole_pressure_is_told():
    assert counts_a_unit(np.full(30, 56.502), 1.0, "biotac")[1] == "kPa"
    assert counts_a_unit(np.rint(COUNT * RISE), 1.0, "biotac")[1] == "Pa"


def test_what_is_neither_is_taken_as_not_recorded():
    warnings: list[str] = []
    assert in_counts(1e6 + 1e4 * np.random.default_rng(0).random(300), 1.0, "biotac", warnings) is None
    assert warnings == ["PDC goes beyond 12 bit, and is no pressure in Pa, hPa, kPa or psi: taken as not recorded"]


@pytest.mark.parametrize("rest", [0, 962])
def test_zeros_are_readings_of_tared_counts_alone(rest):
    warnings: list[str] = []
    pdc = np.where(np.arange(350) < 60, 0.0, rest + RISE)
    expected = np.where(pdc == 0, np.nan, pdc) if rest else pdc
    np.testing.assert_array_equal(in_counts(pdc, 1.0, "biotac", warnings), expected)
    assert bool(warnings) == bool(rest)


def test_a_recording_with_kilopascals_is_prepared_as_with_counts(shipped):
    kilo = dataclasses.replace(shipped, pdc=np.round(shipped.pdc * COUNT / 1e3, 4))
    of_counts, of_kilo = (Preparer()(each) for each in (shipped, kilo))
    np.testing.assert_allclose(of_kilo.pdc, of_counts.pdc, atol=0.01)
    np.testing.assert_array_equal(of_kilo.change, of_counts.change)
    assert "PDC is taken as kPa: 27.4 counts a unit" in of_kilo.warnings
