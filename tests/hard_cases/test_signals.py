"""Recordings that are hard to read: saturated, dead, coarse, drifting, too short, and signals unlike all of training.

The truth is the shipped recording's own (simulated, 12-bit counts): what its good signals give is compared with what
its spoilt ones give. Where a frame cannot be trusted it must be flagged or worth little confidence.
"""

from __future__ import annotations

import dataclasses
import functools
import tempfile
from pathlib import Path

import numpy as np

from hard_cases.case import FAST_PICTURE, HEIGHT_MAP, TRANSLATION, Found, case
from tactile_core import accuracy, recordings
from tactile_core.jobs.convert import Options, ToolOptions, convert, load_tools
from tactile_core.pictures.height_map import gel_mapper
from tactile_core.pictures.renderer import Renderer
from tactile_core.recordings import Recording, Signals
from tactile_core.recordings.flags import Flag
from tactile_core.translation import networks
from tactile_core.translation.translate import load_translator
from tactile_core.translation.translator import UNTRAINED_CONFIDENCE, Translation

ROOT = Path(__file__).resolve().parents[2]
SHIPPED = ROOT / "scenes/press_roll_slide/press_roll_slide.h5"
EVERY = 12  # frames that are translated: one in so many


@functools.cache
def shipped() -> Recording:
    """The recording that ships; it knows its truth."""
    return recordings.read(SHIPPED)


def prepared(**change) -> tuple[Recording, Signals]:
    """The shipped recording with a change, and its signals."""
    recording = dataclasses.replace(shipped(), **change)
    return recording, recordings.prepare(recording)


translator = functools.cache(load_translator)


def translated(signals: Signals) -> tuple[Translation, np.ndarray]:
    """Some frames, and which."""
    frames = np.arange(0, len(signals.change), EVERY)
    part = {name: getattr(signals, name)[frames] for name in ("change", "electrodes", "quiet", "flags", "pdc")}
    return translator()(dataclasses.replace(signals, **part)), frames


@functools.cache
def _clean() -> tuple[float, float]:
    found, frames = translated(prepared()[1])
    return _error(found, frames), _cover(found, frames)


def _error(found: Translation, frames: np.ndarray) -> float:
    """Rms error of the gel's nodes, m, over frames in contact."""
    truth = shipped().truth.displacement_digit[frames]
    touched = np.linalg.norm(shipped().truth.force[frames], axis=1) > 0.1
    return float(np.sqrt(((found.displacement_digit - truth)[touched] ** 2).sum(-1).mean()))


def _cover(found: Translation, frames: np.ndarray) -> float:
    """Share of frames, %, whose largest node error lies below the stated bound."""
    truth = shipped().truth.displacement_digit[frames]
    return 100 * float((accuracy.max_error(found.displacement_digit, truth) <= found.error_bound_digit).mean())


def _flagged(found: Translation, signals: Signals, flag: Flag, share: float) -> tuple[str, ...]:
    """What is wrong where a flag or the low confidence that goes with it is missing from a share of the frames."""
    flagged = (found.flags & int(flag)) > 0
    broken = []
    if flagged.mean() < share:
        broken.append(f"{flagged.mean():.0%} of the frames carry {flag.name}, not {share:.0%}")
    if flagged.any() and found.confidence[flagged].max() > UNTRAINED_CONFIDENCE + 1e-6:
        broken.append(f"confidence {found.confidence[flagged].max():.2f} where {flag.name} is set")
    if not signals.warnings:
        broken.append("no warning in words")
    return tuple(broken)


def _finite(found: Translation) -> tuple[str, ...]:
    names = ("displacement_biotac", "displacement_digit", "force", "confidence", "error_bound_digit")
    return tuple(f"{name} is not finite" for name in names if not np.isfinite(getattr(found, name)).all())


@case("as_it_is", "12-bit quantisation", TRANSLATION,
      "whole counts: 90 % of the frames at least lie within the stated 95 % bound")  # fmt: skip
def test_as_it_is() -> Found:
    """The shipped recording, which holds whole counts of 12 bits."""
    found, frames = translated(prepared()[1])
    words = f"rms error {_error(found, frames) * 1e6:.1f} um of the gel's nodes"
    return Found(_cover(found, frames), "percent", 90.0, at_least=True, words=words, broken=_finite(found))


@case("coarser_counts", "12-bit quantisation", TRANSLATION,
      "rounding to whole counts adds less than 2 um to the gel's rms error, noise being 0.7 to 1.5 counts")  # fmt: skip
