"""Convert a recording and look at it: signals, force, contact place and camera pictures over time, in one figure.

python docs/convert_and_look.py                       # the recording that ships; writes convert_and_look.png
python docs/convert_and_look.py touch.csv look.png
"""

from __future__ import annotations

import sys

import numpy as np
from matplotlib.figure import Figure

import tactile_core as tactile
from tactile_core.files import example_scenes

SHIPPED = example_scenes.folder() / "press_roll_slide" / "press_roll_slide.h5"
path, out = (sys.argv[1:] + [SHIPPED, "convert_and_look.png"][len(sys.argv) - 1 :])[:2]

# From the file to pictures.
recording = tactile.read(path)
touch = tactile.translate(recording)
shown = np.linspace(0, len(recording) - 1, 8).astype(int)
pictures = tactile.Renderer(preset="fast").render(touch.displacement_digit[shown])

# Arrays have the frames first; a frame without contact has no force and no contact place.
touched = np.isfinite(touch.contact_center[:, 0])
print(f"{recording.name}: {len(recording)} frames, {recording.duration:.1f} s, {touched.sum()} in contact")
print(f"largest force {np.linalg.norm(touch.force, axis=1).max():.2f} N")
print(f"largest pressure {touch.pressure.max() / 1e3:.2f} kPa")
print(f"median of the expected largest node error {np.median(touch.expected_error_digit[touched]) * 1e3:.2f} mm")

figure = Figure(figsize=(12, 9), layout="constrained")
rows = figure.subfigures(2, 1, height_ratios=[2, 1])
signals, force, place = rows[0].subplots(3, 1, sharex=True)
signals.plot(recording.time, recording.electrodes - np.median(recording.electrodes[:20], axis=0), linewidth=0.8)
signals.set_ylabel("electrodes,\ncounts from the start")
force.plot(recording.time, touch.force, label=["x", "y", "z"])
force.set_ylabel("force, N")
force.legend(ncols=3)
place.plot(recording.time, touch.contact_center * 1e3, label=["x", "z"])
place.set_ylabel("contact on the\nDIGIT, mm")
place.set_xlabel("time, s")
place.legend(ncols=2)
for axes, frame, picture in zip(rows[1].subplots(1, len(shown)), shown, pictures, strict=True):
    axes.imshow(picture)
    axes.set_title(f"{recording.time[frame]:.2f} s")
    axes.set_axis_off()
figure.savefig(out)
print(f"wrote {out}")
