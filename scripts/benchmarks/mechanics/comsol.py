"""An independent COMSOL model of a BioTac SP pressed by a plate: its gaps, its volume and its force against ours.

Layout of a folder of presses, one folder a case (``001``): ``config.csv``, ``forces_001.csv`` (contact point, normal,
pressure, force), ``sensor_x_001.csv`` .. z (24 electrodes' rays on the outer skin), ``skin_x_001.csv`` .. z (60 x 32
rays), a row a step, mm and N.
"""

from __future__ import annotations

import csv
import dataclasses
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from tactile_core import sensors
from tactile_core.accuracy import Row, row
from tactile_core.errors import TactileError
from tactile_core.geometry.indenters import Pose
from tactile_core.mechanics.finite_strain.sp_press import INTERVALS, Plate, Pressed, SpPress
from tactile_core.mechanics.first_touch import first_touch
from tactile_core.mechanics.solution import Step
from tactile_core.mechanics.solve import solve_path
from tactile_core.sensors import biotac_sp

GAP, VOLUME, FORCE, STEEP_FORCE = 0.05, 0.2, 5.0, 15.0  # mm, %, %, %: targets (docs/sources.md, Targets)
STEEP = np.radians(40.0)  # of a plate, from where on the last one holds
SQUEEZED = 1e-3  # mm, within which electrodes count as squeezed alike: mirrored twins differ by our interpolation
DEEP = 0.3e-3  # m, forces count beyond this depth
FITTED = "001"  # the press that ``biotac_sp.FORCE_SCALE`` was fitted on
COARSE = (16, 12, 6)  # node intervals of the second mesh
_RAYS_DOWN = 32  # rays of the skin from rim to pole
_DEEPEST = 3e-3  # m, deeper than any press goes


def published_volume(intervals: tuple[int, int, int] = INTERVALS) -> Row:
    """Compare the fluid's volume at the published pressure under the published skin with the published volume.

    No number is fitted here: COMSOL and we inflate one ellipsoid of one material.
    """
    point = np.array([0.0, 0.0, -2 * biotac_sp.PUBLISHED_OUTER[2]])
    skin = biotac_sp.PUBLISHED_OUTER, biotac_sp.PUBLISHED_THICKNESS
    press = SpPress(point, np.array([0.0, 0.0, 1.0]), intervals, *skin)
    flat = 2 / 3 * np.pi * float(np.prod(skin[0] - skin[1]))
    off, baseline = (100 * (found / biotac_sp.PUBLISHED_VOLUME - 1) for found in (press.fluid_volume, flat))
    return row(
        "comsol_published_volume", off, "percent", VOLUME, baseline=baseline, of="1,750 Pa in the model of July 2020"
    )


@dataclasses.dataclass(frozen=True)
class Press:
    """Data of one case. point : (3,) m of the plate at the first step; into : (3,) normal; advances : (steps,) m.

    force : (steps,) N; electrodes : (steps, 24, 3) m, the outer skin on their rays; skin : (steps, rays, 3) m
    """

    name: str
    point: np.ndarray
    into: np.ndarray
    advances: np.ndarray
    force: np.ndarray
    electrodes: np.ndarray
    skin: np.ndarray

    @property
    def force_target(self) -> float:
        """Percent, of the mean error of force."""
        return FORCE if np.arccos(min(abs(self.into[2]), 1.0)) < STEEP else STEEP_FORCE

    def first_steps(self, steps: int) -> Press:
        """The press as far as its first steps."""
        names = ("advances", "force", "electrodes", "skin")
        return dataclasses.replace(self, **{name: getattr(self, name)[:steps] for name in names})


def rows(quick: bool, data: Path) -> Iterator[Row]:
    """Yield the rows of all presses of the outside data; without it, and in the quick form, those that need none."""
    folder = data / "biotac_comsol"
    if quick or not folder.is_dir():
        yield published_volume(COARSE)
    else:
        yield from comsol(folder)


def comsol(folder: Path, intervals: tuple[int, int, int] = INTERVALS) -> Iterator[Row]:
    """Rows of all presses in a folder; raises TactileError for one that is not of the module's layout."""
    every = list(presses(folder))
    yield published_volume(intervals)
    for press in every:
        steps = SpPress(press.point, press.into, intervals).steps(press.advances)
        yield from compare(press, steps)
        if press is every[0]:
            yield from _other_mesh(press, steps)


def presses(folder: Path) -> Iterator[Press]:
    """Read all presses of a folder; raises TactileError where there is none, and what ``read`` raises."""
    cases = sorted(path.parent for path in folder.glob("*/config.csv"))
    if not cases:
        raise TactileError(folder, "no folder with a config.csv in it", "a folder of COMSOL presses")
    yield from map(read, cases)


