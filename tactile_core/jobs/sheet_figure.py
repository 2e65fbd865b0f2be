"""Draw the figure of a contact sheet: its layout and its rows."""

from __future__ import annotations

import textwrap
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import sensors
from ..files.png_writer import pack_png
from ..geometry.lattice import Lattice
from ..sensors import unrolling
from ..sensors.camera import Camera
from ..translation.trust_words import in_words, is_guess

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.patches import Rectangle

FRAMES = 6  # columns of a sheet

# Layout, inches at DPI: 1,600 px wide.
DPI = 100
WIDTH, LEFT, RIGHT, GAP = 16.0, 0.95, 1.05, 0.12
TITLE, WARNING_LINE, NUMBERS, ELECTRODES, TIME_AXIS, HEADING, Z_AXIS = 0.62, 0.21, 0.16, 1.4, 0.45, 0.26, 0.36
PRESSURE, EXPLAINED = 0.75, 0.5
# Room for five lines: force, two reasons of which one is too long for a line, expected error; of 31 letters at most.
CAPTION, CAPTION_LETTERS, FOOT = 1.045, 31, 0.25

UNROLLED_X, UNROLLED_Z = (-24e-3, 8e-3), (-11.2e-3, 11.2e-3)  # m, what the unrolled rows show
BESIDE_GEL = 0.5e-3, 0.4e-3  # m along and across the finger, of what the gel's row shows beside it
Z_TICKS = 1e-3 * np.arange(-50, 51, 5)  # m
BORDER = 0.6  # points
COLORMAP = "viridis"
SMALLEST_SCALE = 1e-6  # m, so that frames without contact do not show rounding as colour
MARK = "#c03028"
LEGEND = {"loc": "center left", "bbox_to_anchor": (1.003, 0.5), "fontsize": 6.5, "frameon": False, "borderaxespad": 0}
PACKING = {"compress_level": 4}  # of a sheet without libdeflate: 1.2 MB in 0.14 s; 1.7 MB in 0.13 s as pictures are


