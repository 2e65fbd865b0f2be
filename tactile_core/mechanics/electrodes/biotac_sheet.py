"""A finger's fluid as a thin conducting sheet: what its electrodes read for a deformed inner skin.

Assumed: the size of the electrodes, that the four excitation electrodes are joined and that the electrodes that are not
being read float. The sheet lies half way between core and resting inner skin, which is exact to
second order in thickness over radius for a film between concentric cylinders; the current's spreading through the
thickness near an electrode is left out.

The reduced sheet is cheap enough for every contact of a simulation. Galerkin's method: potentials are sought among the
combinations of fixed fields, those of the electrodes at rest and the principal ones of sheets with random dents.
``signal_of`` makes counts of it.
"""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import hashlib

import numpy as np

from ... import sensors
from ...errors import TactileError
from ...files import array_cache
from ...files.threads import in_one_thread
from ...geometry.lattice import Lattice, cap_faces
from ...sensors import divider
from ...sensors.fluid_sensor import FluidFilm
from ...sensors.unrolling import closest_on_triangles
from ..fast.contact_state import Contact
from ..fast.sensing_points import sensing_nodes
from ..solids.biotac_core import above_core
from ..solids.hex_mesh import skin_mesh
from ..solids.sparse_cholesky import factor
from ..solution import Solution
from .thin_sheet import ThinSheet, resistances

FED = 4  # electrodes of the excitation
_FORMAT = 1  # raise when the meaning of the cached arrays changes
_ROOM = "2 MB"
_FINE = 2  # times the triangles are halved to find what the grid leaves unresolved near an electrode: 0.12 mm


@dataclasses.dataclass(frozen=True)
class BiotacSheet:
    """The fluid film between core and inner skin as a conducting sheet with e electrodes, 19 on the BioTac.
    fluid : the film's descriptor; sheet : grid for the currents, with the e electrodes, then the 4 that feed currents
    wet : (k,) number of each of the sheet's k nodes in the inner skin's lattice
    sensing : (k,) index of each of these nodes in ``sensing_points.sensing_nodes``
    film : (k,) m, thickness at rest; outward : (k, 3), unit, from the core to the skin
    unresolved : (e + 4,) ohm, resistance near each electrode that the grid misses in a film of 1 m and 1 S/m
    fields : (k - 1, r), potentials of all nodes but the first that the ``ReducedSheet`` combines"""

    fluid: FluidFilm
    sheet: ThinSheet
    wet: np.ndarray
    sensing: np.ndarray
    film: np.ndarray
    outward: np.ndarray
    unresolved: np.ndarray
    fields: np.ndarray

    def films(self, displacement: np.ndarray) -> np.ndarray:
        """Return the film's thickness (k,) m, ``fluid.thinnest`` or more; displacement : (n, 3) m of the inner skin"""
        moved = np.einsum("ki,ki->k", displacement[self.wet], self.outward)
        return np.maximum(self.film + moved, self.fluid.thinnest)

    def films_of(self, change: np.ndarray) -> np.ndarray:
        """Return the film's thickness (k,) m, at least ``fluid.thinnest``, from the change (f,) m of the gap at each of
        all f sensing nodes, positive if it opens."""
        return np.maximum(self.film + change[self.sensing], self.fluid.thinnest)

    def near(self, films: np.ndarray) -> np.ndarray:
        """Return the resistance (e + 4,) ohm near each electrode that the grid misses, for films (k,) m."""
        return self.unresolved / (self.fluid.conductivity * self.sheet.mean_over_electrodes(films))

    def resistances(self, films: np.ndarray) -> np.ndarray:
        """Return the resistance (e,) ohm of each electrode to the excitation for films (k,) m."""
        potentials = self.sheet.potentials(films, self.fluid.conductivity)
        return resistances(potentials + np.diag(self.near(films)), len(potentials) - FED)

    def growth(self, resistance: np.ndarray, at_rest: np.ndarray) -> np.ndarray:
        """Return the ratio (e,) of each electrode's impedance to that at rest, from its resistance now and at_rest,
        both (e,) ohm; the interface's resistance is added to both."""
        return (resistance + self.fluid.interface) / (at_rest + self.fluid.interface)


