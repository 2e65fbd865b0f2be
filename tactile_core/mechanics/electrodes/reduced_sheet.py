"""The BioTac's sheet on a few fields in place of its nodes: cheap enough for every contact of a simulation.

Galerkin's method: potentials are sought among the combinations of fixed fields, those of the electrodes at rest and the
principal ones of sheets with random dents.
"""

from __future__ import annotations

import functools

import numpy as np

from ... import sensors
from ..solids.sparse_cholesky import factor
from .biotac_sheet import FED, BiotacSheet, biotac_sheet
from .thin_sheet import resistances

# 60 fields of 60 dents leave 0.28 % rms of rest where contacts change resistances by 9.3 % (docs/mechanics.md of commit
# d537259); in trials by hand 20 fields left 0.7 %, and 150 dents were no better. Dents as wide and deep as contacts
# make them, and sides that bulge (assumed ranges, m).
_DENTS, _FIELDS = 60, 60
_WIDTH, _DEPTH, _BULGE = (1.5e-3, 5e-3), (0.24e-3, 1.2e-3), (0.0, 0.15e-3)
_PAD = -2e-3  # m, y below which dents lie


class ReducedSheet:
    """Resistances of a sheet from potentials among ``fields`` (n - 1, r), those of all its nodes but the first."""

    def __init__(self, sheet: BiotacSheet, fields: np.ndarray) -> None:
        self.sheet, self.fields = sheet, fields
        self._patches = fields.T @ sheet.sheet.patches[1:]
        self.at_rest = self.resistances(sheet.film)

    def resistances(self, films: np.ndarray) -> np.ndarray:
        """Resistance (e,) ohm of each electrode to the excitation for films (k,) m at the sheet's nodes."""
        stiffness = self.sheet.sheet.matrix(films, self.sheet.fluid.conductivity)[1:, 1:]
        reduced = self.fields.T @ (stiffness @ self.fields)
        potentials = self._patches.T @ np.linalg.solve(reduced, self._patches)
        return resistances(potentials + np.diag(self.sheet.near(films)), len(potentials) - FED)

    def growth(self, films: np.ndarray) -> np.ndarray:
        """Factor (e,) by which each electrode's impedance has grown since rest, for films (k,) m."""
        return self.sheet.growth(self.resistances(films), self.at_rest)


@functools.cache
def reduced_sheet(sensor: str = sensors.SOURCE) -> ReducedSheet:
    """The reduced sheet of the resting finger: 1 s once, then 3 ms a contact."""
    sheet = biotac_sheet(sensor)
    rest = sheet.sheet.matrix(sheet.film)[1:, 1:].tocsc()
    at_rest, dented = _potentials(sheet, sheet.film), [_potentials(sheet, films) for films in _dents(sheet)]
    changes = np.concatenate(dented, 1)
    # What the fields at rest do not tell of them, in the energy of the sheet at rest.
    changes -= at_rest @ np.linalg.solve(at_rest.T @ (rest @ at_rest), at_rest.T @ (rest @ changes))
    energy, mixture = np.linalg.eigh(changes.T @ (rest @ changes))
    principal = changes @ (mixture[:, -_FIELDS:] / np.sqrt(energy[-_FIELDS:]))
    return ReducedSheet(sheet, np.linalg.qr(np.concatenate([at_rest, principal], 1))[0])


def _potentials(sheet: BiotacSheet, films: np.ndarray) -> np.ndarray:
    """Potentials (n - 1, e + 4) of all nodes but the first, for 1 A into each electrode at 1 S/m."""
    return factor(sheet.sheet.matrix(films)[1:, 1:].tocsc())(sheet.sheet.patches[1:])


def _dents(sheet: BiotacSheet) -> list[np.ndarray]:
    """Films (k,) m of sheets with one bell-shaped dent each, always the same."""
    random, nodes = np.random.default_rng(0), sheet.sheet.nodes
    pad = np.flatnonzero(nodes[:, 1] < _PAD)
    found = []
    for _ in range(_DENTS):
        away = np.linalg.norm(nodes - nodes[random.choice(pad)], axis=1)
        bell = np.exp(-((away / random.uniform(*_WIDTH)) ** 2))
        found.append(sheet.film - random.uniform(*_DEPTH) * bell + random.uniform(*_BULGE) * (1 - bell))
    return [np.maximum(films, sheet.fluid.thinnest) for films in found]
