"""No calibration is written that explains nothing."""

import numpy as np
import pytest
from PIL import Image
from plain_unit import plain_unit
from pressed_unit import write_photographs

from tactile_core.cli.main import main
from tactile_core.sensors.calibration_file import write_calibration

pytestmark = pytest.mark.usefixtures("coarse_fits")


@pytest.fixture
def start(tmp_path):
    write_calibration(tmp_path / "start.toml", plain_unit())
    return str(tmp_path / "start.toml")


def fit(folder, tmp_path, start):
    words = ["--background", str(tmp_path / "untouched.png"), "--start", start, "--ball-diameter", "6"]
    return main(["calibrate", str(folder), "--quick", *words, "--out", str(tmp_path / "unit.toml")])


def test_what_is_no_ball_makes_no_file(tmp_path, start, capsys):
    """Bars of a colour that changes from picture to picture: balls explain some of each, and nothing of the next."""
    folder = write_photographs(tmp_path / "presses", plain_unit(), ())
    untouched = np.asarray(Image.open(tmp_path / "untouched.png")).astype(int)
    random = np.random.default_rng(1)
    for number in range(2):
        picture = untouched.copy()
        row, column = random.integers(60, 200, 2)
        picture[row : row + 60, column - 40 : column] += random.integers(-60, 60, 3)
        Image.fromarray(picture.clip(0, 255).astype(np.uint8)).save(folder / f"bar_{number}.png")
    assert fit(folder, tmp_path, start) == 2
    assert "tried on held-out presses" in capsys.readouterr().err
    assert not (tmp_path / "unit.toml").exists()