def read(case: Path) -> Press:
    """Read one case from its folder; raises TactileError where a file is missing or no table of numbers."""
    keys = ("itheta", "iphi", "ix", "iy", "iz", "itx", "ity", "itz", "istep")
    try:
        with (case / "config.csv").open(newline="", encoding="utf-8") as file:
            config = {line["Parameter"]: line["Value"] for line in csv.DictReader(file)}
        theta, phi, x, y, z, tx, ty, tz, step = (float(config[key]) for key in keys)
    except (KeyError, ValueError) as error:
        raise TactileError(case / "config.csv", f"no number for {error}", f"values of {', '.join(keys)}") from None
    theta, phi = np.radians([theta, phi])
    into = np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])
    name = case.name
    forces = _table(case / f"forces_{name}.csv")
    electrodes, skin = (
        _stack([_table(case / f"{what}_{axis}_{name}.csv") for axis in "xyz"], case) * 1e-3
        for what in ("sensor", "skin")
    )
    shapes = forces.shape, electrodes.shape, skin.shape
    if forces.shape[1] < 8 or len({shape[0] for shape in shapes}) > 1 or skin.shape[1] % _RAYS_DOWN:
        expected = f"8 columns of forces, as many rows in all, skin in meridians of {_RAYS_DOWN} rays"
        raise TactileError(case, f"tables of {shapes}", expected)
    advances = np.arange(len(forces)) * step * 1e-3 * float(into @ [tx, ty, tz])
    return Press(name, np.array([x, y, z]) * 1e-3, into, advances, forces[:, 7], electrodes, skin)


def _table(path: Path) -> np.ndarray:
    try:
        return np.loadtxt(path, delimiter=",", ndmin=2)
    except (OSError, ValueError) as error:
        raise TactileError(path, str(error), "a table of numbers") from None


def _stack(tables: list[np.ndarray], case: Path) -> np.ndarray:
    if len({table.shape for table in tables}) > 1:
        raise TactileError(case, f"tables of x, y, z of {[table.shape for table in tables]}", "one shape")
    return np.stack(tables, -1)


def compare(press: Press, steps: list[Pressed]) -> Iterator[Row]:
    """Rows of one press that has been solved."""
    changes, expected = gap_changes(press, steps)
    of = f"COMSOL press {press.name}, {len(steps)} steps"
    name = f"comsol_{press.name}"
    yield row(
        f"{name}_gap_rms", _rms(changes - expected), "mm", GAP, baseline=_rms(resting_gaps_cut(press) - expected), of=of
    )
    yield row(f"{name}_gap_rms_at_the_end", _rms((changes - expected)[-1]), "mm", of=of)
    most = int(expected[-1].argmin())
    behind = float(changes[-1, most] - changes[-1].min())
    yield row(f"{name}_gap_most_squeezed_behind", behind, "mm", SQUEEZED, of=f"E{most + 1} in COMSOL, at the end")
    volume, theirs, cut = volumes(press, steps)
    off, baseline = (float(100 * np.abs(found / theirs - 1).max()) for found in (volume, cut))
    yield row(f"{name}_enclosed_volume", off, "percent", VOLUME, baseline=baseline, of=of)
    fluid = np.array([step.volume for step in steps])
    yield row(f"{name}_fluid_volume_change", float(100 * np.abs(fluid / fluid[0] - 1).max()), "percent", VOLUME, of=of)
    ratio = force_ratios(press, steps)
    error = 100 * float(np.abs(ratio - 1).mean())
    fitted = press.name == FITTED
    yield row(f"{name}_force_error", error, "percent", None if fitted else press.force_target, baseline=100.0, of=of)
    yield row(f"{name}_force_bias", 100 * float(ratio.mean() - 1), "percent", of="fitted here" if fitted else of)
    # the COMSOL model knows no contact with the core, nor does ours: below zero both would be wrong
    yield row(f"{name}_core_gap", 1e3 * min(step.core_gap for step in steps), "mm", of=of)


def gap_changes(press: Press, steps: list[Pressed]) -> tuple[np.ndarray, np.ndarray]:
    """Change (steps, 24) mm of the gap at each electrode since the first step: ours and COMSOL's."""
    rays = press.electrodes[0]
    ours = np.stack([biotac_sp.radius_along(step.skin, rays) for step in steps])
    theirs = np.linalg.norm(press.electrodes, axis=-1)
    return (ours - ours[0]) * 1e3, (theirs - theirs[0]) * 1e3


def resting_gaps_cut(press: Press) -> np.ndarray:
    """Change (steps, 24) mm of the gaps if the plate only cuts the skin off, which does not bulge."""
    cut = _cut(press, press.electrodes[0])
    return 1e3 * (np.linalg.norm(cut, axis=-1) - np.linalg.norm(press.electrodes[0], axis=-1))