@functools.cache
def biotac_sheet(sensor: str = sensors.SOURCE) -> BiotacSheet:
    """Return the conducting sheet of a sensor's resting finger, made in 3 s and cached; solving it takes 10 ms.

    Its film is made as thick over each electrode as the published gap: the public mesh's core stands 0.25 mm over the
    electrodes of the trunk and 0.6 mm under those of the tip."""
    skin, mesh, thinnest = sensors.skin_of(sensor), skin_mesh(sensor), film_floor(sensor)
    inner = skin.skin_surface("inner")
    outward, film = above_core(sensor)
    free = ~mesh.clamped[mesh.inner]
    faces = _mirrored_faces(inner)
    faces = faces[free[faces].all(1)]
    read = sensors.electrodes(sensor)
    positions = np.concatenate([read, sensors.excitation_electrodes(sensor)])
    face, weights, feet = closest_on_triangles(Lattice(inner.rest.copy(), faces, inner.shape), positions)
    corners = faces[face]
    gap = np.linalg.norm(feet - positions, axis=1)[: len(read)]
    film = film + _spread(feet[: len(read)], gap - (weights * film[corners]).sum(1)[: len(read)], inner.rest)
    middle = inner.rest - outward * film[:, None] / 2
    centers = np.einsum("ek,ekd->ed", weights, middle[corners])
    wet, faces = np.unique(_connected(faces[(film > thinnest)[faces].all(1)]), return_inverse=True)
    sheet = ThinSheet(middle[wet], faces.reshape(-1, 3), centers, skin.descriptor.electrodes.radius)
    sensed = sensing_nodes(sensor)
    order = np.argsort(sensed)
    sensing = order[np.searchsorted(sensed, wet, sorter=order)]
    kept = _cached(sensor, sheet, film[wet])
    return BiotacSheet(skin.descriptor.fluid, sheet, wet, sensing, film[wet], outward[wet], **kept)


def _cached(sensor: str, sheet: ThinSheet, film: np.ndarray) -> dict[str, np.ndarray]:
    """Return what takes seconds to compute: ``unresolved`` and ``fields`` of a ``BiotacSheet`` by their names. They
    are read from the cache, or made and kept there. film : (k,) m, at rest"""
    digest = hashlib.sha256(repr((_FORMAT, film_floor(sensor))).encode())
    for array in (sheet.nodes, sheet.faces, sheet.patches, film):
        digest.update(np.ascontiguousarray(array).tobytes())
    folder = array_cache.cache_folder() / f"sheet-{sensor}-{digest.hexdigest()[:16]}"
    try:
        return array_cache.load(folder, ("unresolved", "fields"))
    except array_cache.DamagedError:
        with in_one_thread:  # what one process keeps, every other computes with
            made = {"unresolved": sheet.unresolved(_FINE), "fields": _fields(sheet, film, film_floor(sensor))}
    with contextlib.suppress(TactileError):  # a cache that cannot be written costs time alone
        array_cache.claim(folder, _ROOM)
        array_cache.store(folder, made.items(), _ROOM)
    return made


def sensing_films(contact: Contact) -> np.ndarray:
    """Return the film's thickness (k,) m at the sheet's nodes in a contact of the fast tier."""
    skin = contact.compliance
    return biotac_sheet(skin.name).films_of((contact.sensing_gaps - skin.watch_gap)[skin.feet :])


