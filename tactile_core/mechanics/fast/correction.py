"""Correct the fast tier's linear model by the full tier: a learned factor of force and a field of shape.

Both are smooth functions of features of the fast contact (depth, patch, place, lean, fluid), found by kernel ridge
regression; the indenter's shape is no input. The field is a sum of a few learned fields in a frame that moves with the
contact and is scaled by its size. ``scripts/benchmarks/make/learn_correction.py`` learns both.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable
from typing import NamedTuple, TypeVar

import numpy as np

from ... import sensors
from ...files.compiled import Loop
from ...files.shipped import shipped
from ...sensors import unrolling
from .compliance import Compliance
from .contact_state import Contact

_Answer = TypeVar("_Answer", float, np.ndarray)

REACH = 12.0  # patch radii, how far the learned fields go; they fade over the last of their cells
LINES = 33  # of their grid, even in asinh(distance / radius): fine at the patch, coarse far from it
_SMALLEST_RADIUS = 0.3e-3  # m, added to a patch's: one touching node has a size, too
# Nodal forces across the normals, over the whole force: 0.0001 without friction (0.04 at most); 0.027 at
# least with 0.78, of 1,187 contacts of nine indenters.
_SIDEWAYS, _STILL, _RUBS = 19, 0.005, 0.025
_ALIKE = 1.0  # on held-out presses 0.5 and 3 did as well; with 0 forces with friction were a fifth farther off
# Features that a force is estimated from, twice: the mean of both was nearer on held-out presses than either.
ALL, ESSENTIAL = slice(None), np.array([0, 2, 4, 15, 16, 18, 19])  # depth, force, radius, core, ..., friction
FILE = "mechanics_correction.npz"


@dataclasses.dataclass(frozen=True)
class PatchFrame:
    """Frame of a contact's patch: its centre (2,) = (x, z) m on the unrolled surface, and its radius m."""

    centre: np.ndarray
    radius: float


@dataclasses.dataclass(frozen=True)
class Learned:
    """A sensor's correction, without friction or with: a force factor, and a displacement field that is a sum of k
    learned ones on a grid of g = 33 x 33 places. Both by kernel ridge regression on f features of a contact.
    shift, scale : (f,); a scaled feature is (feature - shift) / scale; supports : (n, f), of the contacts learned from
    support_rubs : (n,), amount of friction in these, 0 to 1 (``rubs``)
    widths : (3,), of the kernels of force on all features, on 7 of them (depth, force, radius, ...), and of fields
    force_weights : (2, n), of two estimates of the log of the force factor, then averaged; field_weights : (n, k)
    fields : (k, g, 3), per metre of depth, in each surface node's own axes (``node_frames``)
    trust : (bins, 3), depth over thickness, and how much of the predicted log and field is applied there, 0 to 1
    """

    shift: np.ndarray
    scale: np.ndarray
    supports: np.ndarray
    support_rubs: np.ndarray
    widths: np.ndarray
    force_weights: np.ndarray
    field_weights: np.ndarray
    fields: np.ndarray
    trust: np.ndarray

    def log_factor(self, features: np.ndarray) -> float:
        """Return the log of the factor by which to multiply the linear model's force; features : (f,), not scaled"""
        every = self._near(features, ALL, self._all, self.widths[0]) @ self.force_weights[0]
        few = self._near(features, ESSENTIAL, self._few, self.widths[1]) @ self.force_weights[1]
        return self._trusted(features, 1) * float(every + few) / 2

    def field(self, features: np.ndarray) -> np.ndarray:
        """Return the displacement to add on the grid (g, 3), per metre of depth; features : (f,), not scaled"""
        near = self._near(features, ALL, self._all, self.widths[2])
        return self._trusted(features, 2) * np.tensordot(near @ self.field_weights, self.fields, 1)

    def _near(self, features: np.ndarray, parts: slice | np.ndarray, supports: _Supports, width: float) -> np.ndarray:
        scaled = ((features - self.shift) / self.scale)[None, parts]
        return kernel(scaled, *supports, width)[0] * alike(rubs(features), self.support_rubs)

    @functools.cached_property
    def _all(self) -> _Supports:
        return _Supports(self.supports, squares(self.supports))

    @functools.cached_property
    def _few(self) -> _Supports:
        few = np.ascontiguousarray(self.supports[:, ESSENTIAL])
        return _Supports(few, squares(few))

    def _trusted(self, features: np.ndarray, column: int) -> float:
        return float(np.interp(features[0], self.trust[:, 0], self.trust[:, column]))


