"""CSV of grasps by BioTac SPs, ff_biotac_1..24 (3dperceptionlab/biotacsp-stability-set-v2): no time stamps."""

from __future__ import annotations

from functools import partial

from ...sensors import SP
from . import fingers_of, of_finger, share_of_fingers

CONTAINER, SENSOR = "csv", SP
NAME = "CSV with ff_biotac_1..24, mf_..., th_... of BioTac SPs, a grasp a line"
STYLE = "{}_biotac_{}"

score = partial(share_of_fingers, style=STYLE)
fingers = partial(fingers_of, style=STYLE)
read = partial(of_finger, layout=NAME, style=STYLE, snapshots=True)