def _spread(places: np.ndarray, values: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return values (n,) at points (n, 3) m from values (k,) at places (k, 3) m, by weights 1 / distance^3
    (Shepard)."""
    weights = 1 / (np.linalg.norm(points[:, None] - places, axis=2) ** 3 + 1e-15)
    return weights @ values / weights.sum(1)


def _mirrored_faces(inner: Lattice) -> np.ndarray:
    """Return triangles (m, 3) of the inner skin's grid and tip cap whose diagonals mirror each other in z."""
    rows, columns = inner.shape
    row, column = np.meshgrid(np.arange(rows - 1), np.arange(columns), indexing="ij")
    right = (column + 1) % columns
    a, b = row * columns + column, (row + 1) * columns + column
    c, d = (row + 1) * columns + right, row * columns + right
    one = np.stack([a, b, c, a, c, d], -1).reshape(rows - 1, columns, 2, 3)
    other = np.stack([a, b, d, b, c, d], -1).reshape(rows - 1, columns, 2, 3)
    left = (np.arange(columns) < columns // 2)[:, None, None]  # columns run from -180 degrees up
    return np.concatenate([np.where(left, one, other).reshape(-1, 3), cap_faces(rows * columns, np.arange(columns))])


def _connected(faces: np.ndarray) -> np.ndarray:
    """Return those of the triangles ``faces`` (m, 3) that belong to the surface's largest connected piece."""
    import scipy.sparse.csgraph

    size = faces.max() + 1
    joined = scipy.sparse.coo_matrix((np.ones(faces.size), (faces.ravel(), np.roll(faces, 1, 1).ravel())), (size, size))
    piece = scipy.sparse.csgraph.connected_components(joined, directed=False)[1][faces[:, 0]]
    return faces[piece == np.bincount(piece).argmax()]


def film_floor(sensor: str) -> float:
    """Return the least thickness, m, of a sensor's film that the sheet models."""
    return sensors.skin_of(sensor).descriptor.fluid.thinnest


# 60 fields of 60 dents leave 0.28 % rms of rest where contacts change resistances by 9.3 % (docs/mechanics.md of commit
# d537259); in trials by hand 20 fields left 0.7 %, and 150 dents were no better. Dents as wide and deep as contacts
# make them, and sides that bulge (assumed ranges, m).
_DENTS, _FIELDS = 60, 60
_WIDTH, _DEPTH, _BULGE = (1.5e-3, 5e-3), (0.24e-3, 1.2e-3), (0.0, 0.15e-3)
_PAD = -2e-3  # m, y below which dents lie


class ReducedSheet:
    """A ``sheet`` that is solved quickly: the potentials of its n nodes, 0 V at the first, are sought among the
    combinations of r fixed ``fields`` (n - 1, r)."""

    def __init__(self, sheet: BiotacSheet) -> None:
        self.sheet, self.fields = sheet, sheet.fields
        self._patches = self.fields.T @ sheet.sheet.patches[1:]
        self.at_rest = self.resistances(sheet.film)

    def resistances(self, films: np.ndarray) -> np.ndarray:
        """Return the resistance (e,) ohm of each electrode to the excitation for films (k,) m at the sheet's nodes."""
        stiffness = self.sheet.sheet.matrix(films, self.sheet.fluid.conductivity)[1:, 1:]
        reduced = self.fields.T @ (stiffness @ self.fields)
        potentials = self._patches.T @ np.linalg.solve(reduced, self._patches)
        return resistances(potentials + np.diag(self.sheet.near(films)), len(potentials) - FED)

    def growth(self, films: np.ndarray) -> np.ndarray:
        """Return the factor (e,) by which each electrode's impedance has grown since rest, for films (k,) m."""
        return self.sheet.growth(self.resistances(films), self.at_rest)


@functools.cache
def reduced_sheet(sensor: str = sensors.SOURCE) -> ReducedSheet:
    """Make the reduced sheet of a sensor's finger, which solves a contact in 3 ms."""
    return ReducedSheet(biotac_sheet(sensor))


def _fields(sheet: ThinSheet, film: np.ndarray, floor: float) -> np.ndarray:
    """Return orthonormal fields (n - 1, r): of the electrodes at rest, then the principal ones of dented sheets.
    film : (n,) m, at rest; floor : m, least thickness"""
    rest = sheet.matrix(film)[1:, 1:].tocsc()
    at_rest, dented = _potentials(sheet, film), [_potentials(sheet, films) for films in _dents(sheet, film, floor)]
    changes = np.concatenate(dented, 1)
    # What the fields at rest do not tell of them, in the energy of the sheet at rest.
    changes -= at_rest @ np.linalg.solve(at_rest.T @ (rest @ at_rest), at_rest.T @ (rest @ changes))
    energy, mixture = np.linalg.eigh(changes.T @ (rest @ changes))
    principal = changes @ (mixture[:, -_FIELDS:] / np.sqrt(energy[-_FIELDS:]))
    return np.linalg.qr(np.concatenate([at_rest, principal], 1))[0]


def _potentials(sheet: ThinSheet, films: np.ndarray) -> np.ndarray:
    """Return potentials (n - 1, e + 4) V of all nodes but the first (0 V) for 1 A into each electrode in turn, 1 S/m.
    films : (n,) m, thickness"""
    return factor(sheet.matrix(films)[1:, 1:].tocsc())(sheet.patches[1:])


def _dents(sheet: ThinSheet, film: np.ndarray, floor: float) -> list[np.ndarray]:
    """Draw the films (n,) m of 60 sheets with one bell-shaped dent each, the same at every call.
    film : (n,) m, at rest; floor : m, least thickness"""
    random, nodes = np.random.default_rng(0), sheet.nodes
    pad = np.flatnonzero(nodes[:, 1] < _PAD)
    found = []
    for _ in range(_DENTS):
        away = np.linalg.norm(nodes - nodes[random.choice(pad)], axis=1)
        bell = np.exp(-((away / random.uniform(*_WIDTH)) ** 2))
        found.append(film - random.uniform(*_DEPTH) * bell + random.uniform(*_BULGE) * (1 - bell))
    return [np.maximum(films, floor) for films in found]


def signal_of(contact: Contact | Solution, sensor: str = sensors.SOURCE) -> np.ndarray:
    """Return the change (e,) of the electrodes' raw counts from rest in a contact, without noise, for a unit whose
    counts at rest are ``rest_counts``; takes 3 ms. sensor : name of the fluid sensor that is touched"""
    films = sensing_films(contact) if isinstance(contact, Contact) else contact.films
    rest = rest_counts(sensor)
    return divider.reading(reduced_sheet(sensor).growth(films), rest) - rest


@functools.cache
def rest_counts(sensor: str) -> np.ndarray:
    """Return the raw counts (e,) of a typical unit at rest: the descriptor's or, without any, the sheet's."""
    known = sensors.places_of(sensor).rest_counts
    if np.isfinite(known).all():
        return known
    found, sheet = sensors.skin_of(sensor).descriptor, reduced_sheet(sensor)
    impedance = sheet.at_rest + found.fluid.interface
    return sensors.COUNT_MAX / (1 + impedance / found.readout.load)
