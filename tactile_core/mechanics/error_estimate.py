"""Estimate a contact's error: the one measured at its depth, enlarged for a sharper or smaller contact.

The errors by depth (``expected_error``) were measured on indenters that the meshes resolve.
"""

from __future__ import annotations

import functools
import json
import math
from typing import Any

import numpy as np

from ..files.shipped import shipped
from .fast.compliance_rows import surface_motion
from .fast.contact_state import Contact
from .penetration import RESOLVED_RADIUS

Errors = tuple[float, float]  # shape, m rms, and relative, of the force

_ROUNDING = 1e-9  # m, of first touch
# A contact of a few nodes is known to about one of them: a 7 mm ball 1, 2, 4, 8, 16, 32 um deep in the gel was 78, 12,
# 2, 8, 2, 2 % off Hertz's force.
_FEW = 20
# Nodes across a contact, 2 sqrt(radius of curvature x depth) over their spacing: 8.4 to 10.6 under a 7 mm ball in the
# gel, whose shape was 1.5 um off the reference tier and its force up to 1 %. Errors grow with the spacing's square: a
# ring of 2.8 nodes was 8.7 um and 1.6 % off, two balls of 3.9 nodes 5.0 um and 3.0 %, a wedge of 1.5
# nodes 56 um and 4.5 %; 2 um covers them all.
_ACROSS, _SHAPE, _FORCE = 8.0, 2e-6, 0.01
# Penetration between nodes, m, above which it bounds the errors: the force's by penetration over depth, the shape's by
# 0.35 times it, rms. Against half the spacing, that held for 41 of 44 forces and all shapes (six indenters, with
# friction and without); the bounds above for 16 of the forces.
_HIDDEN, _HIDDEN_SHAPE, _HIDDEN_FORCE = 100e-6, 0.35, 1.0
TABLE = shipped("mechanics_tiers.json")
_UNKNOWN = {"bins": [{"depth_share_to": math.inf, "shape_95_um": math.nan, "force_95": math.nan}]}
_COUNTS = 10e-6  # m, of nodes that count: as in the measured errors of shapes
REFERENCE_SHARE = 1 / 3  # of the full tier's error (assumed: halving cells of order 2 leaves a quarter; a margin on it)


def of_fast(table: Errors, depth: float, nodes: int, radius: float) -> Errors:
    """Return ``table``, the fast tier's errors at a contact's depth (shape m, force relative), enlarged for a sharp
    indenter by sqrt(1.5 mm / ``radius``). radius : m, the indenter's least radius of curvature
    nodes : number that touch; if none does, the errors are ``depth``, m, and 1, or 0 at first touch"""
    if not nodes:
        return _of_nothing(depth)
    sharper = math.sqrt(max(RESOLVED_RADIUS / radius, 1.0))
    return sharper * table[0], min(sharper * table[1], 1.0)


def of_finite_strain(table: Errors, depth: float, nodes: int, across: float, hidden: float) -> Errors:
    """Return ``table``, the full or reference tier's errors at a contact's depth (shape m, force relative), enlarged if
    few nodes touch or the indenter cuts in between them.
    nodes : number that touch; if none does, the errors are ``depth``, m, and 1, or 0 at first touch
    across : nodes across the contact, at the full tier's spacing; hidden : m, the indenter's penetration between nodes
    """
    if not nodes:
        return _of_nothing(depth)
    coarser = max(_ACROSS / max(across, 1e-3), 1.0) ** 2
    few = 1 / nodes if nodes < _FEW else 0.0
    shape, force = (coarser * least if coarser > 1 else 0.0 for least in (_SHAPE, _FORCE))
    if hidden > _HIDDEN:
        shape, force = max(shape, _HIDDEN_SHAPE * hidden), max(force, _HIDDEN_FORCE * hidden / depth)
    return max(table[0], shape), min(max(table[1], force, few), 1.0)


def _of_nothing(depth: float) -> Errors:
    """Return the errors (shape m, force relative) of a contact ``depth``, m, deep whose indenter touches no node
    because it lies between them: that depth and 1; 0 at first touch."""
    return (depth, 1.0) if depth > _ROUNDING else (0.0, 0.0)


@functools.cache
def measured() -> dict[str, Any]:
    """Read the table of measured errors: ["tiers"][tier][sensor] holds ``ms`` per contact and ``bins`` by depth."""
    return json.loads(TABLE.read_text(encoding="utf-8"))


def expected_error(tier: str, sensor: str, share: float) -> tuple[float, float]:
    """Return the errors that 95 of 100 contacts at a depth stay below: of shape, m rms, and relative, of force.
    tier : ``fast``, ``full`` or ``reference``; share : the depth over the sensor's thickness; 0 has no errors
    The fast tier's errors are against the full tier, whose own are not included. Deeper than the deepest measured bin,
    that bin's errors are returned; NaN for a sensor whose errors nobody has measured."""
    if share <= 0:
        return 0.0, 0.0
    bins = measured()["tiers"][tier].get(sensor, _UNKNOWN)["bins"]
    found = next((each for each in bins if share <= each["depth_share_to"]), bins[-1])
    return 1e-6 * found["shape_95_um"], found["force_95"]


def unsure_side(contact: Contact, normals: np.ndarray, radius: float) -> float:
    """Estimate the sideways error of shape, m rms, of a contact with a sharp indenter; 0 without contact.
    The solver knows the indenter's normals at nodes alone. Round an edge of radius r they turn by 1 rad on a way of r,
    and a node touches up to half a spacing beside the true place, so its force leans wrongly: a wedge that meets nodes
    with one of its faces alone pushes a fluid-filled skin aside as a whole. In doubt is the part of the sideways force
    that no node on another face balances, at most what normals off by half a spacing can make. The estimate is the
    displacement under that part, over nodes that the contact moves by more than 10 um.

    contact : of the fast tier; normals : (n, 3), outward, of the resting surface, all nodes
    radius : m, of curvature where the indenter is sharpest"""
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
    no_core_force = np.zeros_like(contact.core_force)
    response = surface_motion(contact.compliance, contact.nodes, loads, contact.core_nodes, no_core_force)
    moves = np.linalg.norm(contact.displacement, axis=1) > _COUNTS
    return float(np.sqrt((response[moves] ** 2).sum(axis=1).mean())) if moves.any() else 0.0
