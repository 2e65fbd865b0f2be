"""The BioTac's fluid as a thin conducting sheet: what its 19 electrodes read for a deformed inner skin.

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
from ...sensors import biotac
from ...sensors.unrolling import closest_on_triangles
from ..fast.contact_state import Contact
from ..fast.sensing_points import sensing_nodes
from ..solids.biotac_core import above_core
from ..solids.hex_mesh import skin_mesh
from .gap_law import FILM_FLOOR
from .thin_sheet import ThinSheet, resistances

_FILM, ELECTRODE_RADIUS = biotac.DESCRIPTOR.fluid, biotac.DESCRIPTOR.electrodes.radius
CONDUCTIVITY, INTERFACE = _FILM.conductivity, _FILM.interface
_FINE = 2  # times the triangles are halved to find what the grid leaves unresolved near an electrode: 0.12 mm


@dataclasses.dataclass(frozen=True)
class BiotacSheet:
    """The fluid film between core and inner skin.

    sheet : on the nodes that bound fluid, with the 19 electrodes and the 4 of the excitation
    wet : (k,) the sheet's nodes in ``biotac.skin_surface("inner")``
    sensing : (k,) which of ``sensing_points.sensing_nodes`` they are
    film : (k,) m, thickness at rest; outward : (k, 3), from the core to the skin
    unresolved : (23,) what the grid is too coarse for: resistance of each electrode in a film of 1 m and 1 S/m
    """

    sheet: ThinSheet
    wet: np.ndarray
    sensing: np.ndarray
    film: np.ndarray
    outward: np.ndarray
    unresolved: np.ndarray

    def films(self, displacement: np.ndarray) -> np.ndarray:
        """Thickness (k,) m for a displacement (n_inner, 3) m of the whole inner skin; at least ``FILM_FLOOR``."""
        return np.maximum(self.film + np.einsum("ki,ki->k", displacement[self.wet], self.outward), FILM_FLOOR)

    def films_of(self, change: np.ndarray) -> np.ndarray:
        """Thickness (k,) m where the gaps of ``sensing_points.sensing_nodes`` (f,) have changed by so much, m."""
        return np.maximum(self.film + change[self.sensing], FILM_FLOOR)

    def near(self, films: np.ndarray) -> np.ndarray:
        """Part of each electrode's resistance (23,) ohm in films (k,) m that the grid does not resolve."""
        return self.unresolved / (CONDUCTIVITY * self.sheet.mean_over_electrodes(films))

    def resistances(self, films: np.ndarray) -> np.ndarray:
        """Resistance (19,) ohm of each electrode to the excitation for films (k,) m."""
        return resistances(self.sheet.potentials(films, CONDUCTIVITY) + np.diag(self.near(films)), 19)


def growth(resistance: np.ndarray, at_rest: np.ndarray) -> np.ndarray:
    """Factors (19,) by which impedances have grown where the film's resistances (19,) ohm are those, not at_rest."""
    return (resistance + INTERFACE) / (at_rest + INTERFACE)


@functools.cache
def biotac_sheet(*, core_of_mesh: bool = False) -> BiotacSheet:
    """The sheet of the resting BioTac; a solve takes 10 ms.

    core_of_mesh : whether the film ends on the public mesh's core. By default it ends on a core that carries the
    electrodes, so that films over electrodes are the published gaps: the mesh's core stands 0.25 mm over the electrodes
    of the trunk and 0.6 mm under those of the tip.
    """
    inner = biotac.skin_surface("inner")
    outward, film = above_core()
    free = ~skin_mesh().clamped[skin_mesh().inner]
    faces = _mirrored_faces(inner)
    faces = faces[free[faces].all(1)]
    positions = np.concatenate([sensors.electrodes(), sensors.excitation_electrodes()])
    face, weights, feet = closest_on_triangles(Lattice(inner.rest.copy(), faces, inner.shape), positions)
    corners = faces[face]
    if not core_of_mesh:
        gap = np.linalg.norm(feet - positions, axis=1)[:19]
        film = film + _spread(feet[:19], gap - (weights * film[corners]).sum(1)[:19], inner.rest)
    middle = inner.rest - outward * film[:, None] / 2
    centers = np.einsum("ek,ekd->ed", weights, middle[corners])
    wet, faces = np.unique(_connected(faces[(film > FILM_FLOOR)[faces].all(1)]), return_inverse=True)
    sheet = ThinSheet(middle[wet], faces.reshape(-1, 3), centers, ELECTRODE_RADIUS)
    order = np.argsort(sensing_nodes())
    sensing = order[np.searchsorted(sensing_nodes(), wet, sorter=order)]
    return BiotacSheet(sheet, wet, sensing, film[wet], outward[wet], sheet.unresolved(_FINE))


def sensing_films(contact: Contact) -> np.ndarray:
    """Films (k,) m of the sheet in a contact of the fast tier, from the inner nodes that it watches."""
    skin = contact.compliance
    return biotac_sheet().films_of((contact.sensing_gaps - skin.watch_gap)[skin.feet :])


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
