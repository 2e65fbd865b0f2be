"""Warnings of doubtful signals as data, a reason and its facts; the sentences for users are made here alone."""

from __future__ import annotations

import enum
from collections.abc import Collection, Iterable
from typing import Any

_LIKE = "signals unlike simulated contacts: "


class Reason(enum.Enum):
    """Reason of a doubt; its value is the sentence for users, a format string with names of facts in braces."""

    POLARITY_ASSUMED = (
        "polarity assumed: {found}. Counts are taken to fall where the film thins, as raw ones do; say --polarity rises"
        " if they hold rest minus reading"
    )
    POLARITY_CONTRADICTED = "polarity {name!r} contradicts the recording ({found})"
    REST_GUESSED = "no quiet part ({found}): rest is guessed from the calmest {frames} frames, {first}:{last}"
    REST_LOADED = (
        "what is calm looks like a contact, which explains {share:.0%} of how it differs from a unit at rest: rest was"
        " perhaps taken under load. Give the unit's own (--sensor), or frames without contact (--tare)"
    )
    REST_OF_FILE = "no quiet part ({found}): the file's own zero is taken for rest"
    REST_OF_UNIT = "rest is the unit's own: {found}"
    REST_CARRIED = "no quiet part: the rest of the part before is taken"
    LAW_LEFT_OVER = (
        _LIKE + "{left:.0%} of them is left over by their neighbours among these, as a mean of {contacts} contacts, at"
        " most {most:.0%} of a unit as simulated. Polarity, gains, order of the electrodes or rest may be wrong: see"
        " tactile info, --polarity, --tare, and tactile adapt for gains"
    )
    LAW_PRESSURE = (
        _LIKE + "the fluid's pressure is {ratio:.2f} times theirs, as the median of {contacts} contacts, {least:g} to"
        " {most:g} of a unit as simulated. The skin may be softer or stiffer, or filled to another pressure: forces are"
        " wrong by about as much"
    )
    LAW_EXCHANGED = (
        _LIKE + "{share:.1%} of them is explained if E{first} and E{second} are exchanged, at most {most:.1%} of a unit"
        " as simulated: look at their plugs, or at the order of the file's columns"
    )
    LAW_GAINS = (
        _LIKE + "{share:.1%} of them is explained by gains of the electrodes {spread:.0%} apart, at most {most:.0%} or"
        " {usual:.0%} of a unit as simulated: see tactile adapt"
    )


POLARITY = frozenset({Reason.POLARITY_ASSUMED, Reason.POLARITY_CONTRADICTED})
REST = frozenset({Reason.REST_GUESSED, Reason.REST_OF_FILE, Reason.REST_OF_UNIT})
LAW = frozenset({Reason.LAW_LEFT_OVER, Reason.LAW_PRESSURE, Reason.LAW_EXCHANGED, Reason.LAW_GAINS})


class Doubt(str):
    """Warning whose text is the sentence for users; it carries its reason."""

    reason: Reason

    def __new__(cls, reason: Reason, **facts: Any) -> Doubt:
        """Make the warning from the reason's sentence and the facts (name -> value) that fill its braces."""
        made = super().__new__(cls, reason.value.format(**facts))
        made.reason = reason
        return made


def reason_of(warning: str) -> Reason | None:
    """Return the reason of a warning that is a `Doubt`; None for any other warning."""
    return warning.reason if isinstance(warning, Doubt) else None


def without(warnings: Iterable[str], reasons: Collection[Reason]) -> tuple[str, ...]:
    """Return the warnings without those that are a `Doubt` for one of the reasons."""
    return tuple(one for one in warnings if reason_of(one) not in reasons)
