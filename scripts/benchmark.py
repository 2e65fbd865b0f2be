"""Speed against error of the DIGIT's pictures, ours beside others': one table, one plot, from one run on one machine.

    python scripts/benchmark.py PRESSES --json FILE --plot FILE.png

PRESSES is a folder of photographs of a 6 mm ball pressed into a DIGIT; those that the calibration was not fitted on are
the truth. Rows: null (the background alone), a table after Taxim fitted on the photographs the calibration was fitted
on (tests/benchmarks/taxim_like.py), and each preset of `tactile render`. Where and how deep the ball was pressed is
three numbers a photograph, found once by the fast picture; the table finds its own. Times are CPU time on
one core, the best of some calls. Prints the table; needs the extra [render].
"""

from __future__ import annotations

import argparse
import io
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests" / "benchmarks"))

from taxim_like import TableBench, fit_table, try_table  # noqa: E402

from tactile_core import atomic  # noqa: E402
from tactile_core.calibrate.ball_print import print_on  # noqa: E402
from tactile_core.calibrate.bench import Bench  # noqa: E402
from tactile_core.calibrate.measures import figures  # noqa: E402
from tactile_core.calibrate.photographs import Photographs, chosen, read_photographs  # noqa: E402
from tactile_core.calibrate.trial import Tried, mean_figures, try_unit  # noqa: E402
from tactile_core.calibration import Calibration  # noqa: E402
from tactile_core.calibration_file import load_calibration  # noqa: E402
from tactile_core.errors import TactileError  # noqa: E402
from tactile_core.optics.renderer import Renderer  # noqa: E402
from tactile_core.optics.variant import choose_variant  # noqa: E402
from tactile_core.rows import HEADER, Row, line, row  # noqa: E402

BALL = 3e-3  # m, radius
PRESETS = ("fast", "standard", "quality")  # the reference takes minutes: see docs/optics.md
REPEATS = 5
UNITS = {"roi_l1": "levels", "roi_psnr": "dB", "roi_ssim": "1", "frame_l1": "levels", "lobe_iou": "1"}


def main(arguments: list[str] | None = None) -> int:
    """Measure, print, write; the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("presses", help="folder of photographs")
    parser.add_argument("--calibration", metavar="FILE", help="of their unit (default: the one that ships)")
    parser.add_argument("--json", metavar="FILE", help="write the rows here")
    parser.add_argument("--plot", metavar="FILE", help="write error over time here (PNG)")
    options = parser.parse_args(arguments)
    try:
        rows = picture_rows(load_calibration(options.calibration), read_photographs(options.presses))
    except TactileError as error:
        print(error, file=sys.stderr)
        return 2
    print("\n".join([HEADER, *map(line, rows)]))
    if options.json:
        atomic.write_json(Path(options.json), rows)
    if options.plot:
        atomic.write_bytes(Path(options.plot), plot(rows))
    return 0


def picture_rows(unit: Calibration, photographs: Photographs) -> list[Row]:
    """Every method's figures on the photographs that were not fitted, and its time."""
    fitted = [press.name for press in photographs.presses if press.name in unit.fit.photographs]
    test = chosen(photographs, [press.name for press in photographs.presses if press.name not in fitted])
    tried = try_unit(unit, test, BALL, search_radius=False)
    null = mean_figures(tried)[1]
    table = fit_table(unit, chosen(photographs, fitted), BALL)
    change = TableBench(Bench(unit), table).change
    found = [("taxim_like", _means(try_table(table, unit, test, BALL)), _ms(lambda: change(tried[0].ball.numbers)))]
    variant = choose_variant().name
    for preset in PRESETS:
        renderer = Renderer(unit, preset, background=test.background, rest=Bench(unit).rest)
        heights = [_heights(unit, each) for each in tried]
        pictures = [renderer(height) for height in heights]
        each = [
            figures(picture, one.press.picture, test.background, one.press.region)
            for picture, one in zip(pictures, tried, strict=True)
        ]
        name = preset if preset == "fast" else f"{preset}_{variant}"
        found.append((name, _means(each), _ms(lambda draw=renderer, height=heights[0]: draw(height))))
    rows = [row(f"null_{name}", null[name], unit_, null=null[name], of=_of(test)) for name, unit_ in UNITS.items()]
    for method, values, ms in found:
        rows += [row(f"{method}_{name}", values[name], UNITS[name], null=null[name], of=_of(test)) for name in UNITS]
        rows.append(row(f"{method}_ms", ms, "ms", of="one core"))
    return rows


def _heights(unit: Calibration, tried: Tried) -> np.ndarray:
    bench = Bench(unit)
    return print_on(bench.rest, bench.right, bench.down, tried.ball.numbers).astype(np.float32)


def _of(photographs: Photographs) -> str:
    return f"{len(photographs.presses)} presses kept apart"


def _means(rows: list[dict]) -> dict[str, float]:
    return {name: float(np.nanmean([found[name] for found in rows])) for name in UNITS}


def _ms(work: Callable[[], object]) -> float:
    """CPU ms of a call, the best of some."""
    took = []
    for _ in range(REPEATS):
        began = time.process_time()
        work()
        took.append(time.process_time() - began)
    return 1e3 * min(took)


def plot(rows: list[Row]) -> bytes:
    """PNG: error in the region over time, both logarithmic, the background alone as a line."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    values = {found["name"]: found["value"] for found in rows}
    figure = Figure(figsize=(5.5, 4.0), layout="constrained")
    axes = figure.add_subplot()
    for name in (name.removesuffix("_ms") for name in values if name.endswith("_ms")):
        x, y = values[f"{name}_ms"], values[f"{name}_roi_l1"]
        axes.loglog(x, y, "o")
        axes.annotate(name.split("_llvm")[0].split("_scalar")[0], (x, y), rotation=45, textcoords="offset points",
                      xytext=(4, 4))  # fmt: skip
    axes.axhline(values["null_roi_l1"], color="grey", linestyle="--", label="background alone")
    axes.set(xlabel="CPU ms a picture, one core", ylabel="mean error in the region, grey levels")
    axes.margins(x=0.3, y=0.3)
    axes.legend()
    content = io.BytesIO()
    FigureCanvasAgg(figure).print_png(content, metadata={"Software": None})
    return content.getvalue()


if __name__ == "__main__":
    sys.exit(main())
