"""Force field of a translated gel: the traction on its surface, and the force that it adds up to."""

from __future__ import annotations

import numpy as np

from .. import accuracy, sensors
from ..mechanics.inverse_contact import pressing_traction
from ..mechanics.node_areas import node_areas
from ..sensors import TARGET
from ..translation.contact_patch import contact_patch


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

    solved : whether gels were solved under that force, rather than translated beside it
    """
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
