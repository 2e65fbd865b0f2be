"""Dimensions and constants of the BioTac SP in an independent COMSOL model; each constant with its source.

Frame of that model, metres: x along the finger, y across, z away from the pad, which faces -z. The model is a skin
between two half ellipsoids z <= 0, clamped at its rim, filled with an incompressible fluid, over a rigid core that it
does not touch. Sources: *config*, the ``config.csv`` beside each press of
github.com/bsadr/biotac; *model*, the model exported as text in ``comsol/model/biotac.m`` there (July 2020).
"""

from __future__ import annotations

import numpy as np

ELECTRODES = 24  # beside four that excite (``locations.csv`` of github.com/bsadr/biotac)
C10, C01 = 0.120342857e6, 0.0304571429e6  # Pa, two-term Mooney-Rivlin, Shore 35A (config)
BULK = 1.5e9  # Pa (model)
INITIAL_PRESSURE = 1750.0  # Pa, of the fluid before anything touches (model)
CORE = np.array([12.42e-3, 8.14e-3, 8.057e-3])  # m, semi-axes of the core (``comsol/matlab/Ray.m`` there)
RESTING = np.array([13.84e-3, 9.74e-3, 10.11e-3])  # m, semi-axes of the presses' skin under INITIAL_PRESSURE (fitted)
RESTING_CENTRE = -0.242e-3  # m, z of its centre, likewise

# m, semi-axes of the outer skin without load and what the inner ones are less, and m3 of fluid under it at
# INITIAL_PRESSURE (model, its ``vol_0``).
PUBLISHED_OUTER, PUBLISHED_THICKNESS, PUBLISHED_VOLUME = np.array([14.23e-3, 9.94e-3, 9.94e-3]), 0.2e-3, 3.0524e-6

# The presses were made with a later skin, whose dimensions are not published. Its thickness is chosen by all four
# presses at hand: with 0.2 mm the force at 50 degrees is 29 % too low, with 0.6 mm that at 30 is 10 % too high; with
# 0.47 mm the volume of 007 is 0.21 % off.
# Its semi-axes are those that INITIAL_PRESSURE swells to the resting skin of press 001, within 10 um rms.
THICKNESS = 0.46e-3
OUTER = np.array([13.928e-3, 9.647e-3, 10.151e-3])

# Forces of the presses over those of the constants above, least squares over press 001. It scales C10, C01 and the
# pressure together and leaves every shape as it is. Why the later COMSOL model is stiffer than its own constants is not
# known: scripts there name a "thick" variant, not its thickness.
FORCE_SCALE = 5.97


def core_radius(rays: np.ndarray) -> np.ndarray:
    """Return the distance (n,) m from the origin to the core's surface along rays (n, 3) of any length."""
    unit = rays / np.linalg.norm(rays, axis=-1, keepdims=True)
    return 1 / np.linalg.norm(unit / CORE, axis=-1)


def radius_along(skin: np.ndarray, rays: np.ndarray) -> np.ndarray:
    """Return the distance (n,) m from the origin to the skin along rays (n, 3); nan beside the skin.

    skin : (k, 3) m, nodes of the whole outer skin, deformed or not
    Once differentiable (Clough-Tocher) over the skin's stereographic projection from the origin.
    """
    import scipy.interpolate

    return scipy.interpolate.CloughTocher2DInterpolator(_picture(skin), np.linalg.norm(skin, axis=1))(_picture(rays))


def _picture(points: np.ndarray) -> np.ndarray:
    round_ = points / OUTER
    unit = round_ / np.linalg.norm(round_, axis=-1, keepdims=True)
    below = np.where(unit[..., 2:] < 0.5, 1 - unit[..., 2:], np.nan)  # far above the rim there is no skin
    return unit[..., :2] / below
