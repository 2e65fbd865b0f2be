"""Force field of a translated gel: the traction on its surface, and the force that it adds up to."""

from __future__ import annotations

import numpy as np

from .. import accuracy, sensors
from ..mechanics.inverse_contact import pressing_traction
from ..mechanics.node_areas import node_areas
from ..sensors import TARGET
from ..translation.contact_patch import contact_patch


def gel_traction(displacement: np.ndarray, touched: np.ndarray, gel: str = TARGET) -> dict[str, np.ndarray]:
    """Return arrays ``traction_digit`` (T, M, 3) Pa, ``traction_force`` (T, 3) N of gels displaced by (T, M, 3) m.

    touched : (T,) bool, frames in contact; the others are zero; gel : the sensor
    """
    traction = np.zeros(displacement.shape, np.float32)
    frames = np.flatnonzero(touched)
    patches = contact_patch(displacement[frames], sensors.sensor_surface(gel)) if len(frames) else ()
    for frame, patch in zip(frames, patches, strict=True):
        traction[frame] = pressing_traction(gel, displacement[frame].astype(float), patch)
    total = np.einsum("tnk,n->tk", traction, node_areas(gel))
    return {"traction_digit": traction, "traction_force": total.astype(np.float32)}


def describe_miss(total: np.ndarray, force: np.ndarray) -> str:
    """Say by how much tractions that add up to (T, 3) N miss the force (T, 3) N that the networks estimate."""
    size = accuracy.lengths(force)
    pressed = size > 0
    if not pressed.any():
        return "no frame is in contact, so the traction is zero"
    half, most = np.percentile(accuracy.lengths(total - force)[pressed] / size[pressed], [50, 90])
    return (
        f"the gel's traction adds up to a force within {half:.0%} of the networks' in half of the frames in contact, "
        f"{most:.0%} in 9 of 10: they are two estimates, traction_force and force"
    )
