"""CSV of a BioTac SP that slides, ff_e1..24 at 100 Hz (yayaneath/BioTacSP-DoS): one finger, no time stamps."""

from __future__ import annotations

from functools import partial

from ...sensors import SP
from . import fingers_of, of_finger, share_of_fingers

CONTAINER, SENSOR = "csv", SP
NAME = "CSV with ff_e1..24 of a BioTac SP, a frame a line"
STYLE = "{}_e{}"

score = partial(share_of_fingers, style=STYLE)
fingers = partial(fingers_of, style=STYLE)
read = partial(of_finger, layout=NAME, style=STYLE, snapshots=False)
