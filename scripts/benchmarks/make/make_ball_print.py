"""Make tactile_core/data/ball_print.npz: the rise of the DIGIT's gel under a 6 mm ball, by depth. About 3 minutes.

.venv/bin/python scripts/benchmarks/make/make_ball_print.py
"""

from __future__ import annotations

import io
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))  # `benchmarks` is no package that is installed

from scipy.interpolate import PchipInterpolator

from benchmarks.mechanics.pressed_disc import disc_mesh, pressed
from tactile_core.files import atomic
from tactile_core.geometry.indenters import Sphere
from tactile_core.pictures.calibrate.ball_print import TABLE, TABLE_RADIUS
from tactile_core.sensors import DIGIT_GEL
from tactile_core.sensors.digit import HALF_WIDTH, THICKNESS

DEPTHS = np.array([0.05, 0.1, 0.2, 0.3, 0.45, 0.6, 0.8, 1.0, 1.2, 1.4, 1.6, 1.8, 2.0, 2.2]) * 1e-3
SPACING, FINE_DEPTH, GROWTH = 0.05e-3, 1.0e-3, 1.15  # m, m: nodes under the ball; half of it changes rises by 1 um
LOAD_STEP = 0.1e-3  # m
STEP, NODES = 0.02, 241  # of the table, in distance / sqrt(2 R depth)
FADE = 0.8  # the table's last part goes to zero


def main() -> int:
    """Press a ball, fit its prints and write the table."""
    mesh = disc_mesh(HALF_WIDTH, THICKNESS, TABLE_RADIUS, SPACING, FINE_DEPTH, GROWTH)
    contact = pressed(mesh, DIGIT_GEL, Sphere(TABLE_RADIUS), TABLE_RADIUS)
    place = STEP * np.arange(NODES)
    fade = np.clip((place[-1] - place) / FADE, 0, 1)
    table = []
    for depth in DEPTHS:
        touch = contact.press(depth, step=LOAD_STEP)
        displacement = touch.state.displacement[mesh.surface]
        distance, rise = mesh.nodes[mesh.surface, 0] + displacement[:, 0], displacement[:, 1]
        # Mirrored over the axis, so that the slope there is zero; Pchip keeps the kink at the contact's edge.
        curve = PchipInterpolator(np.r_[-distance[4:0:-1], distance], np.r_[rise[4:0:-1], rise])
        table.append(fade * curve(np.minimum(place * np.sqrt(2 * TABLE_RADIUS * depth), distance.max())) / depth)
        sys.stderr.write(f"{depth * 1e3:.2f} mm: {touch.force[1]:.3f} N\n")
    content = io.BytesIO()
    np.savez_compressed(content, depth=DEPTHS, step=np.array(STEP), rise=np.array(table, np.float32))
    atomic.write_bytes(TABLE, content.getvalue())
    return 0


if __name__ == "__main__":
    sys.exit(main())
