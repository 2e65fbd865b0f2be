"""Make the table of the BioTac SP's radii, ``tactile_core/sensors/biotac_sp/profile.csv``, from its stated ellipsoids.

    python scripts/benchmarks/make/make_biotac_sp_profile.py

Outer skin: the resting ellipsoid of the COMSOL presses (docs/sources.md, BioTac SP). Inner skin: its semi-axes less the
descriptor's thickness. Core: half an ellipsoid about the model's own origin, which lies above the skin's centre. The
back, which nothing touches, is flattened (assumed), and held: there the core reaches the inner skin.
"""

from __future__ import annotations

import sys

import numpy as np

from tactile_core.files import atomic
from tactile_core.sensors import skin_of

# Dimensions in an independent COMSOL model: metres, x along the finger, y across, z away from the pad, which faces -z.
# Source: github.com/bsadr/biotac, July 2020; its presses were held against the finite-strain tier (docs/sources.md).
CORE = np.array([12.42e-3, 8.14e-3, 8.057e-3])  # m, semi-axes of the core (``comsol/matlab/Ray.m`` there)
RESTING = np.array([13.84e-3, 9.74e-3, 10.11e-3])  # m, semi-axes of the presses' skin under 1750 Pa (fitted)
RESTING_CENTRE = -0.242e-3  # m, z of its centre, likewise
BACK = 5.0  # mm, height of the back over the skin's centre (assumed)
STATIONS, ENDS = 29, 1e-3  # of each layer; mm, of the outermost ones from the poles
HEADER = "x_mm,theta_deg,r_outer_mm,r_inner_mm,r_core_mm"


def main() -> int:
    """Compute the table of the BioTac SP's radii and write it beside its descriptor; returns the exit status."""
    skin = skin_of("biotac_sp").descriptor
    atomic.write_bytes(skin.folder / skin.skin.profile, table().encode())
    return 0


def table(name: str = "biotac_sp") -> str:
    """Return a CSV text of radii, mm, by x, mm, and angle, deg. name : sensor with the skin's thickness and middle"""
    skin = skin_of(name)
    middle, thick = 1e3 * sum(skin.descriptor.skin.outer_poles) / 2, 1e3 * skin.thickness
    outer, core = 1e3 * RESTING, 1e3 * CORE
    inner = outer - thick
    turns = np.cos(np.pi * (np.arange(STATIONS) + 0.5) / STATIONS)
    x = np.unique(np.round(np.concatenate([(axes[0] - ENDS) * turns for axes in (outer, inner)]), 4))
    theta = np.radians(np.arange(-180, 180, 5))
    radii = [_radius(x, theta, axes, np.array([*axes[:2], BACK - (outer - axes)[2]])) for axes in (outer, inner)]
    held = np.abs(theta) >= np.pi / 2 - 1e-9
    below = _shifted(x, theta, core, 1e3 * RESTING_CENTRE)
    tips = np.where(np.isfinite(below), below, 0 * radii[1])  # beyond the core's apex the axis stands for it
    radii.append(np.where(held, radii[1], tips))
    lines = [
        f"{middle + at:.4f},{angle:.0f}," + ",".join(f"{layer[i, j]:.4f}" for layer in radii)
        for i, at in enumerate(x) for j, angle in enumerate(np.degrees(theta))
    ]  # fmt: skip
    return "\n".join([HEADER, *lines, ""])


def _radius(x: np.ndarray, theta: np.ndarray, front: np.ndarray, back: np.ndarray) -> np.ndarray:
    """Return the radius (stations, angles) mm, from the x axis, of two half ellipsoids about one centre; nan beyond.
    x : (stations,) mm; theta : (angles,) rad from the pad; front, back : (3,) mm, semi-axes of the pad's half, the
        other's"""
    height = np.where(np.abs(theta) <= np.pi / 2, front[2], back[2])
    across = 1 / np.hypot(np.sin(theta) / front[1], np.cos(theta) / height)
    inside = 1 - (x / front[0]) ** 2
    return np.sqrt(np.where(inside > 0, inside, np.nan))[:, None] * across


def _shifted(x: np.ndarray, theta: np.ndarray, axes: np.ndarray, centre: float) -> np.ndarray:
    """Return the distance (stations, angles) mm along rays from the skin's axis to an ellipsoid; nan if they miss it.
    x : (stations,) mm; theta : (angles,) rad from the pad; axes : (3,) mm, the ellipsoid's semi-axes
    centre : mm, height of the skin's axis over the ellipsoid's centre"""
    inside = 1 - (x / axes[0]) ** 2
    a = (np.sin(theta) / axes[1]) ** 2 + (np.cos(theta) / axes[2]) ** 2
    b = -centre * np.cos(theta) / axes[2] ** 2  # the ray goes down by cos(theta) from the height ``centre``
    c = (centre / axes[2]) ** 2 - np.where(inside > 0, inside, np.nan)[:, None]
    root = np.sqrt(np.maximum(b**2 - a * c, 0) + 0 * c)
    found = (-b + root) / a
    return np.where(found > 0, found, np.nan)


if __name__ == "__main__":
    sys.exit(main())
