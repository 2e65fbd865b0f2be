"""Rows of the fluid's pressure, on recordings made for them: exact answers have no error, a wrong scale is found."""

from types import SimpleNamespace

import numpy as np
import pytest
from benchmarks.translation import fluid_pressure, slide_set

PRESSURE = np.linspace(600.0, 4000.0, 50)


NETWORK = SimpleNamespace(card={"pairs": {"largest_pressure_Pa": 3000.0}})


@pytest.fixture
def pressure_rows(monkeypatch, tmp_path):
    """``pressure_rows(factor)``: rows of a network that says ``factor`` times the pressure, their sum its root."""

    def rows(factor):
        names = [tmp_path / f"mat1_{sample}_bio.csv" for sample in (7, 31)]
        monkeypatch.setattr(slide_set, "find", lambda folder: names)
        frames = np.column_stack([PRESSURE, factor * PRESSURE, np.sqrt(PRESSURE)])
        monkeypatch.setattr(fluid_pressure, "_frames", lambda path, network, sensor: frames)
        return {row["name"]: row for row in fluid_pressure.slide_rows(tmp_path, NETWORK, None, None)}

    return rows


def test_the_truth_has_no_error_and_a_constant_has(pressure_rows):
    found = pressure_rows(1.0)
    assert found["pressure_error"]["value"] == 0 and found["pressure_error"]["baseline"] > 20
    assert found["pressure_error_scaled"]["value"] == 0 and found["pressure_error_scaled"]["baseline"] > 5
    assert found["pressure_above_training"]["value"] == pytest.approx(np.mean(PRESSURE > 3000))


def test_a_wrong_scale_is_an_error_until_it_is_taken_from_the_sample_to_choose_by(pressure_rows):
    found = pressure_rows(0.5)
    assert found["pressure_error"]["value"] == pytest.approx(50)
    assert found["pressure_error_scaled"]["value"] == pytest.approx(0, abs=1e-9)
