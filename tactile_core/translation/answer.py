"""Options for estimating a contact from the posterior of each frame's signals."""

from __future__ import annotations

import dataclasses
import math
import re
from typing import Literal

import numpy as np

from ..errors import TactileError

CONTACTS = 1, 2  # that may be looked for in a frame
MOST_SAMPLES = 100  # contacts per frame; 50 bytes each (assumed enough)
FARTHEST = 25.0  # mm, the gel's length: beyond, no contact of the BioTac lies on it
Estimate = Literal["likely", "mean"]
LIKELY: Estimate = "likely"
MEAN: Estimate = "mean"


@dataclasses.dataclass(frozen=True)
class Answer:
    """Options of the estimate for each frame.

    kind : the most plausible contact, or the mean of all plausible ones, which may resemble none of them
    frames_apart : estimate each frame from its own signals; otherwise the contact is tracked through all frames
    mount_shift_mm : (x, z), shift of contacts on the DIGIT's gel: the position of the BioTac on it
    samples : number of contacts drawn for each frame from its posterior
    contacts : 2 looks for a second contact in each frame. Use it only where there may be two: on a real unit a single
        wide contact is often taken for two"""

    kind: Estimate = LIKELY
    frames_apart: bool = False
    mount_shift_mm: tuple[float, float] = (0.0, 0.0)
    samples: int = 0
    contacts: int = 1

    def __post_init__(self) -> None:
        """Raise ValueError for a shift longer than the gel, or for too many samples."""
        if not all(abs(one) <= FARTHEST for one in self.mount_shift_mm):
            raise ValueError(f"mount_shift_mm {self.mount_shift_mm}: within {FARTHEST:g} mm")
        if not 0 <= self.samples <= MOST_SAMPLES:
            raise ValueError(f"samples {self.samples}: 0 to {MOST_SAMPLES}")
        if self.contacts not in CONTACTS:
            raise ValueError(f"contacts {self.contacts}: 1 or 2")

    @property
    def follows(self) -> bool:
        """Return true if contacts are tracked through the frames."""
        return self.kind == LIKELY and not self.frames_apart

    @property
    def mount_shift(self) -> np.ndarray:
        """Shift (2,) m of contacts on the gel."""
        return 1e-3 * np.array(self.mount_shift_mm)

    def describe_shift(self) -> tuple[str, ...]:
        """Describe a mount's shift in sentences for the user; none without a shift."""
        if not any(self.mount_shift_mm):
            return ()
        x, z = self.mount_shift_mm
        return (f"contacts lie {x:g} mm along x and {z:g} mm along z from their place on the DIGIT (--mount-shift)",)


def parse_answer(
    kind: Estimate, frames_apart: bool, mount_shift: str | None, samples: int, contacts: int = 1
) -> Answer:  # fmt: skip
    """Return the options of a command line; mount_shift : ``"X,Z"`` mm, or None for no shift. Raises TactileError for a
    shift or a number of samples out of range."""
    if not 0 <= samples <= MOST_SAMPLES:
        raise TactileError("--samples", str(samples), f"0 to {MOST_SAMPLES}")
    shift = (0.0, 0.0) if mount_shift is None else parse_shift(mount_shift)
    return Answer(kind, frames_apart, shift, samples, contacts)


def parse_shift(text: str) -> tuple[float, float]:
    """Parse ``"4,-1.5"`` to (4.0, -1.5) mm; raises TactileError for anything else, or a shift longer than the gel."""
    number = r"\s*([+-]?\d{1,3}(?:\.\d{0,6})?)\s*"
    found = re.fullmatch(f"{number},{number}", text)
    x, z = (float(part) for part in found.groups()) if found else (math.inf, math.inf)
    if max(abs(x), abs(z)) > FARTHEST:
        expected = f"X,Z in mm, each from -{FARTHEST:g} to {FARTHEST:g}, such as 4,-1.5"
        raise TactileError(
            "--mount-shift", repr(text), expected, "Give it that way; for a negative X --mount-shift=-4,0"
        )
    return x, z
