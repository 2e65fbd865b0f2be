"""Find where a contact lies, its centre and patch on the gel, its normal on the skin, and shift contacts.
frame : the gel's `ContactFrame`"""

from __future__ import annotations

import functools

import numpy as np

from .. import accuracy, sensors
from ..geometry.lattice import Lattice
from ..recordings.flags import Flag
from ..sensors.camera import Camera
from ..sensors.unrolling import node_normals
from .card import PLACE
from .contact_frame import PLACE_UNIT, ContactFrame, between_nodes
from .posterior import Posterior, touches

STEPS = 8  # of Newton's method; three suffice on our lattice, whose cells are nearly squares
FADE = 5e-3  # m beside the gel, over which a moved field fades out (assumed: a step at its rim would show in pictures)
SMALL = 1e-3  # cells, step of a finite difference
APART = 3e-3  # m, least distance of two different contacts (assumed)

# Of the contact patch:
SMOOTH = 0.7  # cells, width of the Gaussian that keeps the curvature from following single nodes
BEND = 0.01  # of the largest curvature
DEEP = 0.1  # of the largest depth; all three chosen together on 1,500 contacts of nine indenters in the fast tier,
# where rules near this one find 86 % (intersection over union) of true patches from true deformations and depth alone
# 82 % at best; in the full tier it finds 79 % (docs/translation.md)
FLOOR = 5e-6  # m: a dent less deep is no contact. It moves a picture by one level at most, where the camera's own noise
# is 2 to 3 levels (docs/sources.md, DIGIT camera): no sensor of this kind could tell it from rest.
_MARGIN = 20  # cells of zero padding round the lattice, as the Fourier transform is periodic


def on_gel(frame: ContactFrame, place: np.ndarray) -> np.ndarray:
    """Return positions (T, 2) = (x, z) m on the resting gel; place : (T, 2) row, column from middle, in tens of
    cells"""
    return between_nodes(_grid(frame.sensor, frame.rows, frame.columns), place)


def contact_center(displacement: np.ndarray, rest: np.ndarray, silent: float) -> np.ndarray:
    """Return the centre (T, 2) = (x, z) float32 m of a gel's dent; NaN if no node moves by ``silent`` m.
    displacement : (T, n, 3) m of the gel's nodes; rest : (n, 3) m, their positions at rest"""
    center = accuracy.dent_center(displacement, rest).astype(np.float32)
    center[accuracy.lengths(displacement).max(axis=1) < silent] = np.nan
    return center


@functools.cache
def _inward(sensor: str) -> np.ndarray:
    """Return unit normals (n, 3), inward, at the nodes of a sensor's resting surface."""
    surface = sensors.sensor_surface(sensor)
    return -node_normals(surface.rest, surface.faces)


def contact_normal(displacement: np.ndarray, sensor: str) -> np.ndarray:
    """Return the unit normal (T, 3) float32, inward, of a sensor's resting skin at a dent: that of an even object
    there.
    displacement : (T, n, 3) m of the skin's nodes; NaN if no node moves by 10 um"""
    inward = _inward(sensor)
    normal = accuracy.core_center(np.einsum("tni,ni->tn", displacement, inward), inward)
    return (normal / accuracy.lengths(normal)[:, None]).astype(np.float32)


def elsewhere(posterior: Posterior, state: np.ndarray, frame: ContactFrame) -> np.ndarray:
    """Return the share (T,) of the posterior in contacts over ``APART`` m from the contact of state (T, STATE) on the
    gel."""
    place, others = state[:, :PLACE], posterior.mean[..., :PLACE]
    points = on_gel(frame, others.reshape(-1, PLACE)).reshape(*others.shape[:2], 2)
    far = accuracy.lengths(points - on_gel(frame, place)[:, None]) > APART
    return (posterior.weight * (far & touches(posterior.mean))).sum(-1)


def place_on(frame: ContactFrame, point: np.ndarray) -> np.ndarray:
    """Return the places (T, 2), row and column from the middle in tens of cells, of points on the gel: `on_gel`'s
    inverse. point : (T, 2) = (x, z) m; points beside the gel get its rim's places"""
    grid = _grid(frame.sensor, frame.rows, frame.columns)
    size = np.array(grid.shape[:2])
    apart = np.square(grid.reshape(-1, 2)[None] - point[:, None]).sum(axis=-1).argmin(axis=1)
    nearest = np.stack(np.unravel_index(apart, grid.shape[:2]), axis=-1)
    place, limit = (nearest - (size - 1) / 2) / PLACE_UNIT, (size - 1) / 2 / PLACE_UNIT
    small = SMALL / PLACE_UNIT * np.eye(PLACE)
    for _ in range(STEPS):
        rises = [between_nodes(grid, place + one) - between_nodes(grid, place - one) for one in small]
        slope = np.stack(rises, axis=-1)
        missing = (point - between_nodes(grid, place))[..., None]
        step = np.linalg.pinv(slope) @ missing * (2 * SMALL / PLACE_UNIT)  # at a corner one slope may be none
        place = np.clip(place + step[..., 0], -limit, limit)
    return place


