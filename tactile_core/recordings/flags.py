"""Flags of single frames as bits of an integer; a recording's flags are (T,) uint16."""

from __future__ import annotations

import enum


class Flag(enum.IntFlag):
    """Bits of a frame's flags, in a file the dataset ``flags``; the file's attributes name them."""

    REPAIRED = 1  # one or more electrode samples were bad (drop-out, NaN, glitch) and were interpolated
    TIME_JUMP = 2  # the time stamp went back, stood still or left a gap before this frame
    RECTIFIED = 4  # the recording holds absolute changes: their sign is lost
    NO_QUIET_PART = 8  # no part without contact was found, so the tare is a guess
    SATURATED = 16  # an electrode is at an end of its 12-bit range
    DEAD_CHANNEL = 32  # an electrode, or all of them, stands still for long
    OUT_OF_RANGE = 64  # the signals lie outside those the networks were trained on
    BEYOND_DIGIT = 128  # the contact has no counterpart on the DIGIT's gel
    POLARITY_ASSUMED = 256  # whether counts fall or rise where a film thins is not shown: taken to fall, as raw ones do
    POLARITY_DOUBTED = 512  # the user's word on it, or the file's, contradicts what the recording shows
    BEYOND_PICTURE = 1024  # the contact lies on the DIGIT's gel, beside what its camera sees
    UNDECIDED_PLACE = 2048  # the signals of this frame alone may as well come from a contact 3 mm or more away
    GEL_NOT_SOLVED = 4096  # no contact was solved on the DIGIT (``--gel solved``): its gel is the networks'
    TWO_CONTACTS = 8192  # the signals look like those of two contacts at once
    LAW_DOUBTED = 16384  # the recording's contacts together resemble no simulated ones: gains, order, rest or skin
    UNEXPLAINED = 32768  # the signals resemble no simulated contact's, or PDC denies it: drift, or rest under load


def names() -> dict[str, int]:
    """Return the flags' names in lower case, each with its bit as a number, for files' attributes and notes."""
    return {str(flag.name).lower(): int(flag) for flag in Flag}
