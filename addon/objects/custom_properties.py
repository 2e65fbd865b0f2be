"""The recording's numbers as keyframed custom properties of the skin, for drivers of the user's own."""

from __future__ import annotations

import bpy
import numpy as np

from . import curves

UNKNOWN = -1e-6  # m, of an expected error: a keyed property holds no NaN
ABOUT = {
    "electrodes": "Change of the electrodes against rest, counts",
    "pdc": "Fluid pressure as recorded, counts",
    "force": "Force of the object on the BioTac, N, along the finger, across it, and into the pad (negative Z)",
    "confidence": "1: signals like those of the training, 0: far from them",
    "expected_error_um": "Largest node error of this surface that half of such frames stay below, micrometres;"
    " below 0 where it is not known",
    "flags": "What is remarkable about the frame, as bits; the tab Tactile says it in words",
}


def write(thing: bpy.types.Object, values: dict[str, np.ndarray], frames: np.ndarray) -> None:
    """Set and keyframe custom properties: values (T,) or (T, k) by the names of ``ABOUT``, at frames (T,)."""
    for name, numbers in values.items():
        bits = name == "flags"  # which mean nothing between two frames
        numbers = np.nan_to_num(np.asarray(numbers, int if bits else np.float64))
        thing[name] = numbers[0].tolist()
        thing.id_properties_ui(name).update(description=ABOUT[name])
        lines = curves.CONSTANT if bits else curves.LINEAR
        curves.write_curves(thing, f'["{name}"]', frames, numbers.reshape(len(frames), -1), lines)