def test_rounding() -> Found:
    """Counts with a fraction restored by the noise that rounding hides, against the whole ones."""
    random = np.random.default_rng(1)
    dithered = shipped().electrodes + random.uniform(-0.5, 0.5, shipped().electrodes.shape)
    found, frames = translated(prepared(electrodes=dithered)[1])
    error = _error(found, frames)
    return Found((error - _clean()[0]) * 1e6, "um", 2.0, words=f"{_clean()[0] * 1e6:.1f} um with whole counts")


@case("saturated_electrodes", "saturated electrodes", TRANSLATION,
      "frames at an end of the range carry SATURATED, electrodes are named, confidence <= 0.2")  # fmt: skip
def test_saturated() -> Found:
    """A gain that drives four electrodes to 4095."""
    counts = shipped().electrodes.copy()
    counts[:, :4] = np.clip(counts[:, :4] + 4090 - np.percentile(counts[:, :4], 60, axis=0), 0, 4095)
    hit = (counts >= 4095).any(axis=1)
    _, signals = prepared(electrodes=counts)
    found, frames = translated(signals)
    marked = (found.flags & int(Flag.SATURATED)) > 0
    share = 100 * float((marked == hit[frames]).mean())
    broken = (*_flagged(found, signals, Flag.SATURATED, 0.05), *_finite(found))
    return Found(share, "percent", 100.0, at_least=True, words=signals.warnings[-1], broken=broken)


def _with_dead(channels: list[int], begin: int) -> tuple[Signals, Translation, np.ndarray]:
    counts = shipped().electrodes.copy()
    counts[begin:, channels] = counts[begin, channels]
    _, signals = prepared(electrodes=counts)
    return signals, *translated(signals)


@case("dead_electrodes", "dead electrodes", TRANSLATION,
      "electrodes that never change: every frame carries DEAD_CHANNEL, confidence is 0.2 at most")  # fmt: skip
def test_dead() -> Found:
    """Two electrodes that stand still."""
    signals, found, frames = _with_dead([7, 17], 0)
    broken = (*_flagged(found, signals, Flag.DEAD_CHANNEL, 1.0), *_finite(found))
    words = f"{signals.warnings[-1]}; rms error {_error(found, frames) * 1e6:.0f} um, {_clean()[0] * 1e6:.0f} whole"
    return Found(100 * float(((found.flags & int(Flag.DEAD_CHANNEL)) > 0).mean()), "percent", 100.0, at_least=True,
                 words=words, broken=broken)  # fmt: skip


@case("electrodes_that_die", "dead electrodes", TRANSLATION,
      "electrodes that stop after a third of the recording: the frames from there on carry DEAD_CHANNEL")  # fmt: skip
def test_dying() -> Found:
    """Two electrodes that stand still from a frame on."""
    begin = len(shipped()) // 3
    _, found, frames = _with_dead([7, 17], begin)
    dead = (found.flags & int(Flag.DEAD_CHANNEL)) > 0
    words = f"rms error {_error(found, frames) * 1e6:.0f} um, {_clean()[0] * 1e6:.0f} with whole electrodes"
    return Found(100 * float(dead[frames > begin].mean()), "percent", 100.0, at_least=True, words=words,
                 broken=_finite(found))  # fmt: skip


@case("drift_over_an_hour", "drift over an hour", TRANSLATION,
      "88 counts an hour (Ruppel) taken off between quiet parts: 2 counts at most are left of 88")  # fmt: skip
def test_drift() -> Found:
    """An hour at 10 Hz: a press of 8 s every minute on the shipped recording's counts, every electrode drifting."""
    random = np.random.default_rng(2)
    time = np.arange(36000) / 10.0
    strength = np.clip(np.sin((time % 60 - 20) / 8 * np.pi), 0, None) * ((time % 60 > 20) & (time % 60 < 28))
    press = strength[:, None] * np.linspace(-40, 120, 19)
    slope = np.linspace(-88, 88, 19) / 3600
    counts = np.rint(3300 + press + time[:, None] * slope + random.normal(0, 1, press.shape))
    recording = dataclasses.replace(
        shipped(), time=time, electrodes=counts, rows=np.arange(len(time)), truth=None, pdc=None, tac=None, tdc=None,
        pac=None, position=None, force=None, flags=np.zeros(len(time), np.uint16),
    )  # fmt: skip
    signals = recordings.prepare(recording)
    off = np.abs((signals.change - press).reshape(-1, 50, 19).mean(axis=1)).max()  # over 5 s: 0.14 counts of noise
    words = f"{len(signals.report['quiet_parts'])} quiet parts, slopes off by {np.abs(signals.drift - slope).max():.4f}"
    return Found(float(off), "counts", 2.0, words=words + " counts/s")


