"""The published result figure of one recording: a few frames as columns, from the electrodes down to the picture."""

from __future__ import annotations

import contextlib
import dataclasses
import os
import textwrap
import warnings as python_warnings
from collections.abc import Iterator, Sequence

import numpy as np

from ..files import atomic
from ..sensors import SOURCE, title
from ..sensors.calibration_file import load_calibration
from ..sensors.camera import Camera
from ..translation.trust_words import LOW_CONFIDENCE
from .sheet_figure import FRAMES, SheetFigure, scale

WARNING_LINES, WARNING_WIDTH = 5, 200
# Lines in pieces: Agg refuses a noisy line of a hundred thousand points as a whole.
STYLE = {"font.size": 9, "axes.linewidth": 0.6, "agg.path.chunksize": 10_000}


@dataclasses.dataclass(frozen=True, eq=False)
class Contents:
    """Contents of a sheet of a recording of T frames, in k columns. Raises ValueError where their counts differ.

    name : of the recording; time : (T,) s, of snapshots their numbers; electrodes : (T, 19) counts, change from rest
    pressure, pressure_measured : (T,) Pa, rise of the fluid's as translated and by PDC; NaN where it was not measured
    frames : (k,) which of the T frames are the columns
    displacement_biotac : (k, N, 3) m; displacement_digit : (k, M, 3) m; pictures : (k, H, W, 3) uint8
    force : (k, 3) N; confidence : (k,) 0..1; flags : (k,) uint16; expected_error_digit : (k,) m, of the largest node
    contact_center : (k, 2) m = (x, z) on the DIGIT, NaN without contact; mount_shift : (2,) m, of a mount in it
    true_displacement_biotac : (k, N, 3) m of a simulated recording; warnings : sentences for the reader
    source : the sensor that was read, whose skin is drawn
    """

    name: str
    time: np.ndarray
    electrodes: np.ndarray
    frames: np.ndarray
    displacement_biotac: np.ndarray
    displacement_digit: np.ndarray
    pictures: np.ndarray
    force: np.ndarray
    confidence: np.ndarray
    flags: np.ndarray
    expected_error_digit: np.ndarray
    contact_center: np.ndarray | None = None
    pressure: np.ndarray | None = None
    pressure_measured: np.ndarray | None = None
    true_displacement_biotac: np.ndarray | None = None
    simulated: bool = False
    mount_shift: np.ndarray | float = 0.0
    warnings: Sequence[str] = ()
    source: str = SOURCE
    snapshots: bool = False

    def __post_init__(self) -> None:
        for what in COLUMNS:
            values = getattr(self, what)
            if values is not None and len(values) != len(self.frames):
                raise ValueError(f"contact sheet: {len(values)} of {what} for {len(self.frames)} frames")


COLUMNS = (
    "displacement_biotac", "displacement_digit", "pictures", "force", "confidence", "flags",
    "expected_error_digit",
    "contact_center", "true_displacement_biotac",
)  # fmt: skip


def choose_frames(strength: np.ndarray, count: int = FRAMES) -> np.ndarray:
    """Choose the frames (k,) to show, in order: the strongest contacts that lie apart from each other.

    Taken one by one, each at least half of a `count`-th of the recording away from those before.
    strength : (T,) any measure of contact, such as the rms change of the electrodes; NaN counts as none
    """
    left = np.where(np.isfinite(strength), strength, -1.0)
    count = min(count, len(left))
    frames, chosen = np.arange(len(left)), []
    for _ in range(count):
        best = int(np.argmax(left))
        chosen.append(best)
        left[np.abs(frames - best) < len(left) / (2 * count)] = -np.inf
    return np.sort(chosen)


def contact_sheet(path: str | os.PathLike, shown: Contents, camera: Camera | None = None) -> None:
    """Draw the sheet and write it to `path` as a PNG; equal contents make equal bytes.

    camera : None for the shipped calibration's
    """
    with _plain_matplotlib():
        content = _drawn(shown, camera or load_calibration().camera).png()
    atomic.write_bytes(path, content)


@contextlib.contextmanager
def _plain_matplotlib() -> Iterator[None]:
    """Use matplotlib in our style alone: a user's own settings must not change the bytes."""
    import matplotlib

    with matplotlib.rc_context(), python_warnings.catch_warnings():
        # Names may hold characters that the font lacks, which are drawn as boxes.
        python_warnings.filterwarnings("ignore", "Glyph .* missing from", UserWarning)
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(STYLE)
        yield


def _drawn(shown: Contents, camera: Camera) -> SheetFigure:
    displacement, truth = shown.displacement_biotac, shown.true_displacement_biotac
    figure = SheetFigure(
        len(shown.frames),
        camera,
        _sentences(shown.warnings, shown.confidence),
        truth is not None,
        pressure=shown.pressure is not None,
        snapshots=shown.snapshots,
    )
    # File names may hold what is no text at all.
    figure.title("".join(letter if letter.isprintable() else "?" for letter in shown.name), shown.simulated)
    figure.electrodes(shown.time, shown.electrodes, shown.frames)
    if shown.pressure is not None:
        figure.pressure(shown.time, shown.pressure, shown.pressure_measured)
    figure.headings(shown.time[shown.frames])
    largest = scale(displacement, truth)
    name = title(shown.source)
    label = f"{name}, unrolled\n" + ("translated" if shown.simulated else "displacement")
    center = None if shown.contact_center is None else shown.contact_center - shown.mount_shift
    figure.skin_row(label, displacement, largest, center, shown.source)
    if truth is not None:
        figure.skin_row(f"{name}, unrolled\ntrue (simulated)", truth, largest, None, shown.source)
    gel = title(camera.sensor)
    figure.gel_row(f"{gel} gel\ndisplacement", shown.displacement_digit, shown.contact_center)
    figure.picture_row(f"{gel} picture", shown.pictures)
    figure.captions(shown.force, shown.confidence, shown.flags, shown.expected_error_digit)
    return figure


def _sentences(warnings: Sequence[str], confidence: np.ndarray) -> list[str]:
    """Return warnings as lines that fit the sheet, no more than it has room for."""
    lines = [line for text in warnings for line in textwrap.wrap(text, WARNING_WIDTH, subsequent_indent="   ")]
    if len(confidence) and np.nanmax(confidence, initial=0) < LOW_CONFIDENCE:
        lines.insert(0, "Low confidence in every frame shown: take this as a guess.")
    if len(lines) > WARNING_LINES:
        lines = [*lines[: WARNING_LINES - 1], f"... and {len(lines) - WARNING_LINES + 1} more lines: see note.json"]
    return lines
