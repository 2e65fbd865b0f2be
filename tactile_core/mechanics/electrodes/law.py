"""Compute the changes of the electrodes' counts from a contact, by the chosen law."""

from __future__ import annotations

import numpy as np

from ... import sensors
from ...errors import TactileError
from ...sensors import divider
from ..fast.contact_state import Contact
from ..solution import Solution
from .biotac_sheet import sensing_films
from .gap_law import signal_of_gaps
from .reduced_sheet import reduced_sheet

SHEET, GAP = LAWS = ("sheet", "gap")


def signal_of(contact: Contact | Solution, law: str = SHEET) -> np.ndarray:
    """Noise-free change (19,) of the raw counts against rest, of a unit that rests at ``sensors.REST_COUNTS``.

    law : ``"sheet"``, the film as a conducting sheet, 3 ms; ``"gap"``, one over the film's thickness, at no cost
    Raises TactileError for another law.
    """
    if law == SHEET:
        films = sensing_films(contact) if isinstance(contact, Contact) else contact.films
        return divider.reading(reduced_sheet().growth(films), sensors.REST_COUNTS) - sensors.REST_COUNTS
    if law == GAP:
        return signal_of_gaps(contact.electrode_gaps)
    raise TactileError("electrodes", repr(law), ", ".join(LAWS))
