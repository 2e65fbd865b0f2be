"""Solve the contacts that the networks found on a gel, the same or another one, in place of the gel they translate.

What is taken from a translation: the place of the dent, the size of the force, the way that the deepest node moves, and
the curvature of the dented patch. What is assumed: a ball presses in along that way and sticks to that node, with the
friction of all contacts here (0.78). So a contact is solved without the object's own outline, which no network tells:
flats, rings and edges come out round. Place and force keep the networks' errors; the surface under that load is exact
but for the fast tier's own. Place, force and lean are of the plane that all gels share, so that a contact found on the
DIGIT is solved on any gel with a descriptor, for which no networks need to be trained.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Iterator

import numpy as np

from .. import sensors
from ..errors import TactileError
from ..files.installed import advice
from ..geometry.indenters import Sphere
from ..mechanics.body_contact import BodyContact, leaning, patch_radius
from ..mechanics.fast.compliance import compliance_of
from ..recordings.flags import Flag
from ..sensors import TARGET
from ..sensors.unrolling import node_normals
from ..translation.contact_patch import contact_patch

ERRORS = "expected_error_digit", "error_bound_digit"
OUTWARD = np.array([0.0, -1.0, 0.0])  # of the gel, which is nearly flat


def check_installed() -> None:
    """Raise TactileError where the library is missing that solves contacts."""
    if importlib.util.find_spec("scipy") is None:
        raise TactileError("--gel solved", "scipy is not installed", "scipy", f"Install it: {advice('fem')}")


def prepare(gel: str = TARGET) -> None:
    """Read a gel's compliance, or build it (a minute, once), before a recording is begun."""
    check_installed()
    compliance_of(gel)


def solved(arrays: dict[str, np.ndarray], gel: str = TARGET, found_on: str = TARGET) -> dict[str, np.ndarray]:
    """Replace the gel displacements of translated frames by solved contacts, each frame by itself.

    arrays : by the names of frames.h5, T first; frames without contact are unchanged
    gel : the sensor that is solved; found_on : the one on which the networks find contacts
    Returns the arrays with ``traction_digit`` (T, M, 3) Pa added, zero in frames that were not solved. A frame without
    a solution keeps the networks' displacement and is flagged ``GEL_NOT_SOLVED``.
    Where `gel` differs from `found_on`, a frame without a solution is at rest, contacts beside the gel are flagged as
    beyond it, the networks' latents are left out, and errors, which are not known, are NaN.
    """
    moved, flags, center = arrays["displacement_digit"], arrays["flags"].copy(), arrays["contact_center"]
    own = gel == found_on
    found = moved.copy() if own else np.zeros((len(moved), len(sensors.sensor_surface(gel).rest), 3), moved.dtype)
    traction = np.zeros(found.shape, np.float32)
    size = np.linalg.norm(arrays["force"], axis=1)
    for frame, contact in _contacts(moved, center, size, found_on):
        try:
            solution = contact.on_gel(gel)
            found[frame], traction[frame] = solution.displacement, solution.traction
        except TactileError:  # a place off the gel, or a force that it does not bear within 60 % of its thickness
            flags[frame] |= np.uint16(Flag.GEL_NOT_SOLVED)
    changed = arrays | {"displacement_digit": found, "traction_digit": traction, "flags": flags}
    return changed if own else _on_another(changed, gel)


def _contacts(moved: np.ndarray, center: np.ndarray, size: np.ndarray, gel: str) -> Iterator[tuple[int, BodyContact]]:
    """Yield frames that touch and their contacts, read off a gel displaced by (T, n, 3) m; see the module.

    center : (T, 2) = (x, z) m, NaN without contact; size : (T,) N, of the force
    """
    surface = sensors.sensor_surface(gel)
    rest, normals, patches = surface.rest, node_normals(surface.rest, surface.faces), contact_patch(moved, surface)
    deepest = np.einsum("tni,ni->tn", moved, normals).argmin(axis=1)
    for frame in map(int, np.flatnonzero(np.isfinite(center[:, 0]) & (size > 0))):
        x, z = map(float, center[frame])
        node = deepest[frame]
        radius = patch_radius((rest + moved[frame])[patches[frame]], OUTWARD)
        place = leaning(x, z, moved[frame, node].astype(float), normals[node])
        yield frame, BodyContact(Sphere(radius), place, float(size[frame]))


def _on_another(arrays: dict[str, np.ndarray], gel: str) -> dict[str, np.ndarray]:
    """Remove from frames solved on another gel the values that hold for the networks' gel alone."""
    flags, (x, z) = arrays["flags"].copy(), arrays["contact_center"].T
    flags[sensors.shape_of(gel).outline_distance(x, z) <= 0] |= np.uint16(Flag.BEYOND_DIGIT)
    unknown = {name: np.full_like(arrays[name], np.nan) for name in ERRORS if name in arrays}
    return {name: values for name, values in arrays.items() if name != "latent_digit"} | unknown | {"flags": flags}
