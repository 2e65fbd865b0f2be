"""Make tactile_core/data/ball_print.npz: the rise of the DIGIT's gel under balls of 1, 2.4 and 6 mm. 10 minutes.

.venv/bin/python scripts/benchmarks/make/make_ball_print.py
"""

from __future__ import annotations

import io
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # `benchmarks` is no package that is installed

from scipy.interpolate import PchipInterpolator

from benchmarks.mechanics.axisymmetric import disc_mesh, pressed
from tactile_core.files import atomic
from tactile_core.geometry.indenters import Sphere
from tactile_core.pictures.calibrate.ball_print import TABLE
from tactile_core.sensors import shape_of

# By radius, m: depths and the spacing of nodes below, in radii; smaller balls are pressed deeper. Half the spacing
# changes rises of the large ball by 1 um, forces of the small one by 0.4 %.
DIGIT = shape_of("digit")
LARGE = np.array([0.05, 0.1, 0.2, 0.3, 0.45, 0.6, 0.8, 1.0, 1.2, 1.4, 1.6, 1.8, 2.0, 2.2]) / 3
DEPTHS = {0.5e-3: np.r_[LARGE[1:], 0.85, 1.0, 1.15, 1.3], 1.2e-3: np.r_[LARGE[1:], 0.85, 1.0], 3e-3: LARGE}
SPACING = {0.5e-3: 1 / 30, 1.2e-3: 1 / 30, 3e-3: 1 / 60}
FINE_DEPTH, LOAD_STEP, GROWTH = 1 / 3, 1 / 30, 1.15
STEP, NODES = 0.02, {0.5e-3: 601, 1.2e-3: 401, 3e-3: 241}  # of the table, in distance / sqrt(2 R depth)
FADE = 0.8  # the table's last part goes to zero


def main() -> int:
    """Press balls into a flat layer, tabulate the gel's rise around them, write the table; returns the exit status."""
    content = io.BytesIO()
    tables = {}
    for k, (radius, shares) in enumerate(DEPTHS.items()):
        tables |= {f"depth_{k}": radius * shares, f"rise_{k}": prints(radius, radius * shares, NODES[radius])}
    np.savez_compressed(content, radius=np.array(list(DEPTHS)), step=np.array(STEP), **tables)
    atomic.write_bytes(TABLE, content.getvalue())
    return 0


def prints(radius: float, depths: np.ndarray, nodes: int) -> np.ndarray:
    """Return the rise (n, nodes) float32 of a flat layer under a ball of ``radius`` m at depths (n,) m, over depth.
    nodes : number of places; they lie 0, STEP, 2 STEP, ... times sqrt(2 radius depth) from the ball's axis"""
    mesh = disc_mesh(DIGIT.half_width, DIGIT.thickness, radius, SPACING[radius] * radius, FINE_DEPTH * radius, GROWTH)
    contact = pressed(mesh, DIGIT.descriptor.material, Sphere(radius), radius)
    place = STEP * np.arange(nodes)
    fade = np.clip((place[-1] - place) / FADE, 0, 1)
    table = []
    for depth in depths:
        touch = contact.press(depth, step=LOAD_STEP * radius)
        displacement = touch.state.displacement[mesh.surface]
        distance, rise = mesh.nodes[mesh.surface, 0] + displacement[:, 0], displacement[:, 1]
        # Mirrored over the axis, so that the slope there is zero; Pchip keeps the kink at the contact's edge.
        curve = PchipInterpolator(np.r_[-distance[4:0:-1], distance], np.r_[rise[4:0:-1], rise])
        table.append(fade * curve(np.minimum(place * np.sqrt(2 * radius * depth), distance.max())) / depth)
        sys.stderr.write(f"{2e3 * radius:.2f} mm, {depth * 1e3:.2f} mm: {touch.force[1]:.4f} N\n")
    return np.array(table, np.float32)


if __name__ == "__main__":
    sys.exit(main())