def volumes(press: Press, steps: list[Pressed]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Volume (steps,) m3 that the skin encloses over the origin within the rays: ours, COMSOL's, and without bulge."""
    rays = press.skin[0] / np.linalg.norm(press.skin[0], axis=-1, keepdims=True)
    ours = [_volume(rays * biotac_sp.radius_along(step.skin, rays)[:, None]) for step in steps]
    cut = [_volume(points) for points in _cut(press, press.skin[0])]
    return np.array(ours), np.array([_volume(points) for points in press.skin]), np.array(cut)


def force_ratios(press: Press, steps: list[Pressed]) -> np.ndarray:
    """Ratios of our force to COMSOL's at the steps deeper than ``DEEP``."""
    deep = np.array([step.advance > DEEP for step in steps])
    return np.array([step.force for step in steps])[deep] / press.force[deep]


def _cut(press: Press, points: np.ndarray) -> np.ndarray:
    """Ends (steps, n, 3) m of rays through resting points (n, 3), if the plate only cuts the skin off."""
    reach = (press.point @ press.into + press.advances)[:, None] / (points @ press.into)
    return np.where((points @ press.into < 0) & (reach < 1), reach, 1.0)[..., None] * points


def _volume(points: np.ndarray) -> float:
    """Volume of pyramids from the origin to a grid of points, ``_RAYS_DOWN`` a meridian, closed around."""
    grid = points.reshape(-1, _RAYS_DOWN, 3)
    grid = np.concatenate([grid, grid[:1]])
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    return float(abs((a * (np.cross(b, c) + np.cross(c, d))).sum()) / 6)


def _other_mesh(press: Press, steps: list[Pressed]) -> Iterator[Row]:
    """Compare with a coarser mesh: an upper bound of the remaining error."""
    other = SpPress(press.point, press.into, COARSE).steps(press.advances)
    of = f"press {press.name}, {COARSE} node intervals instead"
    both = [found.force for found in other], [found.force for found in steps]
    deep = np.array([found.advance > DEEP for found in steps])
    shift = 100 * float((np.array(both[0])[deep] / np.array(both[1])[deep]).mean() - 1)
    yield row(f"comsol_{press.name}_coarser_mesh_force", shift, "percent", of=of)
    moved = gap_changes(press, other)[0] - gap_changes(press, steps)[0]
    yield row(f"comsol_{press.name}_coarser_mesh_gap_rms", _rms(moved), "mm", of=of)


def fast_rows(press: Press, sensor: str) -> Iterator[Row]:
    """Yield the rows of one press on a sensor; the stiffness of ``comsol_sensor``'s skin was fitted on ``FITTED``."""
    steps = fast_steps(press, sensor)
    press = press.first_steps(len(steps))
    changes, expected = gap_changes(press, steps)
    off, baseline = changes - expected, resting_gaps_cut(press) - expected
    ratio = force_ratios(press, steps)
    of = f"COMSOL press {press.name}, {len(steps)} steps, fast tier of {sensor}"
    name, target = f"comsol_fast_{press.name}", None if press.name == FITTED else press.force_target
    yield row(f"{name}_gap_rms", _rms(off), "mm", GAP, baseline=_rms(baseline), of=of)
    yield row(f"{name}_gap_rms_at_the_end", _rms(off[-1]), "mm", of=of)
    yield row(f"{name}_force_error", 100 * float(np.abs(ratio - 1).mean()), "percent", target, baseline=100.0, of=of)
    yield row(f"{name}_force_bias", 100 * float(ratio.mean() - 1), "percent", of=of)


def fast_steps(press: Press, sensor: str) -> list[Pressed]:
    """The steps of a press on a sensor in the fast tier, frictionless, as far as it follows them."""
    turned = np.array([[-1.0, 0, 0], [0, 0, 1.0], [0, 1.0, 0]])  # COMSOL's axes in the shared frame, even in z
    shift = sensors.from_maker(np.zeros((1, 3)), sensor)[0]
    axis = -turned @ press.into
    first = np.cross([0.0, 0.0, 1.0], axis)
    first /= np.linalg.norm(first)
    start = Pose(turned @ press.point + shift, np.column_stack([first, np.cross(axis, first), axis]))
    surface = sensors.sensor_surface(sensor)
    touch = first_touch(surface, Plate(), start)
    clearance = float((touch.apex - start.apex) @ start.direction)
    depths = np.maximum(press.advances - clearance, 0.0)
    pad = surface.rest[:, 1] < sensors.skin_of(sensor).axis_y + 0.2e-3
    found: list[Pressed] = []
    try:
        for advance, step in zip(
            press.advances,
            solve_path(sensor, Plate(), touch, map(Step, depths), friction=0.0, limit=_DEEPEST),
            strict=True,
        ):
            skin = ((surface.rest + step.displacement)[pad] - shift) @ turned
            found.append(Pressed(advance - clearance, skin, step.axial_force, step.pressure, np.nan, np.nan))
    except TactileError:
        pass  # deeper than the linear tier finds
    return found


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))
