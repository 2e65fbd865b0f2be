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

from .. import accuracy, sensors
from ..errors import TactileError
from ..files.installed import advice
from ..geometry.indenters import Sphere
from ..mechanics.fast.compliance import compliance_of
from ..mechanics.node_areas import node_areas
from ..mechanics.skin_contact import BodyContact, leaning, patch_radius, pressing_traction
from ..recordings.flags import Flag
from ..sensors import TARGET
from ..sensors.unrolling import node_normals
from ..translation.gel_place import contact_patch

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
    """Yield touching frames and their contacts, of gels (T, n, 3) m, places (T, 2) m and sizes of force (T,) N."""
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


def gel_traction(arrays: dict[str, np.ndarray], gel: str = TARGET) -> dict[str, np.ndarray]:
    """Return arrays ``traction_digit`` (T, M, 3) Pa, ``traction_force`` (T, 3) N of translated frames.

    arrays : by the names of frames.h5, T first; frames that were solved bring their traction, for the others it is
        found from their displacement where they are in contact, and zero elsewhere. Its pattern and direction are the
        displacement's, its size is that of the networks' force: on the gel a dent a tenth too shallow carries a fifth
        too little, and of the two the force is nearer the truth (docs/convert.md)
    gel : the sensor
    """
    displacement, touched = arrays["displacement_digit"], np.isfinite(arrays["contact_center"][:, 0])
    solved = arrays.get("traction_digit")
    traction = np.zeros(displacement.shape, np.float32) if solved is None else solved
    frames = np.flatnonzero(touched & ~traction.any(axis=(1, 2)))
    patches = contact_patch(displacement[frames], sensors.sensor_surface(gel)) if len(frames) else ()
    for frame, patch in zip(frames, patches, strict=True):
        found = pressing_traction(gel, displacement[frame].astype(float), patch)
        carried = accuracy.lengths(node_areas(gel) @ found)
        if carried > 0:
            traction[frame] = found * (accuracy.lengths(arrays["force"][frame]) / carried)
    total = np.einsum("tnk,n->tk", traction, node_areas(gel))
    return {"traction_digit": traction, "traction_force": total.astype(np.float32)}


def describe_miss(total: np.ndarray, force: np.ndarray, solved: bool = False) -> str:
    """Say by how much tractions that add up to (T, 3) N miss the size of the force (T, 3) N that the networks estimate.
    Their directions are not compared: the force is the one on the finger, whose pad is curved.
    solved : whether gels were solved under that force, rather than translated beside it"""
    size, carried = accuracy.lengths(force), accuracy.lengths(total)
    pressed = size > 0
    if not pressed.any():
        return "no frame is in contact, so the traction is zero"
    half, most = np.percentile((np.abs(carried - size) / np.where(pressed, size, 1))[pressed], [50, 90])
    if solved:
        return (
            f"the gel's traction adds up to a force as large as the networks' within {half:.1%} in half of the frames "
            f"in contact, {most:.1%} in 9 of 10: it was solved under that force, along the way that the dent moves"
        )
    without = int((pressed & (carried == 0)).sum())
    told = f"; {without} of {int(pressed.sum())} frames with a force show no patch that is pressed" if without else ""
    return f"the gel's traction is scaled to add up to a force as large as the networks'{told}"
