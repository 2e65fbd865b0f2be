"""The physical model beside a Taxim-like table: same photographs to fit, same photographs to meet."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from benchmarks.table.taxim_like import fit_table, try_table

from tactile_core.accuracy import HEADER, line, row
from tactile_core.pictures.calibrate import ball_pictures
from tactile_core.pictures.calibrate.evaluate import evaluate_unit, mean_metrics
from tactile_core.pictures.calibrate.photographs import Photographs, chosen, read_photographs
from tactile_core.sensors.calibration_file import load_calibration

BALL = 3e-3  # m, radius
KEPT_APART = ["0003.png", "0018.png", "0033.png", "0036.png", "0039.png"]


@pytest.fixture(scope="module")
def photographs(outside_data: Callable[[str], Path]) -> Photographs:
    return read_photographs(outside_data("digit_real") / "presses")


def test_shipped_calibration_beats_a_table_fitted_on_the_same_presses(
    photographs: Photographs, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ball_pictures, "WORKING_WIDTH", 60)  # both find the balls on a fourth of the pixels
    unit = load_calibration()
    test = chosen(photographs, KEPT_APART)
    table = fit_table(unit, chosen(photographs, list(unit.fit.photographs)), BALL)
    rows_of_table = try_table(table, unit, test, BALL)
    ours, baseline = mean_metrics(evaluate_unit(unit, test, BALL, search_radius=False))
    theirs = {name: float(np.mean([found[name] for found in rows_of_table])) for name in rows_of_table[0]}
    units = {"roi_l1": "levels", "roi_psnr": "dB", "roi_ssim": "", "frame_l1": "levels", "lobe_iou": ""}
    print("\n" + HEADER)
    for name in units:
        for label, values in (("fast", ours), ("taxim_like", theirs)):
            print(
                line(
                    row(f"{label}_{name}", values[name], units[name], baseline=baseline[name], of="5 held-out presses")
                )
            )
    assert baseline["roi_psnr"] < theirs["roi_psnr"] < ours["roi_psnr"]
    assert ours["roi_l1"] < theirs["roi_l1"] < baseline["roi_l1"]
