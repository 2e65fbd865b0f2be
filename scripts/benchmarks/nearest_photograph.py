"""Explain photographs of presses by the nearest of others, moved: the strongest simple answer beside a calibration.

    python scripts/benchmarks/nearest_photograph.py FITTED APART --background untouched.png

FITTED, APART : folders of photographs, those that a unit was fitted to and held-out ones. Of the fitted ones each is
moved by whole pixels to where it correlates best, and the one that leaves least is taken: the answer is known to it.
"""

from __future__ import annotations

import pathlib
import sys

import numpy as np

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "scripts")]

from benchmarks.measured_rows import finished, parser_of, printed  # noqa: E402
from tactile_core.accuracy import row  # noqa: E402
from tactile_core.pictures.calibrate.photo_metrics import metrics  # noqa: E402
from tactile_core.pictures.calibrate.photographs import Press, read_photographs  # noqa: E402


def main() -> int:
    """Compare each held-out photograph, and report means."""
    parser = parser_of(__doc__)
    parser.add_argument("fitted", metavar="FITTED")
    parser.add_argument("apart", metavar="APART")
    parser.add_argument("--background", required=True, metavar="FILE", help="photograph of the untouched gel")
    options = parser.parse_args()
    fitted, apart = (read_photographs(folder, options.background) for folder in (options.fitted, options.apart))
    nearest, untouched = [], []
    for press in apart.presses:
        tried = [_error(press, moved_onto(other.change, press.change), apart.background) for other in fitted.presses]
        nearest.append(min(tried, key=lambda found: found["roi_l1"]))
        untouched.append(_error(press, np.zeros_like(press.change), apart.background))
    rows = []
    for name, unit in (("roi_l1", "levels"), ("roi_psnr", "dB")):
        ours, baseline = (float(np.mean([each[name] for each in found])) for found in (nearest, untouched))
        rows.append(row(f"nearest_{name}", ours, unit, baseline=baseline, of=f"{len(apart.presses)} photographs"))
    return finished(printed(rows), options.json)


def moved_onto(change: np.ndarray, onto: np.ndarray) -> np.ndarray:
    """Move a change (H, W, 3) by whole pixels to where it correlates best with another; 0 where nothing lies."""
    there, here = (np.fft.rfft2(each, axes=(0, 1)) for each in (onto, change))
    height, width = onto.shape[:2]
    likeness = np.fft.irfft2((there * here.conj()).sum(-1), s=(height, width))
    down, right = (int(each) for each in np.unravel_index(likeness.argmax(), likeness.shape))
    down, right = (step - size if step > size // 2 else step for step, size in ((down, height), (right, width)))
    found = np.zeros_like(change)
    to, of = ((slice(max(d, 0), n + min(d, 0)) for d, n in ((s * down, height), (s * right, width))) for s in (1, -1))
    found[tuple(to)] = change[tuple(of)]
    return found


def _error(press: Press, change: np.ndarray, background: np.ndarray) -> dict:
    picture = np.rint(background + press.drift + change).clip(0, 255).astype(np.uint8)
    return metrics(picture, press.picture, background, press.region)


if __name__ == "__main__":
    sys.exit(main())
