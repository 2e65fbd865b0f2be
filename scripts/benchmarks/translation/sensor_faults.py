"""Break recordings as sensors, cables and drivers do; count the frames that are translated wrongly, yet confidently.

    python scripts/benchmarks/translation/sensor_faults.py [--phac FOLDER] [--sensor REST.toml] --json FILE

Each fault is put into the shipped recording, into an idle finger with that recording's rest, and into grips of the PHAC
set (``--phac``, trials 01 to 03), whose rest ``tactile adapt`` found (``--sensor``). A frame is wrong if its force
differs from that of the unbroken recording by more than half of it, and by more than `NOTHING`; it counts if it is
confident and not flagged all the same. Rows ``clean_..._guesses`` are the shares of unbroken frames called guesses.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # `benchmarks` is no package that is installed

from benchmarks.measured_rows import finished, parser_of, printed
from tactile_core import accuracy
from tactile_core.accuracy import Row, row
from tactile_core.errors import TactileError
from tactile_core.recordings import Recording, electrode_gains, read
from tactile_core.sensors import COUNT_MAX
from tactile_core.translation.translate import translate
from tactile_core.translation.translator import Translation
from tactile_core.translation.trust_words import is_guess

SHIPPED = Path(__file__).resolve().parents[3] / "scenes" / "press_roll_slide" / "press_roll_slide.h5"
QUIET = 50  # frames at the shipped recording's start without contact
NOTHING, HALF = 0.05, 0.5  # N; share of the force
TARGET, TRIALS = 2.0, ("01", "02", "03")  # % of the frames; of PHAC, those to choose by
Rng = np.random.Generator
LEAST_LOAD = 15.0  # counts, that no noise and drift of an idle finger make
Fault = Callable[[np.ndarray, np.ndarray, Rng], np.ndarray]  # electrodes (T, 19), rest (19,) counts; broken ones


@dataclass(frozen=True)
class Base:
    """A recording to break. name : what rows call it; rest : (19,) counts; sensor : file of its unit, None for none
    every : step from one judged frame to the next"""

    name: str
    recording: Recording
    rest: np.ndarray
    sensor: str | None
    every: int

    def translated(self, electrodes: np.ndarray) -> Translation | None:
        """Return the translation of the recording with other electrodes (T, 19) counts; None if it is refused."""
        broken = replace(self.recording, electrodes=electrodes)
        try:
            return translate(broken, sensor=self.sensor, frames=slice(None, None, self.every))
        except TactileError:
            return None


def _from(electrodes: np.ndarray) -> slice:
    return slice(int(0.3 * len(electrodes)), None)


def _drawn(electrodes: np.ndarray, random: Rng, count: int) -> np.ndarray:
    return random.choice(electrodes.shape[1], count, replace=False)


def stuck(electrodes: np.ndarray, rest: np.ndarray, random: Rng) -> np.ndarray:
    """Let one of the electrodes (T, 19) counts keep its reading after 30 % of the frames. rest : (19,), not used"""
    (one,), rows = _drawn(electrodes, random, 1), _from(electrodes)
    electrodes[rows, one] = electrodes[rows, one][0]
    return electrodes


def dead(electrodes: np.ndarray, rest: np.ndarray, random: Rng) -> np.ndarray:
    """Let one of the electrodes (T, 19) read one of its counts, drawn at random, throughout. rest : not used"""
    (one,) = _drawn(electrodes, random, 1)
    electrodes[:, one] = random.choice(electrodes[:, one])
    return electrodes


def stepped(electrodes: np.ndarray, rest: np.ndarray, random: Rng, count: int, by: float) -> np.ndarray:
    """Let ``count`` of the electrodes (T, 19) jump by ``by`` counts after 30 % of the frames. rest : not used"""
    electrodes[_from(electrodes), _drawn(electrodes, random, count)[:, None]] += by
    return electrodes


def drifting(electrodes: np.ndarray, rest: np.ndarray, random: Rng, count: int, by: float) -> np.ndarray:
    """Let ``count`` of the electrodes (T, 19) drift evenly, from 0 to ``by`` counts at the end. rest : not used"""
    electrodes[:, _drawn(electrodes, random, count)] += by * np.linspace(0, 1, len(electrodes))[:, None]
    return electrodes


def noisy(electrodes: np.ndarray, rest: np.ndarray, random: Rng, count: int, by: float) -> np.ndarray:
    """Add Gaussian noise with a standard deviation of ``by`` counts to ``count`` of the electrodes (T, 19). rest : not
    used"""
    electrodes[:, _drawn(electrodes, random, count)] += by * random.standard_normal((len(electrodes), count))
    return electrodes


def clipped(electrodes: np.ndarray, rest: np.ndarray, random: Rng) -> np.ndarray:
    """Clip electrodes (T, 19) to the upper two thirds of their ranges, as a small amplifier does. rest : unused"""
    low, high = electrodes.min(axis=0), electrodes.max(axis=0)
    return np.maximum(electrodes, low + (high - low) / 3)


def swapped(electrodes: np.ndarray, rest: np.ndarray, random: Rng) -> np.ndarray:
    """Swap two of the electrodes (T, 19) counts. rest : unused"""
    two = _drawn(electrodes, random, 2)
    electrodes[:, two] = electrodes[:, two[::-1]]
    return electrodes


def louder(electrodes: np.ndarray, rest: np.ndarray, random: Rng) -> np.ndarray:
    """Double the changes of four of the electrodes (T, 19) from rest (19,)."""
    some = _drawn(electrodes, random, 4)
    electrodes[:, some] += electrodes[:, some] - rest[some]
    return electrodes


def creeping(electrodes: np.ndarray, rest: np.ndarray, random: Rng) -> np.ndarray:
    """Let a tenth of all changes of electrodes (T, 19) lag by 1 s (time constant; a skin that creeps). rest : unused"""
    slow, late = electrodes[0].copy(), np.empty_like(electrodes)
    for frame, reading in enumerate(electrodes):
        slow += (reading - slow) / 100
        late[frame] = slow
    return 0.9 * electrodes + 0.1 * late


def hum(electrodes: np.ndarray, rest: np.ndarray, random: Rng) -> np.ndarray:
    """Add mains hum of 50 Hz to electrodes (T, 19): sampled at 100 Hz, it shows as a slow beat. rest : not used"""
    return electrodes + 5 * np.sin(2 * np.pi * 50 * np.arange(len(electrodes)) / 100.3)[:, None]


def held(electrodes: np.ndarray, rest: np.ndarray, random: Rng, share: float) -> np.ndarray:
    """Lose a ``share`` of the rows of electrodes (T, 19), in bursts of one to eight; the row before is repeated.
    rest : not used"""
    lost = np.zeros(len(electrodes), bool)
    while lost.mean() < share:
        start = random.integers(1, len(lost))
        lost[start : start + random.integers(1, 9)] = True
    return electrodes[np.maximum.accumulate(np.where(lost, 0, np.arange(len(lost))))]


def frozen(electrodes: np.ndarray, rest: np.ndarray, random: Rng, frames: int) -> np.ndarray:
    """Hold the row of electrodes (T, 19) with the largest change from rest (19,) for ``frames`` frames."""
    first = int(np.abs(electrodes - rest).sum(axis=1).argmax())
    electrodes[first : first + frames] = electrodes[first]
    return electrodes


def duplicated(electrodes: np.ndarray, rest: np.ndarray, random: Rng) -> np.ndarray:
    """Put the row before in place of each second row of electrodes (T, 19). rest : unused"""
    return electrodes[np.arange(len(electrodes)) // 2 * 2]


def bits(electrodes: np.ndarray, rest: np.ndarray, random: Rng, by: float) -> np.ndarray:
    """Make electrodes (T, 19) ``by`` times as large, whole and clipped, as by an ADC of other bits. rest : not used"""
    return np.clip(np.floor(electrodes * by), 0, COUNT_MAX)


def under_load(electrodes: np.ndarray, rest: np.ndarray, random: Rng) -> np.ndarray:
    """Put the row of the strongest contact, with noise, into the first and last QUIET rows of electrodes (T, 19)
    counts; do nothing if no reading differs from rest (19,) by LEAST_LOAD."""
    change = np.abs(electrodes - rest)
    if change.max() < LEAST_LOAD:
        return electrodes
    first = int(change.sum(axis=1).argmax())
    for rows in slice(QUIET), slice(-QUIET, None):
        electrodes[rows] = electrodes[first] + random.normal(0, 1, (QUIET, electrodes.shape[1]))
    return electrodes


def inverted(electrodes: np.ndarray, rest: np.ndarray, random: Rng) -> np.ndarray:
    """Mirror electrodes (T, 19) about rest (19,): counts rise where they should fall."""
    return 2 * rest - electrodes


FAULTS: dict[str, Fault] = {
    "stuck": stuck, "dead": dead, "one_low": partial(stepped, count=1, by=-25),
    "three_low": partial(stepped, count=3, by=-30), "one_high": partial(stepped, count=1, by=25),
    "drift_one": partial(drifting, count=1, by=60), "drift_all": partial(drifting, count=19, by=-20),
    "noise_one": partial(noisy, count=1, by=15), "noise_all": partial(noisy, count=19, by=6), "clipped": clipped,
    "swapped": swapped, "gains_doubled": louder, "creep": creeping, "hum": hum, "held_tenth": partial(held, share=0.1),
    "held_third": partial(held, share=0.3), "frozen_short": partial(frozen, frames=30),
    "frozen_long": partial(frozen, frames=500), "duplicated": duplicated, "ten_bits": partial(bits, by=0.25),
    "half_gain": partial(bits, by=0.5), "rest_off": partial(stepped, count=19, by=40), "rest_under_load": under_load,
    "inverted": inverted,
}  # fmt: skip


def bases(phac: Path | None, sensor: str | None) -> list[Base]:
    """Return the recordings that faults are put into: an idle finger, the shipped one, and grips in the folder
    ``phac``. sensor : file with the grips' rest"""
    shipped, random = read(SHIPPED), np.random.default_rng(0)
    at_rest = np.asarray(shipped.electrodes[:QUIET], float).mean(axis=0)
    idle = replace(
        shipped, electrodes=np.rint(at_rest + random.normal(0, 1.2, shipped.electrodes.shape)),
        pdc=None if shipped.pdc is None else shipped.pdc[0] + random.normal(0, 0.5, len(shipped)),
    )  # fmt: skip
    found = [Base("idle", idle, at_rest, None, 2), Base("shipped", shipped, at_rest, None, 2)]
    for file in [] if phac is None else sorted(phac.glob("*_HOLD.mat")):
        if file.stem.split("_")[-2] in TRIALS:
            grip = read(f"{file}#0")
            rest = np.array(electrode_gains.read(sensor).gains_for(grip.path, grip.section, sensor).rest().counts)
            found.append(Base(file.stem, grip, rest, sensor, 25))
    return found


