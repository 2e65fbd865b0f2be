"""Message biotac_sensors/BioTacHand of SynTouch's driver for ROS: any number of BioTacs, 22 PAC samples each."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from ...sensors import ELECTRODES

CONTAINER = "bag"
NAME = "bag with biotac_sensors/BioTacHand"
MESSAGE = "biotac_sensors/msg/BioTacHand"
PAC = 22
WIDTH = 3 + PAC + ELECTRODES
# With the published hash d96f900cbfb096d61de125081e11dcab.
VERSIONS = [
    {
        "biotac_sensors/msg/BioTacData": f"""\
string bt_serial
uint16 bt_position
uint16 tdc_data
uint16 tac_data
uint16 pdc_data
uint16[{PAC}] pac_data
uint16[{ELECTRODES}] electrode_data
""",
        "biotac_sensors/msg/BioTacTime": f"""\
time frame_start_time
time frame_end_time
uint32 tdc_ns_offset
uint32 tac_ns_offset
uint32 pdc_ns_offset
uint32[{PAC}] pac_ns_offset
uint32[{ELECTRODES}] electrode_ns_offset
""",
        MESSAGE: """\
Header header
string hand_id
biotac_sensors/BioTacData[] bt_data
biotac_sensors/BioTacTime bt_time
""",
    }
]


def score(keys: Collection[str]) -> float:
    """Return 1 where a topic carries the message, else 0."""
    return float(MESSAGE in keys)


def sensors(message: Any) -> list[Any]:
    """Return the BioTacs of a message."""
    return message.bt_data


def row(sensor: Any) -> list[float]:
    """Return one row: pdc, tac, tdc, pac..., electrodes."""
    return [sensor.pdc_data, sensor.tac_data, sensor.tdc_data, *sensor.pac_data, *sensor.electrode_data]