@case("signals_out_of_range", "out-of-range latents", TRANSLATION,
      "forty times as large: frames in contact carry OUT_OF_RANGE and little confidence; all is finite")  # fmt: skip
def test_out_of_range() -> Found:
    """Changes forty times those of the shipped recording, up to what 12 bits hold: training knows fifteen times."""
    _, signals = prepared()
    touched = np.flatnonzero(np.linalg.norm(shipped().truth.force, axis=1) > 0.3)[::EVERY]
    part = {name: getattr(signals, name)[touched] for name in ("electrodes", "quiet", "flags", "pdc")}
    change = np.clip(40 * signals.change[touched], -4095, 4095)
    found = translator()(dataclasses.replace(signals, change=change, **part))
    flagged = (found.flags & int(Flag.OUT_OF_RANGE)) > 0
    sure = float(found.confidence.max())
    # Confidences are float32, which rounds the limit up: numpy before 2 compares the two as float64.
    limit = float(np.float32(UNTRAINED_CONFIDENCE))
    broken = (*_finite(found), *(() if sure <= limit else (f"confidence {sure:.2f}",)))
    words = f"nodes move up to {np.abs(found.displacement_digit).max() * 1e3:.2f} mm"
    return Found(100 * float(flagged.mean()), "percent", 100.0, at_least=True, words=words, broken=broken)


def _wild() -> np.ndarray:
    nets = networks.load()
    latent = np.random.default_rng(3).normal(0, 12, (8, nets.sizes["MVD"]["latent"])).astype(np.float32)
    return nets.decode_target(latent)


@case("wild_latents_height_map", "out-of-range latents", HEIGHT_MAP,
      "latents twelve deviations out: whatever they decode to, heights are finite")  # fmt: skip
def test_wild_heights() -> Found:
    """Decoded latents that no training ever made."""
    moved = _wild()
    heights = gel_mapper()(moved)
    words = f"nodes move up to {np.abs(moved).max() * 1e3:.1f} mm"
    return Found(float(np.isfinite(heights).mean() * 100), "percent", 100.0, at_least=True, words=words)


@case("wild_latents_fast_picture", "out-of-range latents", FAST_PICTURE,
      "a picture, or a refusal in words where the gel would reach the lights")  # fmt: skip
def test_wild_pictures() -> Found:
    """Pictures of the same."""
    heights = gel_mapper()(_wild())
    shader, words, drawn = Renderer(preset="fast"), set(), 0
    for height in heights:
        try:
            drawn += shader(height).shape == (320, 240, 3)
        except Exception as error:  # anything but words is found out below
            words.add(f"{type(error).__name__}: {error}")
    broken = tuple(word for word in words if not word.startswith("TactileError"))
    return Found(drawn + len(words) - len(broken), "pictures or refusals", 1, at_least=True,
                 words=f"{drawn} of {len(heights)} drawn; " + "; ".join(sorted(words)), broken=broken)  # fmt: skip


@case("one_frame", "one-frame recordings", TRANSLATION,
      "converts whole: rest is guessed, the frame carries NO_QUIET_PART, confidence <= 0.2")  # fmt: skip
def test_one_frame() -> Found:
    """A CSV file with a header and one line, through `tactile convert`."""
    import h5py

    header = ["timestamp", "tdc", "tac", "pdc", *(f"pac{i}" for i in range(1, 23)), *(f"ele{i}" for i in range(1, 20))]
    line = ["0", "2000", "2000", "2000", *["2000"] * 22, *(str(int(v)) for v in shipped().electrodes[300])]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "one.csv"
        path.write_text(",".join(header) + "\n" + ",".join(line) + "\n")
        done = convert(path, Path(folder) / "out", Options(keep=("image", "displacement")), load_tools(ToolOptions()))
        with h5py.File(Path(folder) / "out/frames.h5") as file:
            flags, confidence = int(file["flags"][0]), float(file["confidence"][0])
            finite = all(np.isfinite(file[name][0]).all() for name in ("displacement_digit", "force"))
        pictures = len(list((Path(folder) / "out/images").iterdir()))
    broken = [] if flags & int(Flag.NO_QUIET_PART) else ["NO_QUIET_PART is not set"]
    broken += [] if finite and pictures == 1 else [f"{pictures} pictures, finite: {finite}"]
    return Found(
        round(confidence, 6), "confidence", UNTRAINED_CONFIDENCE, words="; ".join(done.warnings), broken=tuple(broken)
    )
