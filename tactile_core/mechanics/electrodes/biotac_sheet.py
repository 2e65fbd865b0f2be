"""A finger's fluid as a thin conducting sheet: what its electrodes read for a deformed inner skin.

Assumed: the size of the electrodes, that the four excitation electrodes are joined and that the electrodes that are not
being read float. The sheet lies half way between core and resting inner skin, which is exact to
second order in thickness over radius for a film between concentric cylinders; the current's spreading through the
thickness near an electrode is left out.
"""

from __future__ import annotations

import dataclasses
import functools

import numpy as np

from ... import sensors
from ...geometry.lattice import Lattice, cap_faces
from ...sensors.fluid_sensor import FluidFilm
from ...sensors.unrolling import closest_on_triangles
from ..fast.contact_state import Contact
from ..fast.sensing_points import electrode_feet, sensing_nodes
from ..solids.biotac_core import above_core
from ..solids.hex_mesh import skin_mesh
from .thin_sheet import ThinSheet, resistances

FED = 4  # electrodes of the excitation
_FINE = 2  # times the triangles are halved to find what the grid leaves unresolved near an electrode: 0.12 mm


@dataclasses.dataclass(frozen=True)
class BiotacSheet:
    """The fluid film between core and inner skin; e electrodes, 19 of the BioTac.

    fluid : what conducts; sheet : on the nodes that bound fluid, with the electrodes and the 4 of the excitation
    wet : (k,) the sheet's nodes in the inner skin's surface
    sensing : (k,) which of ``sensing_points.sensing_nodes`` they are
    film : (k,) m, thickness at rest; outward : (k, 3), from the core to the skin
    unresolved : (e + 4,) what the grid is too coarse for: resistance of each electrode in a film of 1 m and 1 S/m
    """

    fluid: FluidFilm
    sheet: ThinSheet
    wet: np.ndarray
    sensing: np.ndarray
    film: np.ndarray
    outward: np.ndarray
    unresolved: np.ndarray

    def films(self, displacement: np.ndarray) -> np.ndarray:
        """Thickness (k,) m for a displacement (n_inner, 3) m of the whole inner skin, at least the thinnest."""
        moved = np.einsum("ki,ki->k", displacement[self.wet], self.outward)
        return np.maximum(self.film + moved, self.fluid.thinnest)

    def films_of(self, change: np.ndarray) -> np.ndarray:
        """Thickness (k,) m after changes (f,) m of the gaps at ``sensing_points.sensing_nodes``."""
        return np.maximum(self.film + change[self.sensing], self.fluid.thinnest)

    def near(self, films: np.ndarray) -> np.ndarray:
        """Part of each electrode's resistance (e + 4,) ohm in films (k,) m that the grid does not resolve."""
        return self.unresolved / (self.fluid.conductivity * self.sheet.mean_over_electrodes(films))

    def resistances(self, films: np.ndarray) -> np.ndarray:
        """Resistance (e,) ohm of each electrode to the excitation for films (k,) m."""
        potentials = self.sheet.potentials(films, self.fluid.conductivity)
        return resistances(potentials + np.diag(self.near(films)), len(potentials) - FED)

    def growth(self, resistance: np.ndarray, at_rest: np.ndarray) -> np.ndarray:
        """Factors (e,) by which impedances have grown as resistances (e,) ohm grew from those ``at_rest``."""
        return (resistance + self.fluid.interface) / (at_rest + self.fluid.interface)


@functools.cache
def biotac_sheet(sensor: str = sensors.SOURCE, *, core_of_mesh: bool = False) -> BiotacSheet:
    """The sheet of the resting finger; a solve takes 10 ms.

    core_of_mesh : whether the film ends on the public mesh's core. By default it ends on a core that carries the
    electrodes, so that films over electrodes are the published gaps: the mesh's core stands 0.25 mm over the electrodes
    of the trunk and 0.6 mm under those of the tip.
    """
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
    if not core_of_mesh:
        gap = np.linalg.norm(feet - positions, axis=1)[: len(read)]
        film = film + _spread(feet[: len(read)], gap - (weights * film[corners]).sum(1)[: len(read)], inner.rest)
    middle = inner.rest - outward * film[:, None] / 2
    centers = np.einsum("ek,ekd->ed", weights, middle[corners])
    wet, faces = np.unique(_connected(faces[(film > thinnest)[faces].all(1)]), return_inverse=True)
    sheet = ThinSheet(middle[wet], faces.reshape(-1, 3), centers, skin.descriptor.electrodes.radius)
    sensed = sensing_nodes(sensor)
    order = np.argsort(sensed)
    sensing = order[np.searchsorted(sensed, wet, sorter=order)]
    return BiotacSheet(skin.descriptor.fluid, sheet, wet, sensing, film[wet], outward[wet], sheet.unresolved(_FINE))


def sensing_films(contact: Contact) -> np.ndarray:
    """Film thickness (k,) m of the sheet in a contact of the fast tier, from the gaps of its sensing points."""
    skin = contact.compliance
    return biotac_sheet(skin.name).films_of((contact.sensing_gaps - skin.watch_gap)[skin.feet :])


def _spread(places: np.ndarray, values: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Values (n,) at points (n, 3) from those at places (k, 3), weighted by 1 / distance^3 (Shepard)."""
    weights = 1 / (np.linalg.norm(points[:, None] - places, axis=2) ** 3 + 1e-15)
    return weights @ values / weights.sum(1)


def _mirrored_faces(inner: Lattice) -> np.ndarray:
    """Triangles of the grid and its tip cap whose diagonals are each other's images in z, unlike the lattice's own."""
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
    """The largest connected piece of a surface."""
    import scipy.sparse.csgraph

    size = faces.max() + 1
    joined = scipy.sparse.coo_matrix((np.ones(faces.size), (faces.ravel(), np.roll(faces, 1, 1).ravel())), (size, size))
    piece = scipy.sparse.csgraph.connected_components(joined, directed=False)[1][faces[:, 0]]
    return faces[piece == np.bincount(piece).argmax()]


# counts m: assumed. No gap law is published (docs/sources.md); this one puts the 95th percentile of the largest change
# a press makes near 150 counts, as of the networks' prototype. One constant for all electrodes: against the thin
# sheet it leaves 9 counts rms of 20 over 240 contacts, a constant for each electrode 7
# (`scripts/benchmarks/mechanics/electrode_law.py` of commit d537259).
FILM_CONSTANT = 0.1


def signal_of_gaps(gaps: np.ndarray, sensor: str = sensors.SOURCE) -> np.ndarray:
    """Noise-free change (..., e) of the raw counts against rest for film thicknesses (..., e) m.

    b (1 / max(gap, floor) - 1 / gap at rest), the sign as in ``sensors.COUNT_SIGN``.
    """
    rest = electrode_feet(sensor).gap
    return sensors.COUNT_SIGN * FILM_CONSTANT * (1 / np.maximum(gaps, film_floor(sensor)) - 1 / rest)


def film_floor(sensor: str) -> float:
    """Thickness, m, of the thinnest film of a sensor that the laws know."""
    return sensors.skin_of(sensor).descriptor.fluid.thinnest
