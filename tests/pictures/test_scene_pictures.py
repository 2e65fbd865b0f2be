"""The pictures that lie beside scenes are of the unit that ships."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tactile_core.pictures.background import read_photograph
from tactile_core.pictures.renderer import Renderer

PICTURES = sorted((Path(__file__).parents[2] / "scenes").glob("*/picture.png"))


@pytest.mark.parametrize("path", PICTURES, ids=lambda path: path.parent.name)
def test_a_scenes_picture_has_the_shipped_background(path):
    background = Renderer(preset="fast").background
    off = np.abs(read_photograph(path).astype(float) - background).mean(axis=2)
    # Nothing touches the corners: light that the walls return makes them up to 0.4 levels off, another unit 30 to 60.
    ends = (slice(20), slice(-20, None))
    assert max(off[rows, columns].mean() for rows in ends for columns in ends) < 2


def test_all_six_are_here():
    assert len(PICTURES) == 6
