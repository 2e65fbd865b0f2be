"""Press an indenter into both fingertips and render the DIGIT's print, at forces from a light to a firm touch.

python docs/press_and_render.py                       # writes press_and_render.png
python docs/press_and_render.py print.png
"""

from __future__ import annotations

import sys

import numpy as np
from matplotlib.figure import Figure

import tactile_core as tactile

out = sys.argv[1] if len(sys.argv) > 1 else "press_and_render.png"
FORCES = 0.5, 1.0, 2.0, 4.0  # N

# An indenter is a shape in metres; a place is the same on both fingertips: (x, z) on the DIGIT, unrolled on the BioTac.
ring = tactile.indenters.Ring(radius=3e-3, tube=0.8e-3)
place = tactile.Placement(x=-7e-3, z=0.0, tilt=0.05)
renderer = tactile.Renderer(preset="fast")

figure = Figure(figsize=(12, 4), layout="constrained")
for axes, force in zip(figure.subplots(1, len(FORCES)), FORCES, strict=True):
    digit = tactile.solve("digit", ring, place, force=force)
    biotac = tactile.solve("biotac", ring, place, force=force)
    picture = renderer.render(digit.displacement)
    dent = np.linalg.norm(digit.displacement, axis=1).max()
    print(
        f"{force:g} N: DIGIT {digit.depth * 1e3:.2f} mm deep, dent {dent * 1e3:.2f} mm, error below "
        f"{digit.shape_error * 1e6:.0f} um; BioTac {biotac.depth * 1e3:.2f} mm deep, "
        f"fluid {biotac.pressure / 1e3:.2f} kPa"
    )
    axes.imshow(picture)
    axes.set_title(f"{force:g} N, {digit.depth * 1e3:.2f} mm")
    axes.set_axis_off()
figure.savefig(out)
print(f"wrote {out}")
