"""Draw docs/overview.png: one contact of the recording that ships, pressed, read, translated and rendered.

    python scripts/benchmarks/make/make_overview.py [--out docs/overview.png]

Everything shown is the project's own output: deformation of both fingertips as simulated, the electrodes' signals that
the simulated BioTac reads, and what `tactile.translate` and `tactile.Renderer` make of these signals alone.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Poly3DCollection

import tactile_core as tactile
from tactile_core import sensors

ROOT = Path(__file__).parents[3]
RECORDING = ROOT / "scenes" / "press_roll_slide" / "press_roll_slide.h5"
VIEW = {"elev": 38, "azim": -60}  # degrees
MAGNIFIED = 2.0  # displacement is drawn this many times, so that a dent of half a millimetre shows at this size
COLORS = "viridis"


def main(arguments: list[str] | None = None) -> int:
    """Draw docs/overview.png, or the file of ``--out``; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "overview.png")
    out = parser.parse_args(arguments).out
    recording = tactile.read(RECORDING)
    touch = tactile.translate(recording)
    frame = int(np.argmax(np.linalg.norm(recording.truth.force, axis=1)))
    figure = Figure(figsize=(16, 4.3), dpi=100, facecolor="white")
    draw(figure, recording, touch, frame)
    figure.savefig(out, metadata={"Software": None})
    print(out)
    return 0


def draw(figure: Figure, recording: tactile.Recording, touch: tactile.Translation, frame: int) -> None:
    """Draw the five panels for one frame of a recording and of ``touch``, its translation."""
    truth = recording.truth
    skin, gel = truth.displacement_biotac[frame], truth.displacement_digit[frame]
    largest = max(np.linalg.norm(each, axis=1).max() for each in (skin, gel))
    title(figure, 0.20, "1  press: the same contact on BioTac and DIGIT")
    surface(figure, (0.005, 0.06, 0.19, 0.84), sensors.biotac_surface(), skin, largest)
    surface(figure, (0.2, 0.06, 0.19, 0.84), sensors.digit_surface(), gel, largest)
    title(figure, 0.525, "2  read: 19 electrodes of the BioTac")
    axes = figure.add_axes((0.448, 0.17, 0.165, 0.67))
    axes.plot(recording.time, recording.electrodes - recording.electrodes[:40].mean(axis=0), linewidth=0.7)
    axes.axvline(recording.time[frame], color="black", linestyle="--", linewidth=1)
    axes.set_xlabel("time, s")
    axes.set_ylabel("counts from rest", labelpad=1)
    title(figure, 0.725, "3  translate: DIGIT gel")
    surface(figure, (0.63, 0.06, 0.19, 0.84), sensors.digit_surface(), touch.displacement_digit[frame], largest)
    title(figure, 0.915, "4  render: DIGIT picture")
    axes = figure.add_axes((0.835, 0.06, 0.16, 0.8))
    axes.imshow(tactile.Renderer(preset="fast").render(touch.displacement_digit[frame]))
    axes.set_axis_off()
    figure.text(0.20, 0.03, f"colour: displacement, 0 to {largest * 1e3:.2f} mm; drawn {MAGNIFIED:g} times as large",
                ha="center", size=9, color="0.35")  # fmt: skip


def title(figure: Figure, x: float, text: str) -> None:
    """Write ``text`` as the heading of a panel; x : its middle, 0..1 of the figure's width"""
    figure.text(x, 0.93, text, ha="center", size=12, weight="bold")


def surface(figure: Figure, box: tuple, lattice: sensors.Lattice, displacement: np.ndarray, largest: float) -> None:
    """Draw a deformed surface in space, coloured by its nodes' displacement (n, 3) m up to ``largest`` m.
    box : of the panel, left, bottom, width, height, 0..1 of the figure"""
    import matplotlib

    axes = figure.add_axes(box, projection="3d")
    nodes = 1e3 * (lattice.rest + MAGNIFIED * displacement)[:, [0, 2, 1]] * (1, 1, -1)
    faces = nodes[lattice.faces]
    length = np.linalg.norm(displacement, axis=1)[lattice.faces].mean(axis=1)
    colors = matplotlib.colormaps[COLORS](length / largest)
    normal = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
    light = np.abs(normal @ (-0.4, -0.5, 0.77)) / np.maximum(np.linalg.norm(normal, axis=1), 1e-12)
    colors[:, :3] *= (0.45 + 0.55 * light)[:, None]
    axes.add_collection3d(Poly3DCollection(faces, facecolors=colors, edgecolors="none", antialiased=False))
    low, high = nodes.min(axis=0), nodes.max(axis=0)
    for name, a, b in zip("xyz", low, high, strict=True):
        getattr(axes, f"set_{name}lim")(a, b)
    axes.set_box_aspect(high - low, zoom=0.95)
    axes.view_init(**VIEW)
    axes.set_axis_off()


if __name__ == "__main__":
    sys.exit(main())
