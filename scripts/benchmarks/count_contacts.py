"""Count how many random contacts a tier settles, and how long it takes: nine indenters, tilts to 30 degrees, the whole
pad, depths to half of the thickness.

    python scripts/benchmarks/count_contacts.py digit --count 1000 [--tier fast] [--friction 0] [--steps 1]

With --steps each contact is the end of a path of so many depths, evenly apart, as presses are simulated; times are then
those of a step, and a contact settles where its whole path does. A contact counts as silently wrong when it says that
it converged although a surface node lies more than 1 um in the indenter. Prints a table by indenter; exits 1 when one
is silently wrong, or when fewer than 99 % converge.
"""

from __future__ import annotations

import collections
import pathlib
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "scripts")]

from benchmarks.measured_rows import finished, parser_of, printed  # noqa: E402
from tactile_core.files.threads import one_thread  # noqa: E402

one_thread()  # before numpy is imported: the times are those of one core

import numpy as np  # noqa: E402

from benchmarks.mechanics.many import PENETRATION, SETTLED_TARGET, settle  # noqa: E402
from benchmarks.mechanics.random_contacts import random_contacts  # noqa: E402
from tactile_core.accuracy import row  # noqa: E402
from tactile_core.mechanics.solve import TIERS  # noqa: E402


def main() -> int:
    """Count, print and report."""
    parser = parser_of(__doc__)
    parser.add_argument("sensor", choices=("biotac", "digit"))
    parser.add_argument("--count", type=int, default=1000, help="contacts (1000)")
    parser.add_argument("--tier", choices=TIERS, default="fast", help="(fast)")
    parser.add_argument("--friction", type=float, default=0.0, help="Coulomb's coefficient (0)")
    parser.add_argument("--steps", type=int, default=1, help="of the path to each contact (1)")
    parser.add_argument("--seed", type=int, default=0, help="(0)")
    options = parser.parse_args()
    if options.steps < 1:
        parser.error(f"--steps {options.steps}: expected at least 1")
    settled, times, wrong = collections.Counter(), collections.defaultdict(list), 0
    for number, contact in enumerate(random_contacts(options.count, options.seed), 1):
        found, took = settle(options.sensor, contact, options.tier, options.friction, options.steps)
        times[contact.name].append(1e3 * took)
        settled[contact.name] += found is not None
        wrong += found is not None and found.penetration > PENETRATION
        if number % 100 == 0:
            print(f"{number}/{options.count}", file=sys.stderr, flush=True)
    rows, of = [], f"{options.tier} tier, friction {options.friction:g}, steps {options.steps}, seed {options.seed}"
    for name, took in times.items():
        label = f"{options.sensor}_{name.replace(' ', '_')}"
        share = 100 * settled[name] / len(took)
        print(f"{name:18} {settled[name]:5} of {len(took):5} settled, ms mean {np.mean(took):8.1f} median "
              f"{np.median(took):8.1f} p95 {np.quantile(took, 0.95):8.1f}")  # fmt: skip
        rows.append(row(f"{label}_settled", share, "percent", of=of))
    every = np.concatenate(list(times.values()))
    share = 100 * settled.total() / len(every)
    rows.append(row(f"{options.sensor}_settled", share, "percent", SETTLED_TARGET, of=of, at_least=True))
    rows.append(row(f"{options.sensor}_silently_wrong", wrong, "1", 0.0, of=of))
    rows.append(row(f"{options.sensor}_mean_time", float(every.mean()), "ms", of=of + ", with its set-up"))
    printed(rows[-3:])
    return finished(rows, options.json)


if __name__ == "__main__":
    sys.exit(main())
