"""Presses of 0.4 s whose contacts are the full tier's: the test contacts that ship, strung together through time.

The timing is that of ``benchmarks/make/make_sequences.py``: rest, force up through a press's contacts, 20 frames at the
deepest, on to where it slid if it did, force down, rest. Frames at a contact are exact, all of the hold of a press that
does not slide; between contacts signals, force, place and the square of the peak, which grows about as the force does,
are linear in time. `left_by_interpolation` says what that misses.
"""

from __future__ import annotations

import numpy as np

from benchmarks.make.make_sequences import AFTER, FALL, HOLD, REST, RISE
from tactile_core import accuracy, sensors
from tactile_core.simulation.pairs_file import Pairs

FEWEST = 3  # contacts of a press at one place, the last the deepest
LINEAR = "signal", "force", "center", "peak_squared"
Arrays = dict[str, np.ndarray]


def sequences(pairs: Pairs) -> Arrays:
    """Arrays (S, 40, ...) of all whole presses, named as ``make_sequences.described`` names them."""
    contacts = described(pairs)
    found = [_played(_rows(contacts, rows), pairs.slide[rows].any(axis=1)) for rows in presses(pairs)]
    arrays = {name: np.stack([each[name] for each in found]) for name in found[0]}
    return arrays | {"peak": np.sqrt(arrays["peak_squared"])}


def presses(pairs: Pairs) -> list[np.ndarray]:
    """Rows of each press that has all its depths, in the order in which it was solved."""
    rows = [np.flatnonzero(pairs.press == press) for press in np.unique(pairs.press)]
    return [each for each in rows if (~pairs.slide[each].any(axis=1)).sum() >= FEWEST]


def described(pairs: Pairs) -> Arrays:
    """Signal counts, force N, place m, peak squared m2 and patch, packed, (C, ...) of contacts."""
    gels = pairs.displacement_digit * np.float32(pairs.scale_digit)
    return {
        "signal": pairs.signal.astype(np.float64),
        "force": accuracy.lengths(pairs.force),
        "center": accuracy.dent_center(gels, sensors.digit_surface().rest),
        "peak_squared": np.square(accuracy.height(gels).max(axis=1), dtype=np.float64),
        "patch": np.packbits(pairs.contact_patch_digit, axis=1),
    }


def left_by_interpolation(pairs: Pairs) -> dict[str, float]:
    """Median error at each press's middle contact, drawn from those beside it: place mm, signal and peak %.

    Those lie twice as far apart as the contacts that frames are drawn from.
    """
    contacts, missed = described(pairs), []
    for rows in presses(pairs):
        low, middle, high = (_rows(contacts, rows[[number]]) for number in range(FEWEST))
        share = (middle["force"] - low["force"]) / (high["force"] - low["force"])
        guess = {name: low[name] + (high[name] - low[name]) * share for name in LINEAR}
        off = {name: float(accuracy.lengths(guess[name] - middle[name])[0]) for name in ("signal", "center")}
        peak = float(abs(np.sqrt(guess["peak_squared"] / middle["peak_squared"]) - 1)[0])
        missed.append((1e3 * off["center"], 100 * off["signal"] / accuracy.lengths(middle["signal"])[0], 100 * peak))
    return dict(zip(("place_mm", "signal_%", "peak_%"), np.nanmedian(missed, axis=0).tolist(), strict=True))


def _played(contacts: Arrays, slid: np.ndarray) -> Arrays:
    """Arrays (40, ...) of one press; slid : (n,) bool, contacts behind its slide."""
    deepest = int(np.flatnonzero(~slid)[-1])
    up = REST - 1 + RISE * contacts["force"][: deepest + 1] / contacts["force"][deepest]
    on = np.linspace(up[-1], up[-1] + HOLD, len(slid) - deepest)[1:]
    still = [up[-1] + HOLD] if len(on) == 0 else []
    order = [*range(len(slid)), *([deepest] if still else [])]
    frames = np.arange(REST + RISE + HOLD + FALL + AFTER)
    knots = np.r_[REST - 1, up, on, still, REST + RISE + HOLD + FALL]
    touched = (frames > knots[0]) & (frames < knots[-1])
    played = {name: _through(frames, knots, contacts[name][order], name == "center") for name in LINEAR}
    played["center"][~touched] = np.nan
    nearest = np.abs(frames[:, None] - knots[None, 1:-1]).argmin(axis=1)
    played["patch"] = contacts["patch"][order][nearest] * touched[:, None].astype(np.uint8)
    return played


def _through(frames: np.ndarray, knots: np.ndarray, values: np.ndarray, stays: bool) -> np.ndarray:
    """Values (T, ...) of frames (T,) between knots (n + 2,) with values (n, ...); at both ends 0, or the same on."""
    ends = (values[:1], values[-1:]) if stays else (0 * values[:1], 0 * values[:1])
    values = np.concatenate([ends[0], values, ends[1]])
    columns = values.reshape(len(values), -1).T
    return np.stack([np.interp(frames, knots, column) for column in columns], axis=-1).reshape(-1, *values.shape[1:])


def _rows(contacts: Arrays, rows: np.ndarray) -> Arrays:
    return {name: values[rows] for name, values in contacts.items()}
