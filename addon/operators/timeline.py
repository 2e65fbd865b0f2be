"""Frame rate, range and markers of the scene."""

from __future__ import annotations

import bpy
import numpy as np

from ...tactile_core.translation.trust_words import LOW_CONFIDENCE

MARKER = "low confidence"
MOST_MARKERS = 100  # more would hide the timeline


def set_timeline(scene: bpy.types.Scene, rate: float, first: int, last: int) -> None:
    """Play a recording of ``rate`` Hz in its own time."""
    scene.render.fps = max(1, round(rate))
    scene.render.fps_base = scene.render.fps / rate
    scene.frame_start, scene.frame_end = first, last
    scene.frame_set(first)


def mark_low_confidence(scene: bpy.types.Scene, confidence: np.ndarray, frames: np.ndarray) -> int:
    """Replace the markers, one where a doubtful part begins, its last frame in the name; returns how many parts."""
    for marker in [marker for marker in scene.timeline_markers if marker.name.startswith(MARKER)]:
        scene.timeline_markers.remove(marker)
    edges = np.diff(np.concatenate([[0], confidence < LOW_CONFIDENCE, [0]]).astype(int))
    parts = list(zip(np.flatnonzero(edges > 0), np.flatnonzero(edges < 0) - 1, strict=True))
    for start, end in parts[:MOST_MARKERS]:
        scene.timeline_markers.new(f"{MARKER} to {frames[end]:g}", frame=int(frames[start]))
    return len(parts)
