"""A baseline after Taxim (Si and Yuan, IEEE RA-L 7, 2022): a table of polynomials over the slope of the gel.

The change of a pixel is a quadratic polynomial of its place, with coefficients from a table over the slope's size and
direction; no lights, no shadows, no perspective. Written here to be measured beside the physical model: it is fitted
on the same photographs and gets their balls' places and depths from the calibration, where Taxim's users mark circles.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from tactile_core.pictures.calibrate.ball_pictures import BallPictures, FastPictures, working_factor
from tactile_core.pictures.calibrate.photo_metrics import metrics
from tactile_core.pictures.calibrate.photographs import Photographs
from tactile_core.pictures.calibrate.press_fit import Sight, fit_ball
from tactile_core.pictures.perspective import slopes
from tactile_core.sensors.calibration import Calibration

SIZES, DIRECTIONS = 40, 72  # bins; Taxim's own 125 x 125 leave most bins of nine presses empty
STEEPEST = np.radians(70.0)
RIDGE = 0.3  # of a bin's samples, so that bins which saw one side of the picture do not run away on the other
BLUR = np.array([1, 2, 1]) / 4  # of samples over neighbouring bins, twice


@dataclasses.dataclass(frozen=True)
class Table:
    """coefficients : (SIZES, DIRECTIONS, 6, 3) grey levels of 1, x, y, x^2, xy, y^2, by channel"""

    coefficients: np.ndarray


class TableBench:
    """Stands in for ``BallPictures`` where balls are fitted: the same geometry, the table's picture."""

    def __init__(self, bench: BallPictures, table: Table) -> None:
        self.right, self.down, self.camera, self.deepest = bench.right, bench.down, bench.camera, bench.deepest
        self._bench, self._table = bench, table
        self._terms = _terms(bench)

    def change(self, ball: tuple[float, float, float, float]) -> np.ndarray:
        """Change (H, W, 3) of the picture by a press, grey levels."""
        return np.einsum("hwk,hwkc->hwc", self._terms, self._table.coefficients[_bins(self._bench, ball)])


def fit_table(calibration: Calibration, photographs: Photographs, radius: float) -> Table:
    """The table of a set of presses of a ball of ``radius`` m, placed by the calibration."""
    bench = _working(calibration)
    terms = _terms(bench)
    matrix = np.zeros((SIZES, DIRECTIONS, 6, 6))
    right_side = np.zeros((SIZES, DIRECTIONS, 6, 3))
    for press in photographs.presses:
        sight = Sight(press)
        ball, _ = fit_ball(bench, sight, radius)
        size, direction = (values[sight.counts] for values in _bins(bench, ball))
        features, change = terms[sight.counts], sight.change[sight.counts]
        np.add.at(matrix, (size, direction), features[:, :, None] * features[:, None])
        np.add.at(right_side, (size, direction), features[:, :, None] * change[:, None])
    matrix, right_side = (_blurred(_blurred(values)) for values in (matrix, right_side))
    count = matrix[..., :1, :1]
    ridge = np.diag([1e-9, *[RIDGE] * 5]) * (count + 1) + 1e-3 * np.eye(6)
    return Table(np.linalg.solve(matrix + ridge, right_side))


def try_table(table: Table, calibration: Calibration, photographs: Photographs, radius: float) -> list[dict]:
    """The metrics of ``tactile calibrate --test`` but for the radius, one a press."""
    working = TableBench(_working(calibration), table)
    whole = TableBench(FastPictures(calibration), table)
    found = []
    for press in photographs.presses:
        ball, _ = fit_ball(working, Sight(press), radius)
        picture = np.rint(photographs.background + press.drift + whole.change(ball)).clip(0, 255)
        found.append(metrics(picture, press.picture, photographs.background, press.region))
    return found


def _working(calibration: Calibration) -> BallPictures:
    camera = calibration.camera
    factor = working_factor(camera.width, camera.height)
    return FastPictures(calibration.at_size(camera.width // factor, camera.height // factor))


def _terms(bench: BallPictures) -> np.ndarray:
    """1, x, y, x^2, xy, y^2 (H, W, 6) of image coordinates in units of about half the picture."""
    x, y = bench.right / 8e-3, bench.down / 8e-3
    return np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], -1)


def _bins(bench: BallPictures, ball: tuple[float, float, float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Bins (H, W) of the size and direction of the slope that the press adds."""
    rise = bench.heights(ball) - bench.rest
    along_right, along_down = slopes(rise, bench.camera)
    size = np.arctan(np.hypot(along_right, along_down)) / STEEPEST * SIZES
    direction = (np.arctan2(along_down, along_right) / (2 * np.pi) + 0.5) * DIRECTIONS
    return np.minimum(size.astype(int), SIZES - 1), direction.astype(int) % DIRECTIONS


def _blurred(values: np.ndarray) -> np.ndarray:
    across = sum(weight * np.roll(values, k - 1, 1) for k, weight in enumerate(BLUR))
    padded = np.concatenate([across[:1], across, across[-1:]])
    return sum(weight * padded[k : k + len(values)] for k, weight in enumerate(BLUR))
