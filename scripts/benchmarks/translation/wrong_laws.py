"""Measure whether recordings of a wrong law are doubted, and how often right ones are.

    python scripts/benchmarks/translation/wrong_laws.py --json FILE     the table of docs/accuracy.md
    python scripts/benchmarks/translation/wrong_laws.py --fit           the limit's two numbers, from the other presses

A recording is so many simulated contacts of one unit, out of ``scenes/training/test_contacts.h5``, whose gains are 10 %
apart, with 1.5 counts of noise. Even presses are for choosing the limit, odd ones are reported. A doubted recording is
flagged in all frames in contact, so shares of recordings are shares of frames.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
sys.path[:0] = [str(ROOT), str(ROOT / "scripts")]

import h5py  # noqa: E402
import numpy as np  # noqa: E402

from tactile_core.accuracy import HEADER, Row, line, row  # noqa: E402
from tactile_core.files import atomic  # noqa: E402
from tactile_core.recordings import contact_law  # noqa: E402
from tactile_core.translation.simulated_likeness import residual_shares, unlike  # noqa: E402

CONTACTS = 5, 10, 20, 40, 100
FRAMES = 20  # of each recording whose frames are judged one by one
UNITS = 400  # recordings a law and number of contacts
GAIN, NOISE = 0.1, 1.5  # of a channel; counts (docs/sources.md, BioTac read-out)
TARGET, ALARMS, FROM = 0.9, 0.05, 100  # shares of recordings; contacts from which on they are asked for
CHOSEN = 0.01  # share of right recordings beyond the limit where it is chosen, so that others stay below ALARMS
OFFSET, CHANNELS, FACTOR = 40.0, 4, 2.0  # counts of rest; channels whose gain is so many times as large
Law = Callable[[np.ndarray, np.random.Generator], np.ndarray]


def main(arguments: list[str] | None = None) -> int:
    """Measure, print and write the results; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--fit", action="store_true", help="find the limit on the presses that are not reported")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the rows here")
    options = parser.parse_args(arguments)
    if options.fit:
        left, more = fit()
        print(f"LEFT, MORE = {left:.4f}, {more:.4f}")
        return 0
    rows = measured()
    print("\n".join([HEADER, *map(line, rows)]))
    if options.json:
        atomic.write_json(options.json, rows)
    return int(any(not each["ok"] for each in rows))


def inverted(change: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Counts that rise where they should fall."""
    return -change


def doubled(change: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Double the gains of some channels."""
    gain = np.ones(change.shape[1])
    gain[random.choice(len(gain), CHANNELS, replace=False)] = FACTOR
    return change * gain


def swapped(change: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Swap two channels."""
    order = np.arange(change.shape[1])
    first, second = random.choice(len(order), 2, replace=False)
    order[[first, second]] = order[[second, first]]
    return change[:, order]


def moved(change: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Rest taken too high or too low in all channels."""
    return change + OFFSET * random.choice([-1.0, 1.0])


def right(change: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """The law as simulated."""
    return change


WRONG: dict[str, Law] = {"inverted": inverted, "gains_doubled": doubled, "channels_swapped": swapped, "rest_off": moved}


def signals(odd: bool) -> np.ndarray:
    """Changes (n, 19) counts of the test set's contacts, of odd or of even presses."""
    with h5py.File(ROOT / "scenes" / "training" / "test_contacts.h5", "r") as file:
        return file["signal"][:].astype(float)[file["press"][:] % 2 == int(odd)]


def recordings(change: np.ndarray, contacts: int, law: Law, seed: int) -> list[np.ndarray]:
    """Contacts (n, 19) counts of UNITS recordings, each of a unit with gains of its own."""
    random, found = np.random.default_rng([seed, contacts]), []
    for _ in range(UNITS):
        gain = 1 + GAIN * random.standard_normal(change.shape[1])
        chosen = change[random.choice(len(change), min(contacts, len(change)), replace=False)] * gain
        seen = law(chosen, random) + NOISE * random.standard_normal(chosen.shape)
        found.append(seen[contact_law.touching(seen)])
    return found


def fit() -> tuple[float, float]:
    """The limit's numbers, by least squares over contacts of what all but CHOSEN of right recordings stay below."""
    counts, levels = [], []
    for contacts in CONTACTS:
        left = [contact_law.unexplained_share(each) for each in recordings(signals(odd=False), contacts, right, seed=1)]
        levels.append(np.quantile([share for share, _ in left], 1 - CHOSEN))
        counts.append(np.mean([different for _, different in left]))
    more, base = np.polyfit(1 / np.sqrt(counts), levels, 1)
    return float(base), float(more)


def measured() -> list[Row]:
    """Shares of frames that are unexplained, by law, and of recordings that are doubted, by number of contacts too."""
    rows = []
    for name, law in ({"right": right} | WRONG).items():
        seen = np.concatenate(recordings(signals(odd=True), FRAMES, law, seed=3))
        share = unlike(residual_shares(seen, np.zeros(len(seen), bool))).mean()
        of = f"{len(seen)} frames, each judged alone"
        rows.append(row(f"unexplained_{name}", 100 * float(share), "%", of=of))
    for contacts in CONTACTS:
        asked, of = contacts >= FROM, f"{UNITS} recordings of {contacts} contacts"
        for name, law in ({"right": right} | WRONG).items():
            doubted = [bool(contact_law.doubt(each)) for each in recordings(signals(odd=True), contacts, law, seed=2)]
            wrong = law is not right
            target = (TARGET if wrong else ALARMS) if asked else None
            key = f"doubted_{name}_{contacts}"
            rows.append(
                row(
                    key,
                    100 * float(np.mean(doubted)),
                    "%",
                    None if target is None else 100 * target,
                    of=of,
                    at_least=wrong,
                )
            )
    return rows


if __name__ == "__main__":
    sys.exit(main())
