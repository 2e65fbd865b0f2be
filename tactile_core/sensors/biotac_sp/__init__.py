"""Dimensions of the BioTac SP in an independent COMSOL model, from which its table of radii is made.

Frame of that model, metres: x along the finger, y across, z away from the pad, which faces -z. Source:
github.com/bsadr/biotac, July 2020. Its presses were held against the finite-strain tier (docs/sources.md, Mechanics).
"""

import numpy as np

ELECTRODES = 24  # beside four that excite (``locations.csv`` there)
CORE = np.array([12.42e-3, 8.14e-3, 8.057e-3])  # m, semi-axes of the core (``comsol/matlab/Ray.m`` there)
RESTING = np.array([13.84e-3, 9.74e-3, 10.11e-3])  # m, semi-axes of the presses' skin under 1750 Pa (fitted)
RESTING_CENTRE = -0.242e-3  # m, z of its centre, likewise
