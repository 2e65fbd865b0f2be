"""Draw docs/two_gels.jpg: contact sheets of the recording that ships on both gels that ship, side by side.

    python scripts/benchmarks/make/make_two_gels.py [--recording FILE] [--out docs/two_gels.jpg]

The same as `tactile convert RECORDING --out DIR` and `tactile convert RECORDING --to gelsight_mini --out DIR`.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).parents[3]
sys.path.insert(0, str(ROOT))

from tactile_core.jobs import convert, results  # noqa: E402

RECORDING = ROOT / "scenes" / "press_roll_slide" / "press_roll_slide.h5"
GELS = "digit", "gelsight_mini"
SHARE = 0.6  # of a sheet's 1,600 pixels


def main(arguments: list[str] | None = None) -> int:
    """Convert to both gels and draw their sheets; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--recording", type=Path, default=RECORDING)
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "two_gels.jpg")
    options = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        sheets = [sheet(options.recording, Path(folder), gel) for gel in GELS]
    both = Image.new("RGB", (sum(each.width for each in sheets), max(each.height for each in sheets)), "white")
    for k, each in enumerate(sheets):
        both.paste(each, (k * sheets[0].width, 0))
    both.save(options.out, quality=85)
    print(options.out)
    return 0


def sheet(recording: Path, folder: Path, gel: str) -> Image.Image:
    """Return the contact sheet of a recording on a gel, reduced to ``SHARE``."""
    done = convert.convert(recording, folder / gel, convert.Options(keep=()), convert.load_tools(target=gel))
    with Image.open(done.folder / results.SHEET) as whole:
        size = tuple(round(SHARE * length) for length in whole.size)
        return whole.convert("RGB").resize(size, Image.Resampling.LANCZOS)


if __name__ == "__main__":
    sys.exit(main())
