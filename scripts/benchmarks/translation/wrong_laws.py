"""Measure whether recordings of a wrong law are doubted, and how often right ones are.

    python scripts/benchmarks/translation/wrong_laws.py --json FILE     the table of docs/accuracy.md

A recording is so many simulated contacts of one unit, out of ``scenes/training/test_contacts.h5``, whose gains are 10 %
apart, with 1.5 counts of noise. Even presses chose the limits (``--fit`` of commit d537259), odd ones are reported. A
doubted recording is flagged in all frames in contact, so shares of recordings are shares of frames.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT), str(ROOT / "scripts")]

import h5py  # noqa: E402
import numpy as np  # noqa: E402

from benchmarks.measured_rows import finished, parser_of, printed  # noqa: E402
from benchmarks.translation.test_set import GAIN, NOISE  # noqa: E402
from tactile_core.accuracy import Row, row  # noqa: E402
from tactile_core.recordings.unit import contact_law  # noqa: E402
from tactile_core.sensors import PRESSURE_PER_COUNT  # noqa: E402
from tactile_core.translation.simulated_likeness import residual_shares, unlike  # noqa: E402

CONTACTS = 5, 10, 20, 40, 100
FRAMES = 20  # of each recording whose frames are judged one by one
UNITS = 400  # recordings a law and number of contacts
TARGET, ALARMS, FROM = 0.9, 0.05, 20  # shares of recordings; contacts from which on they are asked for
OFFSET, CHANNELS, FACTOR = 40.0, 4, 2.0  # counts of rest; channels whose gain is so many times as large
PDC = 1.5  # counts of noise of the fluid's pressure (assumed, as the electrodes')
SOFTER = 0.5  # of the skin's modulus: the same dents at so much of the pressure, in linear elasticity
Touches = tuple[np.ndarray, np.ndarray]  # changes (n, 19) counts, and the fluid's pressure (n,) Pa
Law = Callable[[np.ndarray, np.ndarray, np.random.Generator], Touches]


def main(arguments: list[str] | None = None) -> int:
    """Measure, print and write the results; returns the exit status."""
    options = parser_of(__doc__).parse_args(arguments)
    return finished(printed(measured()), options.json)


def inverted(change: np.ndarray, pressure: np.ndarray, random: np.random.Generator) -> Touches:
    """Counts that rise where they should fall."""
    return -change, pressure


def doubled(change: np.ndarray, pressure: np.ndarray, random: np.random.Generator) -> Touches:
    """Double the gains of some channels."""
    gain = np.ones(change.shape[1])
    gain[random.choice(len(gain), CHANNELS, replace=False)] = FACTOR
    return change * gain, pressure


def swapped(change: np.ndarray, pressure: np.ndarray, random: np.random.Generator) -> Touches:
    """Swap two channels."""
    order = np.arange(change.shape[1])
    first, second = random.choice(len(order), 2, replace=False)
    order[[first, second]] = order[[second, first]]
    return change[:, order], pressure


def moved(change: np.ndarray, pressure: np.ndarray, random: np.random.Generator) -> Touches:
    """Rest taken too high or too low in all channels."""
    return change + OFFSET * random.choice([-1.0, 1.0]), pressure


def softer(change: np.ndarray, pressure: np.ndarray, random: np.random.Generator) -> Touches:
    """A skin of half the stiffness."""
    return change, SOFTER * pressure


def right(change: np.ndarray, pressure: np.ndarray, random: np.random.Generator) -> Touches:
    """The law as simulated."""
    return change, pressure


WRONG: dict[str, Law] = {
    "inverted": inverted, "gains_doubled": doubled, "channels_swapped": swapped, "rest_off": moved,
    "skin_softer": softer,
}  # fmt: skip


def touches() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Changes (n, 19) counts, pressures (n,) Pa and presses (n,) of the test set's contacts, of odd presses."""
    with h5py.File(ROOT / "scenes" / "training" / "test_contacts.h5", "r") as file:
        press = file["press"][:]
        chosen = press % 2 == 1
        change, pressure = (file[name][:].astype(float)[chosen] for name in ("signal", "pressure"))
        return change, pressure, press[chosen]


def recordings(contacts: int, law: Law, seed: int) -> list[Touches]:
    """Contacts of UNITS recordings of the test set's odd presses, each of a unit with gains of its own."""
    random, found = np.random.default_rng([seed, contacts]), []
    change, pressure, _ = touches()
    for _ in range(UNITS):
        gain = 1 + GAIN * random.standard_normal(change.shape[1])
        chosen = random.choice(len(change), min(contacts, len(change)), replace=False)
        seen, fluid = law(change[chosen] * gain, pressure[chosen], random)
        seen = seen + NOISE * random.standard_normal(seen.shape)
        fluid = fluid + PRESSURE_PER_COUNT * PDC * random.standard_normal(len(fluid))
        contact = contact_law.touching(seen)
        found.append((seen[contact], fluid[contact]))
    return found


def measured() -> list[Row]:
    """Shares of frames that are unexplained, by law, and of recordings that are doubted, by number of contacts too."""
    rows = []
    for name, law in ({"right": right} | WRONG).items():
        seen = np.concatenate([each for each, _ in recordings(FRAMES, law, seed=3)])
        share = unlike(residual_shares(seen, np.zeros(len(seen), bool)), seen).mean()
        of = f"{len(seen)} frames, each judged alone"
        rows.append(row(f"unexplained_{name}", 100 * float(share), "%", of=of))
    for contacts in CONTACTS:
        asked, of = contacts >= FROM, f"{UNITS} recordings of {contacts} contacts"
        for name, law in ({"right": right} | WRONG).items():
            doubted = 100 * float(
                np.mean([bool(contact_law.doubt(*each)) for each in recordings(contacts, law, seed=2)])
            )
            wrong = law is not right
            target = 100 * (TARGET if wrong else ALARMS) if asked else None
            rows.append(row(f"doubted_{name}_{contacts}", doubted, "%", target, of=of, at_least=wrong))
    return rows


if __name__ == "__main__":
    sys.exit(main())
