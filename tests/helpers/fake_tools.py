"""A conversion without networks: one dent whose depth follows the electrodes; pictures in two grey levels.

Run as a script it is the command ``tactile`` with these tools: ``python tests/helpers/fake_tools.py convert touch.csv
--out results``. FAKE_HOLD names a chunk of frames, counted from 0 in each process, at which it stops for good, so that
tests can interrupt it there.
"""

import os
import sys
import time

import numpy as np

from tactile_core import sensors
from tactile_core.jobs.frame_pass import Drawer, Tools
from tactile_core.recordings import Signals
from tactile_core.recordings.flags import Flag
from tactile_core.sensors.calibration_file import load_calibration
from tactile_core.translation.answer import Answer
from tactile_core.translation.translator import Translation

SHAPE = (320, 240)
PARENT = os.getppid()  # when this process began; another once that one has died
chunks = 0  # translated by this process


def translate(signals: Signals) -> Translation:
    """Depth of a dent in the middle: 1 um a count of the mean change; frames beyond 100 counts are out of range."""
    depth = np.abs(signals.change).mean(axis=1).astype(np.float32)
    hold()
    codes = [np.repeat(depth[:, None], size, axis=1) for size in (8, 32, 64)]
    skin, gel = _dent(sensors.biotac_surface().rest, depth), _dent(sensors.digit_surface().rest, depth)
    force = np.outer(depth, [0, 0.01, 0]).astype(np.float32)
    center = np.where(depth[:, None] > 5, np.float32([-8e-3, 0]), np.float32(np.nan))
    normal = np.where(depth[:, None] > 5, np.float32([0, 1, 0]), np.float32(np.nan))
    flags = np.where(depth > 100, Flag.OUT_OF_RANGE, 0).astype(np.uint16)
    errors = [share * depth * np.float32(1e-6) for share in (0.1, 0.1, 0.2, 0.2)]
    return Translation(
        *codes, skin, gel, force, 50 * depth, center, normal, np.exp(-depth / 100), *errors, flags, np.exp(-depth / 50),
        np.full_like(center, np.nan), np.zeros_like(force),
    )  # fmt: skip


def hold() -> None:
    """Stop for good at the chunk that FAKE_HOLD names, but no longer than the process that started this one lives."""
    global chunks
    chunks += 1
    while os.environ.get("FAKE_HOLD") == str(chunks - 1) and os.getppid() == PARENT:
        time.sleep(0.01)


def _dent(rest: np.ndarray, depth: np.ndarray) -> np.ndarray:
    shape = np.exp(-((rest[:, 0] + 8e-3) ** 2 + rest[:, 2] ** 2) / 2.5e-3**2)
    moved = np.zeros((len(depth), len(rest), 3), np.float32)
    moved[..., 1] = 1e-6 * depth[:, None] * shape
    return moved


def height_map(displacement: np.ndarray) -> np.ndarray:
    """The deepest node's height everywhere."""
    return np.broadcast_to(displacement[..., 1].max(axis=1)[:, None, None], (len(displacement), *SHAPE))


def shade(height: np.ndarray) -> np.ndarray:
    """Grey level = height in um; the left half stays black."""
    picture = np.zeros((*SHAPE, 3), np.uint8)
    picture[:, SHAPE[1] // 2 :] = np.clip(1e6 * height[0, 0], 0, 255)
    return picture


class Networks:
    """What stands for a Translator: each frame alone."""

    card, sha256, source, target = {"name": "fake"}, "0" * 64, "biotac", "digit"
    answer = Answer(frames_apart=True)

    def encode(self, signals: Signals) -> None:
        """Nothing that `decode` needs."""

    def decode(self, signals: Signals, evidence: None, state: None) -> Translation:
        return translate(signals)


def tools(source: str = "biotac", answer: Answer = Networks.answer) -> Tools:
    networks = Networks()
    networks.source, networks.answer = source, answer
    return Tools(networks, Drawer(height_map, shade, load_calibration().camera))


if __name__ == "__main__":
    from tactile_core.cli.main import main
    from tactile_core.jobs import convert

    convert.load_tools = lambda *files, **options: tools()
    sys.exit(main())