class SheetFigure:
    """Figure of a contact sheet, drawn from the top; maps lie as the camera sees the gel, fingertip up."""

    def __init__(
        self, columns: int, camera: Camera, warnings: list[str], truth: bool, *, snapshots: bool = False
    ) -> None:
        """Make an empty figure for `columns` frames and a camera's gel. warnings : lines below the title
        truth : true makes room for rows of the true deformation; snapshots : true labels frames by number, not time"""
        from matplotlib.figure import Figure

        self._over, self._heading = ("snapshot", "snapshot {:.0f}") if snapshots else ("time, s", "{:.2f} s")
        self.columns, self.camera, self.warnings = columns, camera, warnings
        self._gel = camera.surface
        self._gel_x, self._gel_z = (
            _shown(self._gel.rest[:, axis], beside) for axis, beside in zip((0, 2), BESIDE_GEL, strict=True)
        )
        self.column_width = (WIDTH - LEFT - RIGHT - (FRAMES - 1) * GAP) / FRAMES
        skins = 2 if truth else 1
        rows = skins * (self._row_height(UNROLLED_X, UNROLLED_Z) + GAP) + self._row_height(self._gel_x, self._gel_z)
        rows += self.column_width * camera.height / camera.width + Z_AXIS
        head = TITLE + WARNING_LINE * len(warnings) + NUMBERS + ELECTRODES + TIME_AXIS + HEADING
        head += (PRESSURE + TIME_AXIS) + (EXPLAINED + GAP)
        self.height = head + rows + CAPTION + FOOT
        self.figure: Figure = Figure(figsize=(WIDTH, self.height), dpi=DPI, facecolor="white")
        self.top = 0.0  # inches from the upper edge to what is still free

    def _row_height(self, x: tuple[float, float], z: tuple[float, float]) -> float:
        return self.column_width * (x[1] - x[0]) / (z[1] - z[0])

    def _middle(self, column: int) -> float:
        return LEFT + column * (self.column_width + GAP) + self.column_width / 2

    def _axes(self, left: float, width: float, height: float) -> Axes:
        bottom = self.height - self.top - height
        return self.figure.add_axes((left / WIDTH, bottom / self.height, width / WIDTH, height / self.height))

    def _text(self, left: float, down: float, text: str, **style: Any) -> None:
        self.figure.text(left / WIDTH, 1 - (self.top + down) / self.height, text, **style)

    def title(self, name: str, simulated: bool) -> None:
        """Draw the recording's name, a mark if simulated, and the figure's warnings below."""
        self._text(LEFT, 0.36, name, size=15, weight="bold", va="center", parse_math=False)
        if simulated:
            box = {"boxstyle": "round,pad=0.35", "facecolor": MARK, "edgecolor": "none"}
            self._text(WIDTH - RIGHT, 0.36, "SIMULATED", size=12, weight="bold", color="white", ha="right", va="center",
                       bbox=box)  # fmt: skip
        self.top += TITLE
        for line in self.warnings:
            self._text(LEFT, 0.08, line, size=9.5, color=MARK, va="center", parse_math=False)
            self.top += WARNING_LINE

    def electrodes(self, time: np.ndarray, electrodes: np.ndarray, frames: np.ndarray) -> None:
        """Draw electrodes (T, 19), counts from rest, over time (T,) s; mark frames (k,), those of the columns."""
        import matplotlib

        self.top += NUMBERS
        axes = self._axes(LEFT, WIDTH - LEFT - RIGHT, ELECTRODES)
        colors = matplotlib.colormaps["turbo"](np.linspace(0.05, 0.95, electrodes.shape[1]))
        for k, values in enumerate(electrodes.T):
            axes.plot(time, values, color=colors[k], linewidth=0.8, label=f"E{k + 1}")
        for k, at in enumerate(time[frames]):
            axes.axvline(at, color="black", linewidth=0.9, linestyle=(0, (4, 2)))
            axes.annotate(str(k + 1), (at, 1), xycoords=("data", "axes fraction"), xytext=(0, 3),
                          textcoords="offset points", ha="center", size=10, weight="bold")  # fmt: skip
        axes.margins(x=0.005)
        axes.set_xlabel(self._over, labelpad=1)
        axes.set_ylabel("electrodes, counts\nfrom rest")
        axes.legend(ncols=2, handlelength=0.9, columnspacing=0.7, handletextpad=0.4, labelspacing=0.25, **LEGEND)
        self._over_time = axes.get_xlim()
        self.top += ELECTRODES + TIME_AXIS

    def explained(self, time: np.ndarray, explained: np.ndarray) -> None:
        """Draw explained (T,), share of the electrodes' change that is explained, over time (T,) s; below 0 as 0."""
        axes = self._axes(LEFT, WIDTH - LEFT - RIGHT, EXPLAINED)
        axes.plot(time, np.clip(explained, 0, 1), color="black", linewidth=0.8)
        axes.set(xlim=self._over_time, ylim=(0, 1), yticks=[0, 0.5, 1], xticklabels=[])
        axes.set_ylabel("explained", size=8)
        self.top += EXPLAINED + GAP

    def pressure(self, time: np.ndarray, pressure: np.ndarray, measured: np.ndarray) -> None:
        """Draw the fluid's translated pressure (T,) Pa over time (T,) s and, if known, the measured one (T,) Pa."""
        axes = self._axes(LEFT, WIDTH - LEFT - RIGHT, PRESSURE)
        if np.isfinite(measured).any():
            axes.plot(time, 1e-3 * measured, color="0.55", linewidth=1.6, label="measured")
        axes.plot(time, 1e-3 * pressure, color=MARK, linewidth=0.9, label="translated")
        axes.margins(x=0.005)
        axes.set(ylabel="fluid, kPa")
        axes.set_xlabel(self._over, labelpad=1)
        axes.legend(**LEGEND)
        self.top += PRESSURE + TIME_AXIS

    def headings(self, seconds: np.ndarray) -> None:
        """Write above each column its number, from 1, and its time; seconds : (k,) s from the recording's start, or
        numbers of snapshots"""
        for k, at in enumerate(seconds):
            text = f"{k + 1}:  {self._heading.format(at)}"
            self._text(self._middle(k), 0.17, text, size=10, weight="bold", ha="center", va="center")
        self.top += HEADING

    def skin_row(
        self, label: str, displacement: np.ndarray, largest: float, centers: np.ndarray | None, sensor: str
    ) -> None:
        """Draw maps of displacement (k, N, 3) m on a sensor's unrolled skin, one per column. label : before the row
        largest : m, where colours end; centers : (k, c, 2) = (x, z) m of contacts, or None"""
        plan, faces = unrolling.unrolled_nodes(sensor), sensors.sensor_surface(sensor).faces
        faces = faces[np.isfinite(plan[faces]).all((1, 2))]
        self._surface_row(label, plan, faces, displacement, largest, UNROLLED_X, UNROLLED_Z, centers)
        self.top += GAP

    def gel_row(self, label: str, displacement: np.ndarray, centers: np.ndarray) -> None:
        """Draw maps of displacement (k, M, 3) m of the gel, the picture's border, and centers (k, c, 2) m."""
        gel, z = self._gel, self._gel_z
        axes = self._surface_row(
            label, gel.rest[:, [0, 2]], gel.faces, displacement, scale(displacement), self._gel_x, z, centers
        )
        border = np.stack([self.camera.gel_x[[0, 0, -1, -1, 0]], self.camera.gel_z[[0, -1, -1, 0, 0]]], axis=1)
        ticks = Z_TICKS[(z[0] < Z_TICKS) & (z[1] > Z_TICKS)]
        for k in range(self.columns):
            axes.plot(*self._on_sheet(border, k, z).T, color="white", linewidth=0.8, linestyle=(0, (2, 2)))
            self._text(self._middle(k), 0.22, "z, mm", size=7, ha="center", va="center")
        places = np.stack([np.zeros_like(ticks), ticks], axis=1)
        axes.set_xticks(np.concatenate([self._on_sheet(places, k, z)[:, 0] for k in range(self.columns)]))
        axes.set_xticklabels([f"{1e3 * tick:.0f}".replace("-", "\N{MINUS SIGN}") for tick in ticks] * self.columns)
        self.top += Z_AXIS

    def _on_sheet(self, place: np.ndarray, column: int, z: tuple[float, float]) -> np.ndarray:
        """Convert place (..., 2) = (x, z) m on a column's map to (..., 2) mm from the row's left edge, and along x.
        z : m, range that a map shows"""
        pitch = (self.column_width + GAP) / self.column_width * (z[1] - z[0])
        from_left = self.camera.right_z * place[..., 1] - min(self.camera.right_z * np.array(z))
        return np.stack([1e3 * (column * pitch + from_left), 1e3 * place[..., 0]], axis=-1)

    def _surface_row(
        self,
        label: str,
        plan: np.ndarray,
        faces: np.ndarray,
        displacement: np.ndarray,
        largest: float,
        x: tuple[float, float],
        z: tuple[float, float],
        centers: np.ndarray | None,
    ) -> Axes:
        """Draw maps of the length of displacement (k, n, 3) m over the plan (n, 2) = (x, z) m, in one set of axes.
        faces : (f, 3) nodes; x, z : m, ranges shown; largest : m, where colours end; centers : (k, c, 2) m, or None"""
        from matplotlib.tri import Triangulation

        axes, height = self._row(self._row_height(x, z)), self._row_height(x, z)
        length = np.linalg.norm(displacement, axis=-1) * 1e3
        corners = np.array([(x[0], z[0]), (x[1], z[1])])
        for k in range(self.columns):
            frame = self._frame(axes, *self._on_sheet(corners, k, z))
            triangles = Triangulation(*self._on_sheet(np.nan_to_num(plan), k, z).T, faces)
            colors = axes.tripcolor(triangles, length[k], shading="gouraud", cmap=COLORMAP, vmin=0, vmax=largest * 1e3)
            outline = self._on_sheet(_outline(self._gel), k, z).T
            drawn = [colors, *axes.plot(*outline, color="white", linewidth=2.2)]
            drawn += axes.plot(*outline, color="black", linewidth=0.9)
            if centers is not None:
                cross = self._on_sheet(centers[k], k, z).T
                drawn += axes.plot(*cross, "+", color=MARK, markersize=9, markeredgewidth=1.6)
            for artist in drawn:
                artist.set_clip_path(frame)
        left, right = (self._on_sheet(corners, k, z)[:, 0] for k in (0, self.columns - 1))
        axes.set_xlim(left.min(), right.max())
        axes.set_ylim(np.array(x)[:: -self.camera.down_x] * 1e3)
        axes.set_ylabel(f"{label}\nx, mm", labelpad=2)
        self._color_bar(colors, height)
        self.top += height
        return axes

    def _row(self, height: float) -> Axes:
        """Return the axes that all columns of a row share, without a border; height : inches"""
        axes = self._axes(LEFT, self.columns * (self.column_width + GAP) - GAP, height)
        axes.spines[:].set_visible(False)
        axes.tick_params(length=2.5, labelsize=7)
        axes.set_xticks([])
        return axes

    def _frame(self, axes: Axes, corner: np.ndarray, opposite: np.ndarray) -> Rectangle:
        """Draw a column's border and background, corner to opposite corner (2,) of the axes; return the latter."""
        from matplotlib.patches import Rectangle

        width, height = opposite - corner
        border = {"facecolor": "none", "edgecolor": "black", "linewidth": BORDER, "zorder": 2.5, "clip_on": False}
        axes.add_patch(Rectangle(corner, width, height, **border))
        ground = Rectangle(corner, width, height, facecolor="0.93", edgecolor="none", zorder=-1)
        axes.add_patch(ground)
        return ground

    def _color_bar(self, colors: Any, height: float) -> None:
        last = LEFT + self.columns * (self.column_width + GAP) - GAP
        axes = self._axes(last + 0.12, 0.13, height)
        bar = self.figure.colorbar(colors, cax=axes)
        bar.outline.set_linewidth(0.6)
        bar.ax.tick_params(length=2.5, labelsize=7)
        bar.set_label("displacement, mm", size=8)

    def picture_row(self, label: str, pictures: np.ndarray) -> None:
        """Draw pictures (k, H, W, 3) uint8; label : text before the row"""
        height = self.column_width * self.camera.height / self.camera.width
        axes = self._row(height)
        for k in range(self.columns):
            left = k * (self.column_width + GAP)
            extent = (left, left + self.column_width, 0.0, height)
            axes.imshow(pictures[k], interpolation="nearest", aspect="auto", extent=extent)
            self._frame(axes, np.array(extent[::2]), np.array(extent[1::2]))
        axes.set_xlim(0, left + self.column_width)
        axes.set_ylim(0, height)
        axes.set_yticks([])
        axes.set_ylabel(label)
        self.top += height

    def captions(self, force: np.ndarray, *trust: np.ndarray) -> None:
        """Write each column's force (k, 3) N and how far to trust it, and a key to the maps below.
        trust : arrays (k,): confidence 0..1, flags, expected error m, dent m"""
        for k, (confidence, flags, error, dent) in enumerate(zip(*trust, strict=True)):
            words = in_words(confidence, flags, error, dent, force[k])
            lines = [f"force {np.linalg.norm(force[k]):.2f} N", *words.replace(", ", ",\n").split("\n")]
            text = "\n".join(textwrap.fill(line, CAPTION_LETTERS) for line in lines)
            color = MARK if is_guess(confidence, flags, error, dent) else "black"
            self._text(self._middle(k), 0.08, text, size=10, ha="center", va="top", color=color)
        self.top += CAPTION
        tip, along = "up" if self.camera.down_x > 0 else "down", "left" if self.camera.right_z < 0 else "right"
        foot = (
            f"Maps lie as the camera sees the gel: fingertip (-x) {tip}, z to the {along}. Black: outline of the "
            f"{sensors.title(self.camera.sensor)}'s gel. Dashed: its picture. Cross: contact centre."
        )
        self._text(LEFT, 0.05, foot, size=7.5, color="0.35", va="center")

    def png(self) -> bytes:
        """Return the figure as the bytes of a PNG; equal figures make equal bytes."""
        from matplotlib.backends.backend_agg import FigureCanvasAgg

        canvas = FigureCanvasAgg(self.figure)
        canvas.draw()
        return pack_png(np.ascontiguousarray(np.asarray(canvas.buffer_rgba())[..., :3]), PACKING)


def scale(*displacements: np.ndarray | None) -> float:
    """Return the largest length, m, among displacements (k, n, 3) m, at least 1e-6; None is skipped."""
    lengths = [np.linalg.norm(d, axis=-1).max(initial=0) for d in displacements if d is not None]
    return max(SMALLEST_SCALE, *lengths)


def _shown(place: np.ndarray, beside: float) -> tuple[float, float]:
    """Return the range, m, that a row shows along an axis: all nodes' place (n,) m, and `beside` m more, to 0.1 mm."""
    low, high = np.round(1e4 * np.array([place.min() - beside, place.max() + beside])) / 1e4
    return float(low), float(high)


def _outline(gel: Lattice) -> np.ndarray:
    """Return the closed outline (n, 2) = (x, z) m of a gel's lattice."""
    grid = gel.grid(gel.rest)[..., [0, 2]]
    return np.concatenate([grid[0], grid[1:, -1], grid[-1, -2::-1], grid[-2::-1, 0]])
