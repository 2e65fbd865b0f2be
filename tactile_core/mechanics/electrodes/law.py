"""Compute the changes of the electrodes' counts from a contact, by the chosen law."""

from __future__ import annotations

import functools

import numpy as np

from ... import sensors
from ...errors import TactileError
from ...sensors import divider
from ..fast.contact_state import Contact
from ..solution import Solution
from .biotac_sheet import reduced_sheet, sensing_films, signal_of_gaps

SHEET, GAP = LAWS = ("sheet", "gap")


def signal_of(contact: Contact | Solution, law: str = SHEET, sensor: str = sensors.SOURCE) -> np.ndarray:
    """Noise-free change (e,) of the raw counts against rest, of a unit that rests at ``rest_counts``.

    law : ``"sheet"``, the film as a conducting sheet, 3 ms; ``"gap"``, one over the film's thickness, at no cost
    Raises TactileError for another law.
    """
    if law == SHEET:
        films = sensing_films(contact) if isinstance(contact, Contact) else contact.films
        rest = rest_counts(sensor)
        return divider.reading(reduced_sheet(sensor).growth(films), rest) - rest
    if law == GAP:
        return signal_of_gaps(contact.electrode_gaps, sensor)
    raise TactileError("electrodes", repr(law), ", ".join(LAWS))


@functools.cache
def rest_counts(sensor: str) -> np.ndarray:
    """Counts at rest (e,) of a typical unit; of a sensor where they are not known, those of its conducting sheet."""
    known = sensors.places_of(sensor).rest_counts
    if np.isfinite(known).all():
        return known
    found, sheet = sensors.skin_of(sensor).descriptor, reduced_sheet(sensor)
    impedance = sheet.at_rest + found.fluid.interface
    return sensors.COUNT_MAX / (1 + impedance / found.readout.load)