def confident(found: Translation) -> np.ndarray:
    """Return a mask (T,) bool of the frames that neither flags nor confidence call a guess."""
    return ~np.array([is_guess(*each) for each in zip(found.confidence, found.flags, strict=True)])


def wrong(found: Translation, true: Translation) -> np.ndarray:
    """Return a mask (T,) bool of the frames whose force is off by more than half of the true one and than `NOTHING`."""
    seen, force = accuracy.lengths(found.force), accuracy.lengths(true.force)
    return np.abs(seen - force) > np.maximum(NOTHING, HALF * force)


def measured(recordings: list[Base]) -> list[Row]:
    """Return rows of shares of frames, %: guesses in each unbroken recording; for each fault, wrong and confident
    frames, mean over recordings."""
    true = [base.translated(np.asarray(base.recording.electrodes, float)) for base in recordings]
    kept = [(base, found) for base, found in zip(recordings, true, strict=True) if found is not None]
    rows = []
    for base, found in kept:
        rows.append(row(f"clean_{base.name}_guesses", 100 * float(1 - confident(found).mean()), "%", None, of="frames"))
    for name, fault in FAULTS.items():
        shares = {base.name: share(base, found, fault) for base, found in kept}
        of = ", ".join(f"{base} {each:.0f}" for base, each in shares.items() if each >= 0.5)
        rows.append(row(f"fault_{name}_confident_and_wrong", float(np.mean(list(shares.values()))), "%", TARGET, of=of))
    return rows


def share(base: Base, true: Translation, fault: Fault) -> float:
    """Return the share of frames, %, that are wrong and confident once a fault has broken a recording; 0 if the broken
    one is refused. true : translation of the unbroken recording"""
    electrodes = fault(np.array(base.recording.electrodes, float), base.rest, np.random.default_rng(1))
    found = base.translated(np.rint(electrodes))
    return 0.0 if found is None else 100 * float((wrong(found, true) & confident(found)).mean())


def main(arguments: list[str] | None = None) -> int:
    """Measure, print and write the results; returns the exit status."""
    parser = parser_of(__doc__)
    parser.add_argument("--phac", type=Path, help="folder of grips, NAME_OBJECT_TRIAL_HOLD.mat")
    parser.add_argument("--sensor", help="file of tactile adapt for the grips' finger")
    options = parser.parse_args(arguments)
    return finished(printed(measured(bases(options.phac, options.sensor))), options.json)


if __name__ == "__main__":
    sys.exit(main())
