"""Solve the contacts that the networks found, on the same or another gel, in place of the gel that they translate.

From the translation come the place of the dent, the size of the force, the direction in which the deepest node moves,
and the curvature of the dented patch, unless the user knows what touched. A ball is assumed that presses in along that
direction and sticks to that node, with the friction of all contacts here (0.78): flats, rings and edges come out round,
as no network tells the object's outline. Place and force keep the networks' errors; the surface under that load has
the fast tier's alone. Place, force and lean are of the plane that all gels share, so a contact found on the DIGIT is
solved on any gel with a descriptor, without training."""

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

EXPECTED = "expected_error_digit"
ERRORS = EXPECTED, "error_bound_digit"
OUTWARD = np.array([0.0, -1.0, 0.0])  # of the gel, which is nearly flat


def check_installed() -> None:
    """Raise TactileError if scipy is missing, which solving needs."""
    if importlib.util.find_spec("scipy") is None:
        raise TactileError("--gel solved", "scipy is not installed", "scipy", f"Install it: {advice('fem')}")


def prepare(gel: str = TARGET) -> None:
    """Read a gel's compliance, or build it (a minute, once), before a recording begins; TactileError without scipy."""
    check_installed()
    compliance_of(gel)


def solved(
    arrays: dict[str, np.ndarray], gel: str = TARGET, found_on: str = TARGET, ball: float | None = None
) -> dict[str, np.ndarray]:
    """Replace the gel displacements of translated frames by those of solved contacts, each frame by itself.

    arrays : name -> (T, ...), by the names of frames.h5; frames without contact stay as they are
    gel : name of the gel that is solved; found_on : that of the gel on which the networks find contacts
    ball : radius, m, of the ball that touched; None for one as curved as the dent
    Returns the arrays with ``traction_digit`` (T, M, 3) Pa added, zero in frames that were not solved. Under a known
    ball the expected error shrinks with the dent; its bound stays. A frame without a solution keeps the networks'
    displacement and is flagged ``GEL_NOT_SOLVED``. If `gel` is not `found_on`, a frame without a solution is at rest,
    contacts beside the gel are flagged as beyond it, latents are left out, and errors, which are unknown, are NaN."""
    moved, flags, center = arrays["displacement_digit"], arrays["flags"].copy(), arrays["contact_center"]
    own = gel == found_on
    found = moved.copy() if own else np.zeros((len(moved), len(sensors.sensor_surface(gel).rest), 3), moved.dtype)
    traction = np.zeros(found.shape, np.float32)
    size = np.linalg.norm(arrays["force"], axis=1)
    for frame, contact in _contacts(moved, center, size, found_on, ball):
        try:
            solution = contact.on_gel(gel)
            found[frame], traction[frame] = solution.displacement, solution.traction
        except TactileError:  # a place off the gel, or a force that it does not bear within 60 % of its thickness
            flags[frame] |= np.uint16(Flag.GEL_NOT_SOLVED)
    changed = arrays | {"displacement_digit": found, "traction_digit": traction, "flags": flags}
    if ball is not None and EXPECTED in arrays:
        # The share of the dent stays: true errors are .77 to .90 of this on large bodies (.34 to .60 of the networks').
        dent, before = (accuracy.lengths(each).max(axis=1, initial=0.0) for each in (found, moved))
        changed[EXPECTED] = arrays[EXPECTED] * np.minimum(1.0, dent / np.maximum(before, 1e-12)).astype(np.float32)
    return changed if own else _on_another(changed, gel)


def _contacts(
    moved: np.ndarray, center: np.ndarray, size: np.ndarray, gel: str, ball: float | None
) -> Iterator[tuple[int, BodyContact]]:
    """Yield (frame, contact) for frames in contact. moved : (T, n, 3) m; center : (T, 2) = (x, z) m; size : (T,) N
    ball : radius, m, of the body; None for that of the dent"""
    surface = sensors.sensor_surface(gel)
    rest, normals, patches = surface.rest, node_normals(surface.rest, surface.faces), contact_patch(moved, surface)
    deepest = np.einsum("tni,ni->tn", moved, normals).argmin(axis=1)
    for frame in map(int, np.flatnonzero(np.isfinite(center[:, 0]) & (size > 0))):
        x, z = map(float, center[frame])
        node = deepest[frame]
        radius = ball or patch_radius((rest + moved[frame])[patches[frame]], OUTWARD)
        place = leaning(x, z, moved[frame, node].astype(float), normals[node])
        yield frame, BodyContact(Sphere(radius), place, float(size[frame]))


def _on_another(arrays: dict[str, np.ndarray], gel: str) -> dict[str, np.ndarray]:
    """Return arrays of frames solved on another gel without what holds for the networks' gel alone; see `solved`."""
    flags, (x, z) = arrays["flags"].copy(), arrays["contact_center"].T
    flags[sensors.shape_of(gel).outline_distance(x, z) <= 0] |= np.uint16(Flag.BEYOND_DIGIT)
    unknown = {name: np.full_like(arrays[name], np.nan) for name in ERRORS if name in arrays}
    return {name: values for name, values in arrays.items() if name != "latent_digit"} | unknown | {"flags": flags}


def gel_traction(arrays: dict[str, np.ndarray], gel: str = TARGET) -> dict[str, np.ndarray]:
    """Return ``traction_digit`` (T, M, 3) Pa at M nodes, and its sum ``traction_force`` (T, 3) N, of translated frames.

    arrays : name -> (T, ...), by the names of frames.h5. Solved frames have their traction. For others in contact it is
        derived: pattern and direction from the displacement, size from the networks' force, which is nearer the truth
        (on the gel a dent a tenth too shallow carries a fifth too little: docs/convert.md). It is zero elsewhere
    gel : name of the gel's sensor"""
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
    """Return a sentence on how far the size of total (T, 3) N, sums of traction, is from that of force (T, 3) N, the
    networks'. Directions are not compared: the force is that on the finger, whose pad is curved.
    solved : true if gels were solved under that force"""
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