@dataclasses.dataclass(frozen=True)
class Correction:
    """Correction of one sensor, interpolated by friction from ``still`` (none) to ``rubbing`` (coefficient 0.78)."""

    still: Learned
    rubbing: Learned

    def factor(self, features: np.ndarray) -> float:
        """Return the factor by which to multiply the linear model's force; features : (f,), not scaled"""
        return float(np.exp(self._blend(features, Learned.log_factor)))

    def field(self, features: np.ndarray) -> np.ndarray:
        """Return the displacement to add on the grid (g, 3), per metre of depth; features : (f,), not scaled"""
        return self._blend(features, Learned.field)

    def _blend(self, features: np.ndarray, of: Callable[[Learned, np.ndarray], _Answer]) -> _Answer:
        share = float(rubs(features))
        if share in (0, 1):
            return of(self.rubbing if share else self.still, features)
        return (1 - share) * of(self.still, features) + share * of(self.rubbing, features)


class _Supports(NamedTuple):
    """Scaled features (n, j) and their ``squares``."""

    features: np.ndarray
    squares: np.ndarray


def squares(features: np.ndarray) -> np.ndarray:
    """Return the sums (n,) of the squares of scaled features (n, f), which ``kernel`` takes."""
    return (features**2).sum(axis=1)


def kernel(a: np.ndarray, b: np.ndarray, b_squares: np.ndarray, width: float) -> np.ndarray:
    """Return the kernel (n, m), inverse multiquadric plus linear, of scaled features a (n, f) and b (m, f).
    b_squares : (m,), of ``squares(b)``; width : in scaled features"""
    products = a @ b.T
    apart = squares(a)[:, None] + b_squares - 2 * products
    return 1 / np.sqrt(1 + np.maximum(apart, 0) / width**2) + 0.1 * (products / a.shape[1] + 1)


def rubs(features: np.ndarray) -> np.ndarray:
    """Return how much friction contacts with features (..., f) have: 0 none, 1 as much as was learned from."""
    return np.clip((features[..., _SIDEWAYS] - _STILL) / (_RUBS - _STILL), 0.0, 1.0)


