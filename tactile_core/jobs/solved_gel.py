"""Solve the contacts that the networks found on the DIGIT's gel, in place of the gel that they translate.

What is taken from a translation: the place of the dent, the size of the force, the way that the deepest node moves, and
the curvature of the dented patch. What is assumed: a ball presses in along that way and sticks to that node, with the
friction of all contacts here (0.78). So a contact is solved without the object's own outline, which no network tells:
flats, rings and edges come out round. Place and force keep the networks' errors; the surface under that load is exact
but for the fast tier's own.
"""

from __future__ import annotations

import importlib.util

import numpy as np

from .. import sensors
from ..errors import TactileError
from ..files.installed import advice
from ..geometry.indenters import Sphere
from ..mechanics.body_contact import BodyContact, leaning, patch_radius
from ..mechanics.fast.compliance import digit_compliance
from ..recordings.flags import Flag
from ..sensors.unrolling import node_normals
from ..translation.contact_patch import contact_patch

OUTWARD = np.array([0.0, -1.0, 0.0])  # of the gel, which is nearly flat


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
    surface = sensors.digit_surface()
    rest, normals, patches = surface.rest, node_normals(surface.rest, surface.faces), contact_patch(gel, surface)
    deepest = np.einsum("tni,ni->tn", gel, normals).argmin(axis=1)
    for frame in np.flatnonzero(np.isfinite(arrays["contact_center"][:, 0]) & (size > 0)):
        x, z = map(float, arrays["contact_center"][frame])
        radius = patch_radius((rest + gel[frame])[patches[frame]], OUTWARD)
        node = deepest[frame]
        place = leaning(x, z, gel[frame, node].astype(float), normals[node])
        contact = BodyContact(Sphere(radius), place, float(size[frame]))
        try:
            found = contact.on_gel()
        except TactileError:  # a place off the gel, or a force that it does not bear within 60 % of its thickness
            flags[frame] |= np.uint16(Flag.GEL_NOT_SOLVED)
        else:
            gel[frame] = found.displacement
    return arrays | {"displacement_digit": gel, "flags": flags}