def beyond_picture(center: np.ndarray, camera: Camera) -> np.ndarray:
    """Return flags (T,) uint16: `Flag.BEYOND_PICTURE` for contacts that the camera does not see, else 0.
    center : (T, 2) = (x, z) m on the gel, NaN without contact"""
    beside = np.isfinite(center[:, 0]) & ~camera.sees(*center.T)
    return np.where(beside, Flag.BEYOND_PICTURE, 0).astype(np.uint16)


def contact_patch(displacement: np.ndarray, surface: Lattice) -> np.ndarray:
    """Mark (T, n) bool the nodes that touch, of a surface that is one lattice; displacement : (T, n, 3) m of its nodes

    In contact a surface takes the indenter's curvature, beside it the opposite one: the patch is where the smoothed
    Laplacian of the depth is negative. (Pressure on a half-space is |k| times the depth, k the wave number; the
    Laplacian takes k^2 instead, which measured better: thin gels damp long waves.) A frame dented less than ``FLOOR``
    has no patch."""
    rows, columns = surface.shape
    inward = -np.einsum("tni,ni->tn", displacement, node_normals(surface.rest, surface.faces))
    found = inward.reshape(-1, rows, columns) > FLOOR
    touched = found.any((1, 2))
    depth = inward.reshape(found.shape)[touched]
    after = [_fast_length(2 * _MARGIN + cells) - _MARGIN - cells for cells in surface.shape]
    padded = np.pad(depth, ((0, 0), (_MARGIN, after[0]), (_MARGIN, after[1])))
    across = 2 * np.pi * np.fft.rfftfreq(padded.shape[2])[None, :]
    square = (2 * np.pi * np.fft.fftfreq(padded.shape[1])[:, None]) ** 2 + across**2
    bend = np.fft.irfft2(np.fft.rfft2(padded) * square * np.exp(-square * SMOOTH**2), s=padded.shape[1:])
    bend = bend[:, _MARGIN : _MARGIN + rows, _MARGIN : _MARGIN + columns]
    bent, deep = (field > share * field.max((1, 2), keepdims=True) for field, share in ((bend, BEND), (depth, DEEP)))
    found[touched], found[~touched] = bent & deep, False
    return found.reshape(displacement.shape[:2])


def _fast_length(least: int) -> int:
    """Return the smallest length >= least that has no prime factor but 2, 3 and 5, for which FFTs are fast."""
    return next(length for length in range(least, 2 * least + 1) if pow(30, length, length) == 0)


class Shift:
    """Shifts displacements along a gel, as if the BioTac were mounted elsewhere on it; the gel is assumed equally thick
    there."""

    def __init__(self, frame: ContactFrame, shift: np.ndarray) -> None:
        """Take the shift (2,) = (x, z) m of contacts."""
        came = _grid(frame.sensor, frame.rows, frame.columns).reshape(-1, 2) - shift
        place = place_on(frame, came)
        self._frame, self._place = frame, place
        # Beside the gel there is nothing to move here: what moved at its rim fades out.
        beside = np.linalg.norm(on_gel(frame, place) - came, axis=1)
        self._share = np.maximum(1 - beside / FADE, 0)[:, None].astype(np.float32)

    def __call__(self, displacement: np.ndarray) -> np.ndarray:
        """Return displacement (T, n, 3) m of the gel's nodes, shifted; what came over its rim fades out."""
        rows, columns, count = self._frame.rows, self._frame.columns, len(displacement)
        grid = np.moveaxis(displacement, 0, 1).reshape(rows, columns, count * 3)
        found = between_nodes(grid, self._place) * self._share
        return np.moveaxis(found.reshape(-1, count, 3), 1, 0).astype(displacement.dtype)


@functools.cache
def _grid(sensor: str, rows: int, columns: int) -> np.ndarray:
    """Return coordinates (rows, columns, 2) = (x, z) m of the gel's nodes at rest."""
    return sensors.sensor_surface(sensor).rest[: rows * columns, [0, 2]].reshape(rows, columns, 2)
