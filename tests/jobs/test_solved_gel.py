"""The found contact solved on the DIGIT, in place of the networks' gel."""

import importlib.util

import h5py
import numpy as np
import pytest

from tactile_core import accuracy, sensors
from tactile_core.cli.main import main
from tactile_core.errors import TactileError
from tactile_core.geometry.indenters import Sphere
from tactile_core.jobs import solved_gel
from tactile_core.recordings.flags import Flag

RECORDING = "scenes/press_roll_slide/press_roll_slide.h5"
needs_scipy = pytest.mark.skipif(importlib.util.find_spec("scipy") is None, reason="needs scipy, of the extra [fem]")


def arrays(gels, force, center):
    return {
        "displacement_digit": np.array(gels, np.float32), "force": np.array(force), "contact_center": np.array(center),
        "flags": np.zeros(len(gels), np.uint16),
    }  # fmt: skip


@pytest.fixture(scope="module")
def pressed():
    """A ball of 5 mm pressed into the middle of the gel under 1 N."""
    pytest.importorskip("scipy", reason="contacts are solved with scipy, of the extra [fem]")
    from tactile_core.mechanics.placement import Placement
    from tactile_core.mechanics.solve import solve

    return solve("digit", Sphere(5e-3), Placement(-8e-3, 1e-3), force=1.0)


def test_a_solved_gel_is_the_gel_that_was_pressed(pressed):
    gel = pressed.displacement[None]
    center = accuracy.dent_center(gel, sensors.digit_surface().rest)
    found = solved_gel.solved(arrays(gel, [pressed.force], center))
    assert accuracy.rms_in_contact(found["displacement_digit"], gel)[0] < 0.05 * accuracy.height(gel).max()
    assert found["flags"][0] == 0


def test_frames_without_contact_or_solution_keep_their_gel(pressed):
    gel = pressed.displacement
    found = solved_gel.solved(arrays([gel, gel], [[0, 0, 0], [0, 50.0, 0]], [[np.nan, np.nan], [-8e-3, 0.0]]))
    assert np.array_equal(found["displacement_digit"], np.array([gel, gel], np.float32))
    assert found["flags"].tolist() == [0, int(Flag.GEL_NOT_SOLVED)]  # 50 N sink the ball into the gel's back


@needs_scipy
def test_a_conversion_solves_the_frames_it_is_asked_for(request, tmp_path):
    path, found = str(request.config.rootpath / RECORDING), {}
    for name, words in {"few": ["--frames", "60:240:60"], "fewer": ["--frames", "120:121"]}.items():
        out = ["--out", str(tmp_path / name), "--keep", "displacement", "--gel", "solved"]
        assert main(["convert", path, *words, *out]) == 0
        with h5py.File(tmp_path / name / "press_roll_slide" / "frames.h5") as file:
            found[name] = {each: file[each][:] for each in ("displacement_digit", "frame", "flags")}
    one = np.flatnonzero(found["few"]["frame"] == 120)
    gels = found["few"]["displacement_digit"][one], found["fewer"]["displacement_digit"]
    assert accuracy.height(gels[1]).max() > 50e-6
    # The networks' passes of one frame and of several are equal to a relative 1e-5 (``networks``).
    assert np.allclose(*gels, rtol=0, atol=1e-4 * accuracy.height(gels[1]).max())
    assert not (found["few"]["flags"] & Flag.GEL_NOT_SOLVED).any()


def test_a_missing_library_is_named(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(TactileError, match="--gel solved: scipy is not installed"):
        solved_gel.check_installed()
