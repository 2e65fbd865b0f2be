"""Words for flags: a line that says how far a frame's translation can be trusted, and sentences on whole recordings."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ..recordings.flags import Flag

LOW_CONFIDENCE = 0.5  # assumed: frames of less are guesses
MOST_OF_DENT = 0.5  # expected error beyond which a dent's shape is a guess (assumed)
_REASONS = 2  # at most in a line, the gravest first
_UNLIKE, _SHAPE, _SILENT = "signals unlike training", "shape unsure", "no contact"
# What makes a frame a guess, the gravest first; then what is only worth saying.
_DOUBTS = {
    Flag.UNEXPLAINED: "unlike any contact",
    Flag.LAW_DOUBTED: "electrodes or skin doubted",
    Flag.POLARITY_DOUBTED: "polarity doubted",
    Flag.OUT_OF_RANGE: _UNLIKE,
    Flag.NO_QUIET_PART: "rest not found",
    Flag.RECTIFIED: "rectified recording",
    Flag.DEAD_CHANNEL: "dead electrode",
    Flag.SATURATED: "saturated electrode",
    Flag.TWO_CONTACTS: "perhaps two contacts",
    Flag.UNDECIDED_PLACE: "place undecided",
}
_REMARKS = {
    Flag.BEYOND_DIGIT: "beside the gel",
    Flag.BEYOND_PICTURE: "beside the picture",
    Flag.GEL_NOT_SOLVED: "gel not solved",
    Flag.POLARITY_ASSUMED: "polarity assumed",
    Flag.REPAIRED: "repaired sample",
    Flag.TIME_JUMP: "jump in time",
}

# Of the flags that the translation sets, which no warning of the recording mentions: so many of its frames.
SENTENCES = {
    Flag.OUT_OF_RANGE: "signals unlike those the networks were trained on",
    Flag.BEYOND_DIGIT: "the contact has no counterpart on the DIGIT's gel",
    Flag.BEYOND_PICTURE: "the contact lies on the gel beside its picture (--mount-shift X,Z moves it there)",
    Flag.UNDECIDED_PLACE: "by its own signals the contact may as well lie elsewhere",
    Flag.TWO_CONTACTS: "the signals look like two contacts at once (--contacts 2 looks for both)",
    Flag.UNEXPLAINED: "the signals resemble no contact's, or conductivity's more: drift, or rest under load",
    Flag.GEL_NOT_SOLVED: "no contact was solved on the gel, which is the networks' there, or at rest if they have none",
}
# N, as translated, of a BioTac of typical stiffness: of simulated contacts that read 4 to 5 N a fourth bear 1.5 times
# as much and more, of flat bodies 1.7 times; below 3 N a fourth bears over 1.1 times. The skin meets the core under a
# ball of 7 mm at 3.5 N, of 28 mm at 4.5 N, under a plate at 8 N.
FIRM = 4.0
TOO_FIRM = "force above {:.3g} N may be half of the true one: where the skin meets the core, signals stop growing"
DENIED = "PDC shows another pressure than that of the contact: drift, rest under load, or PDC of another sensor"


def is_guess(confidence: float, flags: int, expected_error: float = 0.0, dent: float = 0.0) -> bool:
    """Return true if a frame is a guess: by its confidence 0..1, the bits of its flags, or a large error of its shape.
    expected_error, dent : m, largest expected error and displacement of a node; NaN or below 0 if unknown"""
    doubted = confidence < LOW_CONFIDENCE or any(flags & bit for bit in _DOUBTS)
    return bool(doubted or (dent > 0 and expected_error > MOST_OF_DENT * dent))


def remarks(flags: int) -> list[str]:
    """Return what each of a frame's flags means, a few words each, the gravest first."""
    return [words for bit, words in (_DOUBTS | _REMARKS).items() if flags & bit]


def in_words(
    confidence: float, flags: int, expected_error: float, dent: float, force: Sequence[float] | np.ndarray
) -> str:
    """Return a frame's line, such as "guess: rectified recording, expected error 0.40 mm of 1.20", or "no contact".
    confidence : 0..1; flags : bits; expected_error, dent : m, NaN or below 0 if unknown
    force : (3,) N of the translation, zero without contact, when no error is stated"""
    reasons = remarks(flags)
    touching = bool(np.any(force))
    guess = is_guess(confidence, flags, expected_error if touching else 0.0, dent)
    untold = guess and not any(flags & bit for bit in _DOUBTS)
    if untold and (confidence < LOW_CONFIDENCE or expected_error <= dent):
        reasons.insert(0, _UNLIKE if confidence < LOW_CONFIDENCE else _SHAPE)
    reasons = reasons[:_REASONS]
    if guess and not touching:
        reasons.insert(0, _SILENT)
    verdict = "guess" if guess else "as in training" if touching else _SILENT
    if touching and expected_error > dent:
        verdict = "nothing but a touch is known"
    line = ": ".join([verdict, *filter(None, [", ".join(reasons)])])
    if not touching:
        return line
    if not expected_error >= 0:
        return f"{line}, error not known"
    return f"{line}, expected error {1e3 * expected_error:.2f} mm" + (f" of {1e3 * dent:.2f}" if dent >= 0 else "")
