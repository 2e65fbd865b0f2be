"""Measure how visible real contacts are in the translated pictures: the strongest change of grey levels in a small
window.

A translation that answers every contact with the same shallow average passes where places and ranks are judged; its
pictures stay empty.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from tactile_core.accuracy import Row, row
from tactile_core.pictures.height_map import folds_counted, height_map
from tactile_core.pictures.renderer import Renderer
from tactile_core.recordings import Signals
from tactile_core.sensors import PRESSURE_PER_COUNT
from tactile_core.translation.contact_track import FRAME
from tactile_core.translation.translate import Decoded, pass_over
from tactile_core.translation.translator import Translator

WINDOW = 32  # px
VISIBLE = 2.0  # grey levels rms in the strongest window: what one sees beside the camera's noise (a target)
CONTACT, LOST = 550.0, 75.0  # Pa of the fluid: surely in contact; contact lost
EVERY = 20  # frames between two that are drawn
CHUNK = 32  # frames in memory at a time


def rows(name: str, prepared: Iterable[Signals], network: Translator) -> list[Row]:
    """Rows ``<name>_print_...`` of recordings with their pressure.

    Judged are frames above 550 Pa whose contact lies inside the picture; baseline: frames that lost contact.
    """
    frames = np.concatenate([_frames(signals, network) for signals in prepared])
    pressure, seen, level = frames.T
    contact, lost = pressure > CONTACT, pressure < LOST
    inside = contact & (seen > 0)
    of = f"{inside.sum()} of {contact.sum()} frames above {CONTACT:g} Pa have their contact in the picture"
    baseline = f"; baseline: {lost.sum()} frames below {LOST:g} Pa"

    found = [row(f"{name}_contact_in_picture", _over(np.mean, seen[contact]), "1", of=f"{contact.sum()} frames")]
    if inside.any():
        for metric, values, unit, over in (
            ("visible", level > VISIBLE, "1", np.mean),
            ("level", level, "levels rms", np.median),
        ):
            nothing = _over(over, values[lost])
            found.append(
                row(f"{name}_print_{metric}", _over(over, values[inside]), unit, baseline=nothing, of=of + baseline)
            )
    return found


def _over(metric: Callable[[np.ndarray], float], values: np.ndarray) -> float | None:
    return float(metric(values)) if len(values) else None


def _frames(signals: Signals, network: Translator) -> np.ndarray:
    """Rows (T, 3) of every 20th frame: pressure Pa, whether the contact lies in the picture, levels of `strongest`."""
    every, render = np.arange(len(signals.change)), Renderer(preset="fast")
    whole = pass_over(network, signals, every * FRAME)
    return np.concatenate([_drawn(whole(rows), render) for rows in _chunks(every[::EVERY])])


def _chunks(frames: np.ndarray) -> list[np.ndarray]:
    return [frames[start : start + CHUNK] for start in range(0, len(frames), CHUNK)]


def _drawn(decoded: Decoded, render: Renderer) -> np.ndarray:
    signals, found = decoded.signals, decoded.translation
    place = found.contact_center
    seen = np.isfinite(place[:, 0]) & render.camera.sees(*place.T)
    rest = np.rint(render.background)
    with folds_counted():  # counted, not logged frame by frame
        heights = height_map(found.displacement_digit, render.camera)
    levels = [strongest(render(height) - rest) for height in heights]
    return np.column_stack([PRESSURE_PER_COUNT * signals.pdc, seen, levels])


def strongest(change: np.ndarray) -> float:
    """Root mean square, grey levels, of a change of picture (H, W, 3) in the window of 32 px where it is largest."""
    summed = np.pad(np.square(change).mean(axis=2), ((1, 0), (1, 0))).cumsum(0).cumsum(1)
    rows_of_windows = summed[WINDOW:] - summed[:-WINDOW]
    windows = rows_of_windows[:, WINDOW:] - rows_of_windows[:, :-WINDOW]
    return float(np.sqrt(max(windows.max(), 0.0)) / WINDOW)  # below 0 by rounding
