"""Message sr_robot_msgs/BiotacAll of Shadow Robot's driver: five BioTacs a message."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from ...sensors import ELECTRODES

CONTAINER = "bag"
NAME = "bag with sr_robot_msgs/BiotacAll"
MESSAGE = "sr_robot_msgs/msg/BiotacAll"
WIDTH = 5 + ELECTRODES  # pdc, tac, tdc, pac0, pac1, electrodes
_SENSOR = "int16 pac0\nint16 pac1\nint16 pdc\nint16 tac\nint16 tdc\n"
# With the published hashes 47a346cfb98ba8199f53056f3ea612f1 (19 electrodes) and that of the later, open list.
VERSIONS = [
    {
        "sr_robot_msgs/msg/Biotac": _SENSOR + electrodes + "\n",
        MESSAGE: "std_msgs/Header header\nsr_robot_msgs/Biotac[5] tactiles\n",
    }
    for electrodes in ("int16[] electrodes", "int16[19] electrodes")
]


def score(keys: Collection[str]) -> float:
    """Return 1 where a topic carries the message, else 0."""
    return float(MESSAGE in keys)


def sensors(message: Any) -> list[Any]:
    """Return the five BioTacs of a message."""
    return message.tactiles


def row(sensor: Any) -> list[float]:
    """Return one row: pdc, tac, tdc, pac..., electrodes."""
    return [sensor.pdc, sensor.tac, sensor.tdc, sensor.pac0, sensor.pac1, *sensor.electrodes]
