"""Solve the contacts that the networks found on the DIGIT's gel, in place of the gel that they translate.

What is taken from a translation: the place of the dent, the force, and the curvature of the dented patch. What is
assumed: a ball presses straight in along the dome's normal, with the friction of all contacts here (0.78). So a contact
is solved without tilt and without the object's own outline, which no network tells: flats, rings and edges come out
round. Place and force keep the networks' errors; the surface under that load is exact but for the fast tier's own.
"""

from __future__ import annotations

import importlib.util

import numpy as np

from .. import sensors
from ..errors import TactileError
from ..files.installed import advice
from ..geometry.indenters import Sphere
from ..mechanics.fast.compliance import digit_compliance
from ..mechanics.placement import Placement
from ..mechanics.solve import solve
from ..recordings.flags import Flag
from ..translation.contact_patch import contact_patch

# m, of the ball: half of the smallest and twice of the largest rounding that networks are trained on (assumed).
RADII = 1.5e-3, 14e-3
LEAST_NODES = 8  # of a patch, twice what a paraboloid needs; smaller ones take the usual radius
USUAL_RADIUS = 4e-3  # m, the median of translated patches of the test contacts


def check_installed() -> None:
    """Raise TactileError where the library is missing that solves contacts."""
    if importlib.util.find_spec("scipy") is None:
        raise TactileError("--gel solved", "scipy is not installed", "scipy", f"Install it: {advice('fem')}")


def prepare() -> None:
    """Read the gel's compliance, or build it (a minute, once), before a recording is begun."""
    check_installed()
    digit_compliance()


def solved(arrays: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Replace the gels of translated frames, by the names of frames.h5, T first; frames without contact stay.

    A frame that has no solution keeps the networks' gel and is flagged ``GEL_NOT_SOLVED``. Each is solved by itself.
    """
    gel, flags = arrays["displacement_digit"].copy(), arrays["flags"].copy()
    size = np.linalg.norm(arrays["force"], axis=1)
    patches = contact_patch(gel, sensors.digit_surface())
    for frame in np.flatnonzero(np.isfinite(arrays["contact_center"][:, 0]) & (size > 0)):
        place = Placement(*map(float, arrays["contact_center"][frame]))
        ball = Sphere(patch_radius(gel[frame], patches[frame]))
        try:
            found = solve("digit", ball, place, force=float(size[frame]))
        except TactileError:  # a place off the gel, or a force that it does not bear within 60 % of its thickness
            flags[frame] |= np.uint16(Flag.GEL_NOT_SOLVED)
        else:
            gel[frame] = found.displacement
    return arrays | {"displacement_digit": gel, "flags": flags}


def patch_radius(displacement: np.ndarray, patch: np.ndarray) -> float:
    """Radius, m, of the ball whose paraboloid fits a dented patch best, within ``RADII``.

    displacement : (M, 3) m of the DIGIT's nodes; patch : (M,) bool, those in contact
    """
    if patch.sum() < LEAST_NODES:
        return USUAL_RADIUS
    points = sensors.digit_surface().rest[patch] + displacement[patch]
    x, y, z = (points - points.mean(axis=0)).T
    terms = np.stack([np.ones_like(x), x, z, 0.5 * (x * x + z * z)], axis=1)
    curvature = -np.linalg.lstsq(terms, y, rcond=None)[0][3]  # 1/m; the ball's deepest point has the largest y
    return float(1 / np.clip(curvature, 1 / RADII[1], 1 / RADII[0]))