def alike(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the kernel's factor for amounts of friction a and b, 0 to 1: larger if both have some, or none."""
    return 1 + _ALIKE * (a * b + (1 - a) * (1 - b))


@functools.cache
def plane(sensor: str) -> np.ndarray:
    """Return the unrolled places (n, 2) = (x, z) m of a sensor's surface nodes, those of a BioTac's back too."""
    if sensors.is_gel(sensor):
        return sensors.sensor_surface(sensor).rest[:, [0, 2]]
    ends = [[unrolling.rolled_x(sensor)[0], 0.0], [unrolling.rolled_x(sensor)[-1], 0.0]]
    return np.concatenate([unrolling.rolled_grid(sensor).reshape(-1, 2), ends])


@functools.cache
def node_frames(sensor: str) -> np.ndarray:
    """Return each surface node's axes (n, 3, 3), unit vectors in columns: along the finger, outward, across."""
    if sensors.is_gel(sensor):
        axes = np.array([[1.0, 0, 0], [0, -1.0, 0], [0, 0, 1.0]])
        return np.broadcast_to(axes, (len(sensors.sensor_surface(sensor).rest), 3, 3))
    outward = sensors.rest_normals(sensor)
    along = np.array([1.0, 0, 0]) - outward[:, :1] * outward
    length = np.linalg.norm(along, axis=1, keepdims=True)
    along = np.where(length > 1e-3, along / np.maximum(length, 1e-3), [0.0, 1.0, 0.0])
    return np.stack([along, outward, np.cross(along, outward)], -1)


def frame(compliance: Compliance, contact: Contact) -> PatchFrame:
    """Return the frame of a contact: about the centre of its forces, with the radius of its patch."""
    places = plane(compliance.name)[compliance.touchable[contact.nodes]]
    load = np.linalg.norm(contact.nodal_force, axis=1)
    share = load / load.sum()
    centre = share @ places
    # Hertz's pressure has 2/5 of the radius squared as its mean square distance; a count of nodes would jump.
    return PatchFrame(centre, float(np.sqrt(2.5 * (share @ ((places - centre) ** 2).sum(axis=1)))) + _SMALLEST_RADIUS)


def features(compliance: Compliance, contact: Contact, at: PatchFrame) -> np.ndarray:
    """Compute the features (f,) of a fast contact, without units: lengths over the thickness, stresses over E.

    at : the contact's ``frame``. All are continuous in the nodal forces, so that a force can be searched for."""
    material, thickness = sensors.describe(compliance.name).material, sensors.thickness(compliance.name)
    nodes = compliance.touchable[contact.nodes]
    load = np.linalg.norm(contact.nodal_force, axis=1)
    share = load / load.sum()
    offset = (plane(compliance.name)[nodes] - at.centre) / thickness
    spread = np.einsum("k,ki,kj->ij", share, offset, offset)
    local = np.einsum("kji,kj->i", node_frames(compliance.name)[nodes], contact.nodal_force) / load.sum()
    towards = np.einsum("k,kji,j->i", share, node_frames(compliance.name)[nodes], contact.pose.direction)
    alike = 1 / float(share @ share)  # how many nodes would carry as evenly
    depth = contact.depth / thickness
    force = np.log(load.sum() / (material.youngs * thickness**2) + 1e-6)
    core = contact.core_force.sum() / load.sum() if len(contact.core_force) else 0.0
    return np.array([
        depth, np.sqrt(depth), force, at.radius / thickness, np.log(at.radius / thickness),
        spread[0, 0], spread[1, 1], spread[0, 1], at.centre[0] / 5e-3, at.centre[1] / 5e-3, (at.centre[1] / 5e-3) ** 2,
        local[0], local[2], towards[0], towards[2], core, np.log(depth / (at.radius / thickness)),
        share.max() * alike, 1 / alike, contact.sideways,
    ])  # fmt: skip


MIRRORED = np.array([1, 1, 1, 1, 1, 1, 1, -1, 1, -1, 1, 1, -1, 1, -1, 1, 1, 1, 1, 1.0])  # features under z -> -z


def grid_places() -> np.ndarray:
    """Return places (33, 33, 2) of the fields' grid, along and across the finger from the patch's centre, in radii."""
    line = np.sinh(np.linspace(-np.arcsinh(REACH), np.arcsinh(REACH), LINES))
    return np.stack(np.meshgrid(line, line, indexing="ij"), -1)


@functools.cache
def _frames_by_axis(sensor: str) -> np.ndarray:
    """Return ``node_frames`` as (3, 3, n)."""
    return np.ascontiguousarray(np.moveaxis(node_frames(sensor), 0, 2))


@functools.cache
def learned() -> dict[str, Correction]:
    """Load the shipped corrections, by the sensor's name."""
    names = [field.name for field in dataclasses.fields(Learned)]
    with shipped(FILE).open("rb") as file, np.load(file, allow_pickle=False) as arrays:
        return {
            sensor: Correction(*(
                Learned(**{name: arrays[f"{sensor}_{kind}_{name}"].astype(np.float64) for name in names})
                for kind in ("still", "rubbing")
            ))
            for sensor in sensors.PAIR
        }  # fmt: skip


@dataclasses.dataclass(frozen=True)
class Corrected:
    """Correction of a fast contact. displacement : (n, 3) m, corrected; factor : by which to multiply its forces"""

    displacement: np.ndarray
    factor: float


def force_factor(compliance: Compliance, contact: Contact) -> float:
    """Return the factor by which to multiply a fast contact's forces; 1 without contact or shipped correction."""
    parts = learned().get(compliance.name)
    if not len(contact.nodes) or parts is None:
        return 1.0
    return parts.factor(features(compliance, contact, frame(compliance, contact)))


def correct(compliance: Compliance, contact: Contact) -> Corrected:
    """Correct a fast contact to the full tier's result at the same depth; unchanged without contact, or if no
    correction ships for the sensor."""
    parts = learned().get(compliance.name)
    if not len(contact.nodes) or parts is None:
        return Corrected(contact.displacement, 1.0)
    at = frame(compliance, contact)
    seen = features(compliance, contact, at)
    moved = add_field(compliance.name, contact.displacement, at, parts.field(seen), contact.depth)
    return Corrected(moved, parts.factor(seen))


def add_field(sensor: str, displacement: np.ndarray, at: PatchFrame, field: np.ndarray, scale: float) -> np.ndarray:
    """Return displacement (n, 3) m plus ``scale``, the depth in m, times ``field`` (g, 3), learned per metre of depth
    on the grid of the patch frame ``at`` in the surface's own axes; the sum is in the sensor's axes."""
    places, frames = np.ascontiguousarray(plane(sensor)), _frames_by_axis(sensor)
    return _add_field(displacement, places, frames, at.centre, at.radius, field, scale)


@Loop
def _add_field(displacement, plane, frames, centre, radius, field, scale):  # noqa: ANN001, ANN202
    """Return displacement (n, 3) plus scale times a field (g, 3) on a grid, float64: bilinear, 0 beyond the grid.
    plane : (n, 2) m, nodes' places; frames : (3, 3, n), ``node_frames``; centre : (2,) m, radius : m, of the patch"""
    moved, per_line = np.empty(displacement.shape), (LINES - 1) / 2 / np.arcsinh(REACH)
    middle = (LINES - 1) / 2
    for node in range(len(plane)):
        x, z = (plane[node, 0] - centre[0]) / radius, (plane[node, 1] - centre[1]) / radius
        for i in range(3):
            moved[node, i] = displacement[node, i]
        if max(abs(x), abs(z)) >= REACH:
            continue
        u, v = np.arcsinh(x) * per_line + middle, np.arcsinh(z) * per_line + middle
        row, column = min(int(u), LINES - 2), min(int(v), LINES - 2)
        u, v = u - row, v - column
        corner = row * LINES + column
        for j in range(3):
            local = (1 - v) * ((1 - u) * field[corner, j] + u * field[corner + LINES, j])
            local += v * ((1 - u) * field[corner + 1, j] + u * field[corner + LINES + 1, j])
            for i in range(3):
                moved[node, i] += scale * frames[i, j, node] * local
    return moved
