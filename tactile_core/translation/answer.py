"""Options of the estimate of a contact from each frame's posterior (its probability given the electrodes' signals)."""

from __future__ import annotations

import dataclasses
import math
import re
from typing import Literal

import numpy as np

from ..errors import TactileError, finite_number

CONTACTS = 1, 2  # that may be looked for in a frame
MOST_SAMPLES = 100  # contacts per frame; 50 bytes each (assumed enough)
FARTHEST = 25.0  # mm, the gel's length: beyond, no contact of the BioTac lies on it
Estimate = Literal["likely", "mean"]
LIKELY: Estimate = "likely"
MEAN: Estimate = "mean"


@dataclasses.dataclass(frozen=True)
class Answer:
    """Options of the estimate for each frame.

    kind : "likely", the most plausible contact, or "mean", of all plausible ones, which may resemble none of them
    frames_apart : true estimates each frame from its own signals; false tracks the contact through all frames
    mount_shift_mm : (x, z), shift of contacts on the DIGIT's gel: where on it the BioTac is mounted
    samples : number of contacts that `tactile convert` and `batch` draw for each frame from its posterior
    contacts : 1, or 2 to look for a second in each frame. Use 2 only if there may be two: on a real unit a single wide
        contact is often taken for two"""

    kind: Estimate = LIKELY
    frames_apart: bool = False
    mount_shift_mm: tuple[float, float] = (0.0, 0.0)
    samples: int = 0
    contacts: int = 1

    def __post_init__(self) -> None:
        """Raise TactileError for an unknown kind, a shift longer than the gel, too many samples or contacts."""
        shift, expected = self.mount_shift_mm, f"a tuple (x, z) within {FARTHEST:g} mm"
        if not (isinstance(shift, tuple) and len(shift) == 2):
            raise TactileError("Answer, mount_shift_mm", f"{shift!r:.80}", expected)
        for each in shift:
            finite_number(each, "Answer, mount_shift_mm", expected, -FARTHEST, FARTHEST)
        for name, right, expected in (
            ("kind", self.kind in (LIKELY, MEAN), f"{LIKELY} or {MEAN}"),
            ("samples", self.samples in range(MOST_SAMPLES + 1), f"0 to {MOST_SAMPLES}"),
            ("contacts", self.contacts in CONTACTS, "1 or 2"),
        ):
            if not right:
                raise TactileError(f"Answer, {name}", repr(getattr(self, name)), expected)

    @property
    def follows(self) -> bool:
        """Return true if contacts are tracked through the frames."""
        return self.kind == LIKELY and not self.frames_apart

    @property
    def mount_shift(self) -> np.ndarray:
        """Shift (2,) = (x, z) m of contacts on the gel."""
        return 1e-3 * np.array(self.mount_shift_mm)

    def describe_shift(self) -> tuple[str, ...]:
        """Describe the mount's shift in sentences for the user; return none without a shift."""
        if not any(self.mount_shift_mm):
            return ()
        x, z = self.mount_shift_mm
        return (f"contacts lie {x:g} mm along x and {z:g} mm along z from their place on the DIGIT (--mount-shift)",)


def parse_shift(text: str) -> tuple[float, float]:
    """Parse ``"4,-1.5"`` to (4.0, -1.5) mm; raises TactileError for anything else, or a shift longer than the gel."""
    number = r"\s*([+-]?\d{1,3}(?:\.\d{0,6})?)\s*"
    found = re.fullmatch(f"{number},{number}", text)
    x, z = (float(part) for part in found.groups()) if found else (math.inf, math.inf)
    if max(abs(x), abs(z)) > FARTHEST:
        expected = f"X,Z in mm, each from -{FARTHEST:g} to {FARTHEST:g}, such as 4,-1.5"
        advice = "Give it that way; for a negative X --mount-shift=-4,0"
        raise TactileError("--mount-shift", repr(text), expected, advice)
    return x, z
