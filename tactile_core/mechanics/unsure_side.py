"""How far a surface may lie aside because a sharp indenter's normals are known at nodes alone.

Round an edge normals turn by a radian for each radius of way. Nodes that touch lie up to half their spacing beside the
places that would, so that forces lean by that: a wedge that meets nodes on one of its faces alone pushes a fluid-filled
skin aside as a whole.
"""

from __future__ import annotations

import numpy as np

from .fast import surface_response
from .fast.contact_state import Contact

_MOVES = 10e-6  # m, of nodes that count: as in the measured errors of shapes


def unsure_side(contact: Contact, normals: np.ndarray, radius: float) -> float:
    """Return the displacement, m rms, by the part of a contact's force aside that unsure normals may have made.

    That part is as large as nodes on other faces do not push back, at most what normals make that turn over half a
    spacing of nodes.
    normals : (n, 3), outward, of the resting surface; radius : m, of the indenter where it is sharpest
    """
    if not len(contact.nodes):
        return 0.0
    size, force = np.linalg.norm(contact.nodal_force, axis=1), float(np.linalg.norm(contact.force))
    along = size @ normals[contact.compliance.touchable[contact.nodes]]
    along /= np.linalg.norm(along)
    aside = contact.force - (contact.force @ along) * along
    sideways = float(np.linalg.norm(aside))
    if not sideways:
        return 0.0
    at = contact.compliance.surface.rest[contact.compliance.touchable]
    hardest = at[contact.nodes[int(np.argmax(size))]]
    spacing = float(np.partition(np.linalg.norm(at - hardest, axis=1), 1)[1])
    one_sided = sideways**2 / float(np.abs(contact.nodal_force @ aside).sum())  # 1: no node pushes back
    doubt = min(one_sided * sideways, force * spacing / (2 * radius))
    loads = (size / size.sum())[:, None] * (doubt / sideways * aside)
    response = surface_response.displacement(
        contact.compliance, contact.nodes, loads, contact.core_nodes, np.zeros_like(contact.core_force)
    )
    moves = np.linalg.norm(contact.displacement, axis=1) > _MOVES
    return float(np.sqrt((response[moves] ** 2).sum(axis=1).mean())) if moves.any() else 0.0
