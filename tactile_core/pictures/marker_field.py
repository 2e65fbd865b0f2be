"""Printed dots of a gel in the camera's picture: they move and stretch with the surface."""

from __future__ import annotations

import numpy as np

from ..errors import TactileError
from ..sensors.calibration import Calibration
from .height_map import gel_mapper

LEAST_AREA = 1e-3  # px^2, of a dot seen from its edge: none is drawn


class MarkerField:
    """Dots printed on a unit's gel, numbered row by row from the picture's upper left. Raises TactileError for a unit
    without dots, or whose grid of dots reaches beyond the even part of the gel's surface."""

    def __init__(self, unit: Calibration) -> None:
        if unit.markers is None:
            raise TactileError("calibration, markers", "missing", "a [markers] table", "See docs/optics.md")
        self.unit, self._mapper = unit, gel_mapper(unit.camera)
        markers, camera = unit.markers, unit.camera
        self._dark = 1 - markers.albedo  # share of light that ink takes
        down, right = (markers.pitch * (np.arange(n) - (n - 1) / 2) for n in (markers.rows, markers.columns))
        along, across = camera.centre_x + camera.down_x * down, camera.centre_z + camera.right_z * right
        x, z = np.meshgrid(along, across, indexing="ij")
        # The middles, and where each dot's rim lies along and across the finger: all follow the surface.
        radius = markers.diameter / 2
        steps = radius * np.array([[0, 0], [1, 0], [-1, 0], [0, 1], [0, -1]])
        self._x, self._z = (place.ravel() + steps[:, k, None] for k, place in enumerate((x, z)))
        if not self._mapper.covers(self._x, self._z):
            found = f"{markers.rows} x {markers.columns} dots, {1e3 * markers.pitch:g} mm apart"
            advice = "Take fewer, or closer"
            raise TactileError("calibration, markers", found, "a grid on the even part of the gel", advice)
        still = np.zeros_like(self._mapper.surface.rest)
        self._dome = self._mapper.follow(still, self._x.ravel(), self._z.ravel())[2]  # of the public mesh
        self.rest = self._in_picture(still)[0]

    def motion(self, displacement: np.ndarray) -> np.ndarray:
        """Return the motion (T, n, 2) float32, px right and down, of n dots under displacement (T, n_nodes, 3) m."""
        moved = [self._in_picture(frame)[0] - self.rest for frame in displacement]
        return np.stack(moved).astype(np.float32) if moved else np.zeros((0, *self.rest.shape), np.float32)

    def marks(self, displacement: np.ndarray) -> np.ndarray:
        """Return the share (H, W) float32 of light that dots leave, on a gel under displacement (n_nodes, 3) m."""
        share = np.ones(self.unit.camera.shape, np.float32)
        middle, *rim = self._in_picture(displacement)
        # Columns: half of the dot's image along x and along z, px.
        axes = np.stack([(rim[0] - rim[1]) / 2, (rim[2] - rim[3]) / 2], -1)
        for place, axis in zip(middle, axes, strict=True):
            self._darken(share, place, axis)
        return share

    def _in_picture(self, displacement: np.ndarray) -> np.ndarray:
        """Return positions (5, n, 2) px, right and down, of the n dots' middles and four points of their rims, on a gel
        under displacement (n_nodes, 3) m."""
        camera, mapper = self.unit.camera, self._mapper
        x, z, height = mapper.follow(displacement, self._x.ravel(), self._z.ravel())
        row, column = camera.to_pixel(x, z, height - (1 - self.unit.dome_scale) * self._dome)
        return np.stack([column, row], -1).reshape(*self._x.shape, 2)

    def _darken(self, share: np.ndarray, place: np.ndarray, axes: np.ndarray) -> None:
        """Multiply ``share`` (H, W) of light left, in place, by what one dot's ellipse leaves of it in each pixel.
        place : (2,) px, the ellipse's middle, right and down; axes : (2, 2) px, matrix from a unit disc to it"""
        area = abs(np.linalg.det(axes))
        if area < LEAST_AREA:
            return
        reach = np.hypot(*axes.T) + 1  # of the ellipse's box, and the pixel that its rim runs through
        height, width = share.shape
        low = np.maximum(np.floor(place - reach).astype(int), 0)
        high = np.minimum(np.ceil(place + reach).astype(int) + 1, [width, height])
        if (low >= high).any():
            return
        at = np.stack(np.meshgrid(np.arange(low[0], high[0]), np.arange(low[1], high[1])), -1) - place
        out = np.linalg.norm(at @ np.linalg.inv(axes).T, axis=-1) - 1
        covered = np.clip(0.5 - out * np.sqrt(area), 0, 1)  # a rim is straight across a pixel
        share[low[1] : high[1], low[0] : high[0]] *= (1 - self._dark * covered).astype(np.float32)
