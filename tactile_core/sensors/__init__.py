"""The two fingertips as data: surfaces, materials, electrodes; each constant with its source.

Frame shared by both sensors, that of the public meshes, metres: x along the finger, tip toward -x;
y normal to the pad, contact side -y; z lateral. The DIGIT's camera and lights are in ``camera``.
"""

from __future__ import annotations

import dataclasses

import numpy as np

from ..geometry.lattice import Lattice
from . import biotac, digit


@dataclasses.dataclass(frozen=True)
class Material:
    """An isotropic elastic solid at small strain. youngs : Pa; poisson : below 0.5."""

    youngs: float
    poisson: float


# Skin: fitted to real fingers. Films over electrodes tell how far the skin has moved, PDC what pressure that took: with
# 0.905 MPa, 6 (C10 + C01) of the independent COMSOL model of the BioTac SP, simulated pressures are a fourth to a fifth
# of real ones (``benchmarks.translation.skin_stiffness``). With 4.1 MPa real ones are .81 times as high in 12 firm
# grips (quartiles .76 and .99), .70 times on slides (.58 and 1.05), whose counts at rest are a typical unit's: the skin
# may be a quarter too stiff. The 1.552 MPa of the Isaac Gym authors were fitted
# to forces on a mesh that locks (docs/sources.md, Mechanics): a ball bears there 2.3 times what it does on ours
# with 0.905 MPa, as if that were 2.1 MPa.
BIOTAC_SKIN = Material(youngs=4.1e6, poisson=0.48)  # Poisson's ratio assumed: silicone, nearly incompressible

# Gel: Smooth-On Solaris, Shore 10A (docs/sources.md, DIGIT gel). By Gent's relation (A. N. Gent, Rubber
# Chem. Technol. 31, 1958) E = 0.0981 (56 + 7.62336 S) / (0.137505 (254 - 2.54 S)) MPa, S = 10.
DIGIT_GEL = Material(youngs=0.4126e6, poisson=0.48)  # Poisson's ratio assumed

ELECTRODES = 19  # of a single BioTac; the BioTac SP has 24
SAMPLE_RATE = 100.0  # Hz, one frame of all electrodes (docs/sources.md, BioTac read-out)
COUNT_MAX = 4095  # 12-bit electrodes
# Counts E1..E19 of a typical unit without contact: mean impedance of two real units, made even across the finger
# (docs/sources.md, BioTac read-out). E1 and E11, whose film is thinnest, respond 1.8 times as strongly as E2 to E5.
REST_COUNTS = np.array([
    3135, 3623, 3641, 3522, 3622, 3477, 3245, 3355, 3355, 3448, 3135, 3623, 3641, 3522, 3622, 3477, 3570, 3637, 3530,
], float)  # fmt: skip
# Raw counts fall where the fluid film over an electrode thins: each electrode is read in a voltage divider, and "as the
# impedance over the sensing electrode increases, the measured voltage decreases" (SynTouch, BioTac SP manual). Fingers
# that hold a flat object agree: where they are squeezed, counts fall as the fluid's pressure rises (docs/sources.md,
# BioTac read-out).
COUNT_SIGN = -1.0

PRESSURE_PER_COUNT = 36.5  # Pa a count of PDC (SynTouch, BioTac SP manual)

# Electrodes E1..E19, mm, SynTouch's frame: x to the tip, z <= 0 on the pad (docs/sources.md, BioTac electrodes).
_ELECTRODES_SYNTOUCH_MM = np.array([
    [0.993, -4.855, -1.116], [-2.7, -3.513, -3.67], [-6.2, -3.513, -3.67], [-8.0, -4.956, -1.116],
    [-10.5, -3.513, -3.67], [-13.4, -4.956, -1.116], [4.763, 0.0, -2.33], [3.031, -1.95, -3.33],
    [3.031, 1.95, -3.33], [1.299, 0.0, -4.33], [0.993, 4.855, -1.116], [-2.7, 3.513, -3.67],
    [-6.2, 3.513, -3.67], [-8.0, 4.956, -1.116], [-10.5, 3.513, -3.67], [-13.4, 4.956, -1.116],
    [-2.8, 0.0, -5.08], [-9.8, 0.0, -5.08], [-13.6, 0.0, -5.08],
])  # fmt: skip
# The symmetric mesh does not show the sign of z (docs/sources.md, Frame): +y of SynTouch's frame to +z, assumed.
_LATERAL_SIGN = 1.0


def electrodes() -> np.ndarray:
    """Electrode positions (19, 3), m, shared frame."""
    return from_syntouch(1e-3 * _ELECTRODES_SYNTOUCH_MM)


def from_syntouch(points: np.ndarray) -> np.ndarray:
    """Transform points (n, 3) m of SynTouch's frame to the shared one: x = -x_e - 13.97 mm, y = z_e, z = +-y_e
    (docs/sources.md, Frame).
    """
    x, y, z = np.asarray(points).T
    return np.column_stack([-x - 13.97e-3, z, _LATERAL_SIGN * y])


def biotac_surface() -> Lattice:
    """The BioTac's outer skin at rest, 3,650 nodes; see ``biotac.skin_surface``."""
    return biotac.skin_surface("outer")


def digit_surface() -> Lattice:
    """The DIGIT's coated gel surface at rest, 2,867 nodes; see ``digit.gel_surface``."""
    return digit.gel_surface()


def sensor_surface(sensor: str) -> Lattice:
    """The resting surface of ``"biotac"`` or ``"digit"``."""
    return biotac_surface() if sensor == "biotac" else digit_surface()
