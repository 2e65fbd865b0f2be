"""Grids of parameters: which combinations they say, and what they change in a scene."""

import pytest

from tactile_core.errors import TactileError
from tactile_core.jobs.simulate import combinations, name_of, with_values
from tactile_core.simulation.scene import load_scene


@pytest.fixture
def scene(request):
    return load_scene(request.config.rootpath / "scenes/press_roll_slide")[0]


def test_all_combinations_the_last_name_fastest():
    found = combinations(["force_n=0.1:0.3:3", "recording.tilt_deg=0,10"])
    assert found == [
        {"force_n": force, "recording.tilt_deg": tilt} for force in (0.1, 0.2, 0.3) for tilt in (0.0, 10.0)
    ]
    assert combinations(["x_mm=-2:-2:1"]) == [{"x_mm": -2.0}]
    assert name_of(found[1]) == "force_n-0.1_tilt_deg-10"


@pytest.mark.parametrize(
    "words",
    [["force_n"], ["force_n=1:2"], ["force_n=1:2:0"], ["force_n=nan"], ["force_n=1:inf:3"], ["../x=1"], ["force_n="],
     ["force_n=1", "force_n=2"],
     ["force_n=1:2:1000", "x_mm=1:2:1000"], ["force_n=1:2:3:4"],
     ["recording.tilt_deg=1,,2"]],
)  # fmt: skip
def test_bad_words_are_told(words):
    with pytest.raises(TactileError, match="--grid"):
        combinations(words)


def test_the_motion_is_scaled_and_moved(scene):
    before, changed = (
        scene.recording.points,
        with_values(scene, {"force_n": 2.0, "x_mm": -7.0}, "here").recording.points,
    )
    assert [p.force_n for p in changed] == pytest.approx([2 * p.force_n for p in before])  # the hardest is 1 N
    assert [p.x_mm for p in changed] == pytest.approx([p.x_mm + 1 for p in before])  # which is at -8 mm
    assert [p.z_mm for p in changed] == [p.z_mm for p in before]


def test_fields_are_set(scene):
    changed = with_values(scene, {"indenters.0.radius_mm": 5.0, "recording.tilt_deg": 10.0}, "here")
    assert changed.indenters[0].radius_mm == 5.0 and changed.recording.tilt_deg == 10.0


@pytest.mark.parametrize(
    "values",
    [{"recording.tilt": 1.0}, {"indenters.1.radius_mm": 1.0}, {"recording.points": 1.0},
     {"indenters.0.radius_mm": -1.0}, {"recording.tilt_deg": "much"}, {"recording.indenter": "none"},
     {"indenters.radius_mm": 1.0},
     {"force_n": -1.0}, {"indenters.0.name.x": 1.0}, {"force_n": "much"}],
)  # fmt: skip
def test_what_the_scene_does_not_allow_is_told(values, scene):
    with pytest.raises(TactileError, match="here"):
        with_values(scene, values, "here")
