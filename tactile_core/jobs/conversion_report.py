"""What a conversion tells its user: warnings, errors to expect, and the contact sheet."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..recordings import flags
from ..sensors import PRESSURE_PER_COUNT
from ..translation.card import doubt
from ..translation.trust_words import SENTENCES
from .contact_sheet import Contents, choose_frames, contact_sheet
from .frame_pass import FramePass, Tools
from .frames_file import described
from .sampling_error import depth_share

if TYPE_CHECKING:
    from ..translation.translate import PreparedRows

BLOCK = 2**16  # frames of signals alone that are looked at at a time
SHEET_ARRAYS = (
    "displacement_biotac", "displacement_digit", "force", "confidence", "flags", "expected_error_digit",
    "contact_center",
)  # fmt: skip
LEFT = ("expected_error_digit", "error_bound_digit")


class ConversionReport:
    """Keeps of the frames that it is given only what is told of all of them, and what the contact sheet shows.

    flagged : frames of each flag; share : the deepest move of a node, over the gel's thickness
    """

    def __init__(self, rows: PreparedRows, frames: np.ndarray, tools: Tools, made: FramePass) -> None:
        """Take the prepared rows, and rising frames (T,) of them that `made` takes through."""
        self._rows, self._frames, self._tools, self._made = rows, frames, tools, made
        self.flagged: dict[str, int] = dict.fromkeys(flags.names(), 0)
        self.share = 0.0
        self._errors: list[np.ndarray] = []
        self._pressure: list[np.ndarray] = []
        self._forces: list[np.ndarray] = []  # that the traction adds up to, and the networks'
        change, at = rows.signals.change, rows.at(frames)
        parts = [at[start : start + BLOCK] for start in range(0, len(at), BLOCK)]
        chosen = choose_frames(np.concatenate([np.abs(change[part]).mean(axis=1) for part in parts]))
        self._shown: dict[int, dict[str, np.ndarray]] = {int(frame): {} for frame in frames[chosen]}

    def take(self, frames: np.ndarray, arrays: dict[str, np.ndarray]) -> None:
        """Take the arrays of some frames."""
        for name, bit in flags.names().items():
            self.flagged[name] += int(np.count_nonzero(arrays["flags"] & bit))
        touching = np.isfinite(arrays["contact_center"][:, 0])
        self._errors.append(np.stack([arrays[name][touching] for name in LEFT]))
        self._pressure.append(arrays["pressure"])
        self.share = max(self.share, depth_share(arrays["displacement_digit"], self._tools.drawer.target))
        if "traction_force" in arrays:
            self._forces.append(np.stack([arrays["traction_force"], arrays["force"]]))
        rows = np.flatnonzero(np.isin(frames, list(self._shown)))
        pictures = self._made.pictures(arrays, rows) if len(rows) else []
        for row, picture in zip(rows, pictures, strict=True):
            # Copies, so that the chunk can be freed.
            kept = {name: np.array(arrays[name][row]) for name in SHEET_ARRAYS} | {"pictures": np.array(picture)}
            self._shown[int(frames[row])] = kept

    def warnings(self) -> tuple[str, ...]:
        """Return warnings for the user: of the recording, and of its translated frames."""
        translator, drawer = self._tools.translator, self._tools.drawer
        found = [
            *self._rows.signals.warnings,
            *translator.answer.describe_shift(),
            *filter(None, [doubt(translator.card)]),
        ]
        found += drawer.describe_gel()
        for flag, words in SENTENCES.items():
            name = str(flag.name).lower()
            if self.flagged[name]:
                meaning = described(words, self._tools.pair)
                found.append(f"{self.flagged[name]} of {len(self._frames)} frames: {meaning} (flag {name})")
        if self._made.folded:
            found.append(f"{self._made.folded} frames: the translated gel folds over itself; heights there are guesses")
        return tuple(found)

    def describe_expected_error(self) -> str:
        """Describe the translation's own error on the gel: the median of the frames in contact."""
        errors = np.concatenate(self._errors, axis=1)
        if not errors.shape[1]:
            return "no frame is in contact, so the translation expects no error"
        expected, bound = 1e3 * np.median(errors, axis=1)
        if np.isnan(expected):
            return "the translation's own error is not known on this gel, which no networks lead to"
        return (
            f"the translation itself, beside this: the worst node of its gel is off by {expected:.2f} mm in half of "
            f"such contacts, by less than {bound:.2f} mm in 95 of 100"
        )

    def describe_traction(self) -> str:
        """Describe by how much the kept traction misses the force; empty where it is not kept."""
        if not self._forces:
            return ""
        from .solved_gel import describe_miss

        total, force = np.concatenate(self._forces, axis=1)
        return describe_miss(total, force, solved=self._tools.drawer.solve is not None)

    def draw_sheet(self, path: Path) -> None:
        """Draw the contact sheet of the frames kept for it, once all were taken."""
        recording, signals = self._rows.recording, self._rows.signals
        shown, rows = np.array(list(self._shown)), self._rows.at(self._frames)
        columns = {name: np.stack([at[name] for at in self._shown.values()]) for name in (*SHEET_ARRAYS, "pictures")}
        truth, timeless = recording.truth, bool(np.isnan(recording.time).all())
        skin = None if truth is None else truth.displacement_biotac
        contents = Contents(
            name=recording.name,
            time=self._frames if timeless else recording.time[rows],
            snapshots=timeless,
            electrodes=signals.change[rows],
            frames=np.searchsorted(self._frames, shown),
            true_displacement_biotac=None if skin is None else skin[self._rows.at(shown)],
            simulated=recording.simulated,
            mount_shift=self._tools.translator.answer.mount_shift,
            pressure=np.concatenate(self._pressure),
            pressure_measured=PRESSURE_PER_COUNT * signals.pdc[rows],
            warnings=self.warnings(),
            source=self._tools.translator.source,
            **columns,
        )
        contact_sheet(path, contents, self._tools.drawer.camera)
