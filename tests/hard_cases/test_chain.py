"""Hard contacts through the whole translation, from the counts that they make to the gel's nodes, and drift."""

import dataclasses
import functools

import numpy as np
from conftest import SHIPPED

from hard_cases.case import TRANSLATION, Found, case
from hard_cases.test_shapes import CONTACTS, HARD_OF, SHOWN
from tactile_core import accuracy, recordings
from tactile_core.mechanics.electrodes.biotac_sheet import signal_of
from tactile_core.mechanics.force_search import UnreachableError
from tactile_core.mechanics.solve import solve
from tactile_core.recordings import Recording, Signals
from tactile_core.recordings.flags import Flag
from tactile_core.sensors import REST_COUNTS
from tactile_core.translation.translate import load_translator

WORDS = Flag.OUT_OF_RANGE | Flag.BEYOND_DIGIT

translator = functools.cache(load_translator)


@functools.cache
def prepared() -> tuple[Recording, Signals]:
    """The recording that ships, which knows its truth, and its signals."""
    recording = recordings.read(SHIPPED)
    return recording, recordings.prepare(recording)


@case("faint_touch_translated", "tiny depth (0.1 um)", TRANSLATION,
      "a twentieth of a light press: the bound holds, or the frame is flagged")  # fmt: skip
def test_faint_touch() -> Found:
    return translated("deep", 0.01)


@case("{}_translated", HARD_OF, TRANSLATION,
      "the largest node error lies below the bound that holds for 95 of 100 frames, or the frame is flagged",
      *((name,) for name in SHOWN))  # fmt: skip
def test_translated(name: str) -> Found:
    return translated(name, 1.0)


def translated(name: str, share: float) -> Found:
    """A contact of the BioTac at a share of its depth and the DIGIT's at the same force, against the translation."""
    _, indenter, place, depth, friction = CONTACTS[name]
    biotac = solve("biotac", indenter, place, depth=share * depth, friction=friction)
    try:
        digit = solve("digit", indenter, place, force=biotac.axial_force, friction=friction)
    except UnreachableError:
        return Found(1.0, "said", 1.0, at_least=True, words="the fast tier says that it finds no contact of this force")
    change = signal_of(biotac)[None]
    signals = dataclasses.replace(
        prepared()[1], change=change, rest=REST_COUNTS.copy(), electrodes=REST_COUNTS + change, quiet=np.zeros(1, bool),
        flags=np.zeros(1, np.uint16), pdc=np.zeros(1),
    )  # fmt: skip
    return over_bound(signals, {"biotac": biotac.displacement, "digit": digit.displacement})


def over_bound(signals: Signals, truths: dict[str, np.ndarray]) -> Found:
    """The larger of both surfaces' largest node errors over their bounds, of one frame; 1 where it is flagged."""
    found = translator()(signals)
    worst, words = 0.0, []
    for sensor, truth in truths.items():
        error = float(accuracy.max_error(getattr(found, f"displacement_{sensor}"), truth[None])[0])
        bound = float(getattr(found, f"error_bound_{sensor}")[0])
        worst = max(worst, error / bound)
        words.append(f"{sensor} {error * 1e6:.0f} um (bound {bound * 1e6:.0f})")
    flagged = Flag(int(found.flags[0]) & int(WORDS))
    words.append(f"confidence {found.confidence[0]:.2f}" + (f", flagged {flagged!r}" if flagged else ""))
    finite = () if np.isfinite(found.displacement_digit).all() else ("nodes that are not finite",)
    if flagged:
        return Found(1.0, "said", 1.0, at_least=True, words=", ".join(words), broken=finite)
    return Found(worst, "of stated", 1.0, words=", ".join(words), broken=finite)


@case("nothing_touches_translated", "zero contact", TRANSLATION, "no force, no place, and the gel at rest to 20 um")
def test_still() -> Found:
    """Counts that do not change at all."""
    signals = dataclasses.replace(
        prepared()[1], change=np.zeros((1, 19)), electrodes=np.full((1, 19), 3300.0), quiet=np.ones(1, bool),
        flags=np.zeros(1, np.uint16), pdc=np.zeros(1),
    )  # fmt: skip
    found = translator()(signals)
    broken = () if not found.force.any() and np.isnan(found.contact_center).all() else ("a force or a place",)
    return Found(float(np.abs(found.displacement_digit).max()) * 1e6, "um", 20.0, broken=broken)


@case("drift_over_an_hour", "drift over an hour", TRANSLATION,
      "88 counts an hour (Ruppel) taken off between quiet parts: 2 counts at most are left of 88")  # fmt: skip
def test_drift() -> Found:
    """An hour at 10 Hz: a press of 8 s every minute on the shipped recording's counts, every electrode drifting."""
    random = np.random.default_rng(2)
    time = np.arange(36000) / 10.0
    strength = np.clip(np.sin((time % 60 - 20) / 8 * np.pi), 0, None) * ((time % 60 > 20) & (time % 60 < 28))
    press = strength[:, None] * np.linspace(-40, 120, 19)
    slope = np.linspace(-88, 88, 19) / 3600
    counts = np.rint(3400 + press + time[:, None] * slope + random.normal(0, 1, press.shape))
    recording = dataclasses.replace(
        prepared()[0], time=time, electrodes=counts, rows=np.arange(len(time)), truth=None, pdc=None, tac=None,
        tdc=None, pac=None, position=None, force=None, flags=np.zeros(len(time), np.uint16),
    )  # fmt: skip
    signals = recordings.prepare(recording)
    off = np.abs((signals.change - press).reshape(-1, 50, 19).mean(axis=1)).max()  # over 5 s: 0.14 counts of noise
    words = f"{len(signals.report['quiet_parts'])} quiet parts, slopes off by {np.abs(signals.drift - slope).max():.4f}"
    return Found(float(off), "counts", 2.0, words=words + " counts/s")
