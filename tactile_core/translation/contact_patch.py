"""Find the contact patch of a gel from its deformation: the one rule for all predicted patches."""

from __future__ import annotations

import numpy as np

from ..geometry.lattice import Lattice
from ..sensors.unrolling import node_normals

SMOOTH = 0.7  # cells, width of the Gaussian that keeps the curvature from following single nodes
BEND = 0.01  # of the largest curvature
DEEP = 0.1  # of the largest depth; all three chosen together on 1,500 contacts of nine indenters in the fast tier,
# where rules near this one find 86 % (intersection over union) of true patches from true deformations and depth alone
# 82 % at best; in the full tier it finds 79 % (docs/translation.md)


def contact_patch(displacement: np.ndarray, surface: Lattice) -> np.ndarray:
    """Mark (T, n) bool the nodes in contact from displacements (T, n, 3) m of a surface that is one lattice.

    A surface takes the indenter's curvature in contact and the opposite one beside it: the patch is where the smoothed
    Laplacian of the depth is negative. (The pressure on a half-space is |k| times the depth over wave numbers k; k^2 in
    its place is the local form, and measured better: thin gels damp long waves.)
    A frame dented less than ``FLOOR`` has none.
    """
    rows, columns = surface.shape
    inward = -np.einsum("tni,ni->tn", displacement, node_normals(surface.rest, surface.faces))
    depth = inward.reshape(-1, rows, columns)
    margin = ((0, 0), (_MARGIN, _MARGIN), (_MARGIN, _MARGIN))
    padded = np.pad(depth, margin)
    across = 2 * np.pi * np.fft.rfftfreq(padded.shape[2])[None, :]
    square = (2 * np.pi * np.fft.fftfreq(padded.shape[1])[:, None]) ** 2 + across**2
    bend = np.fft.irfft2(np.fft.rfft2(padded) * square * np.exp(-square * SMOOTH**2), s=padded.shape[1:])
    bend = bend[:, _MARGIN:-_MARGIN, _MARGIN:-_MARGIN]
    bent, deep = (field > share * field.max((1, 2), keepdims=True) for field, share in ((bend, BEND), (depth, DEEP)))
    touched = depth.max((1, 2), keepdims=True) > FLOOR
    return (bent & deep & touched).reshape(displacement.shape[:2])


FLOOR = 5e-6  # m: a dent less deep is no contact. It moves a picture by one level at most, where the camera's own noise
# is 2 to 3 levels (docs/sources.md, DIGIT camera): no sensor of this kind could tell it from rest.
_MARGIN = 20  # cells of rest round the lattice, so that opposite rims do not meet in the Fourier sums
