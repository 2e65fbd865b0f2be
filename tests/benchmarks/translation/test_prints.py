"""How visible a print is: a known change of a picture, and a recording, translated and answered with nothing."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from benchmarks.translation import prints

from tactile_core import recordings
from tactile_core.recordings import prepare
from tactile_core.translation.translate import load_translator
from tactile_core.translation.translator import Translator

SHIPPED = Path(__file__).resolve().parents[3] / "scenes" / "press_roll_slide" / "press_roll_slide.h5"


def test_the_strongest_window_is_told_wherever_it_lies():
    change = np.zeros((100, 80, 3))
    change[60:92, 10:42] = 3, 3, -3
    assert prints.strongest(change) == pytest.approx(3)
    change[0, 0] = 32  # one pixel: squares of a window's 32 x 32 make 1 of it
    assert prints.strongest(change) == pytest.approx(3)
    assert prints.strongest(0 * change) == 0


def test_a_blank_answer_has_no_print():
    signals = prepare(recordings.read(SHIPPED))
    network = load_translator()

    class Blank(Translator):
        def decode(self, *of_frames):
            found = super().decode(*of_frames)
            return dataclasses.replace(found, displacement_digit=0 * found.displacement_digit)

    found = {row["name"]: row["value"] for row in prints.rows("a", [signals], network)}
    nothing = {row["name"]: row["value"] for row in prints.rows("a", [signals], Blank(network.nets))}
    assert found["a_contact_in_picture"] > 0 and found["a_print_visible"] > 0.5
    assert nothing["a_print_visible"] == nothing["a_print_level"] == 0
