"""Simulate a BioTac recording: a scene's motion solved frame by frame, with the defects of real electrodes."""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from .. import sensors
from ..errors import TactileError
from ..files import atomic
from ..files.version import __version__
from ..geometry.indenters import Indenter
from ..mechanics.electrodes.biotac_sheet import signal_of
from ..mechanics.force_search import UnreachableError
from ..mechanics.placement import Placement, on_gel
from ..mechanics.solution import Sensor, Solution, Tier
from ..mechanics.solve import solve
from ..recordings import Truth, write_simulated
from ..sensors import SOURCE, TARGET, descriptor
from ..sensors.readout import readings
from .scene import RecordingSpec, Scene, load_scene

PRESSURE_AT_REST = 1750.0  # Pa, initial pressure of the independent COMSOL model (docs/sources.md, BioTac fluid)
_STILL_COUNT = 2000  # TDC and TAC, not simulated: a constant reading

DEFAULT = ("electrodes", "displacement_biotac", "displacement_digit")
ELECTRODES_OF = SOURCE  # whose counts are simulated
_FIELDS = ("displacement", "traction")  # of a sensor


def outputs() -> dict[str, Sensor]:
    """Return the sensor that each optional output needs, by the output's name: ``electrodes``, ``displacement_SENSOR``,
    ``traction_SENSOR``, of which ``keep`` chooses. Time, force and, if a gel is solved, the contact's centre are always
    stored."""
    fields = {f"{field}_{sensor}": sensor for sensor in descriptor.names() for field in _FIELDS}
    return {"electrodes": ELECTRODES_OF, **fields}


class _Frame(NamedTuple):
    """Outputs of a frame that are kept.
    moved, pressed : by sensor, displacement (n, 3) float32 m and traction (n, 3) float32 Pa
    force : (3,) N; pressure : Pa, rise of the fluid's
    change : (19,) counts of the electrodes; centre : (2,) m, centre of pressure on the first gel"""

    moved: dict[Sensor, np.ndarray]
    pressed: dict[Sensor, np.ndarray]
    force: np.ndarray
    pressure: float
    change: np.ndarray
    centre: np.ndarray


def simulate_recording(
    scene_path: str | os.PathLike,
    out: str | os.PathLike,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
    *,
    keep: Collection[str] = DEFAULT,
    tiers: Mapping[Sensor, Tier] | None = None,
    loaded: tuple[Scene, str] | None = None,
) -> int:
    """Simulate the [recording] of a scene at 100 Hz into the HDF5 file ``out``; return the number of frames that press.
    The motion is linear between the scene's points. Each frame is a separate press, straight to its force with the
    scene's friction. No frame depends on the deformation before it, so that rolling and sliding are the same.
    scene_path : scene.toml or its folder; seed : of the electrodes' rest, drift and noise
    progress : called with (frames done, frames)
    keep : names of the ``outputs()`` to store; a sensor that none of them needs is not solved
    tiers : "fast", "full" or "reference" by sensor; "fast" for others
    loaded : a scene and its text, used instead of the file, whose name then only serves messages
    Raises TactileError for a scene without a recording, a force that no depth within the tier's limit gives, and
    tractions of another tier than the fast one."""
    scene, text = loaded or load_scene(scene_path)
    spec = recording_of(scene, scene_path)
    used = sensors_of(keep)
    _check_tiers(keep, tiers or {})
    check_places(scene_path, spec, [sensor for sensor in used if sensors.is_gel(sensor)])
    atomic.claim(out)
    indenter = next(i for i in scene.indenters if i.name == spec.indenter).build()
    time, place, force = motion(spec)
    frames: list[_Frame] = []
    known: dict[tuple[float, ...], _Frame] = {}  # presses solved so far
    for t, (x, z), newtons in zip(time, place, force, strict=True):
        if (x, z, newtons) not in known:
            at = Placement(x, z, np.radians(spec.tilt_deg))
            where = f"{scene_path}, recording, {t:.2f} s"
            try:
                solved = _solve(where, indenter, at, newtons, spec.friction, used, tiers or {})
            except TactileError as error:
                error.second = t
                raise
            known[x, z, newtons] = _frame(solved, keep)
        frames.append(known[x, z, newtons])
        if progress:
            progress(len(frames), len(time))
    counts, pdc, still, note = None, None, None, ""
    if "electrodes" in keep:
        counts, pdc, note = _read(frames, time, spec, seed)
        still = np.full(len(time), _STILL_COUNT, np.int16)
    made_by = ", ".join(["mechanics.recording", *map(" ".join, sorted((tiers or {}).items()))])
    write_simulated(
        out, time=time, electrodes=counts, pdc=pdc, tac=still, tdc=still,
        truth=_truth(frames, keep), scene=text, seed=seed,
        made_by=f"tactile {__version__}, {made_by}",
        note=f"Simulated, not measured: {scene.description}{note}",
    )  # fmt: skip
    return int((force > 0).sum())


def _read(frames: list[_Frame], time: np.ndarray, spec: RecordingSpec, seed: int) -> tuple[np.ndarray, np.ndarray, str]:
    """Return the electrodes (T, e) and PDC (T,), counts, at the frames' ``time`` (T,) s, and a note on the pressure."""
    pressure = PRESSURE_AT_REST + np.array([frame.pressure for frame in frames])  # over the surrounding air
    change = np.stack([frame.change for frame in frames])
    drift = spec.drift_counts / (spec.points[-1].time_s - spec.points[0].time_s)
    note = f" Fluid pressure {pressure.min() / 1e3:.2f} to {pressure.max() / 1e3:.2f} kPa; PDC counts "
    note += f"{sensors.PRESSURE_PER_COUNT:g} Pa each. Electrodes by the sheet law."
    return readings(change, time, seed, noise=spec.noise_counts, drift=drift), pdc_counts(pressure), note


def sensors_of(keep: Collection[str]) -> tuple[Sensor, ...]:
    """Return the sensors that the outputs ``keep``, names of ``outputs()``, need, the BioTac first."""
    return tuple(dict.fromkeys(sensor for word, sensor in outputs().items() if word in keep))


def recording_of(scene: Scene, path: str | os.PathLike) -> RecordingSpec:
    """Return the scene's [recording]. Raises TactileError if it has none, naming the scene's ``path``."""
    if scene.recording is None:
        advice = "See scenes/press_roll_slide/scene.toml"
        raise TactileError(f"{path}, recording", "missing", "a [recording] table", advice)
    return scene.recording


def _check_tiers(keep: Collection[str], tiers: Mapping[Sensor, Tier]) -> None:
    """Raise TactileError if tractions are kept of a tier other than the fast one, which has none at surface nodes."""
    for sensor, tier in tiers.items():
        if f"traction_{sensor}" in keep and tier != "fast":
            found = f"of the {tier} tier, whose forces act on the nodes of its own mesh"
            raise TactileError(f"--keep traction_{sensor}", found, "the fast tier", "Give a larger --error, or none")


def check_places(scene_path: str | os.PathLike, spec: RecordingSpec, gels: Sequence[Sensor] = ()) -> None:
    """Raise TactileError for a pressing point (force above 0) that does not lie on each of the gels; without gels, on
    the DIGIT's. scene_path : names the scene in the message"""
    for (number, point), gel in itertools.product(enumerate(spec.points, 1), gels or (TARGET,)):
        if point.force_n > 0 and not on_gel(point.x_mm * 1e-3, point.z_mm * 1e-3, sensor=gel):
            shape = sensors.shape_of(gel)
            along, across = f"{1e3 * shape.tip_x:g} to {1e3 * shape.base_x:g} mm", f"{1e3 * shape.half_width:g} mm"
            error = TactileError(
                f"{scene_path}, recording.points, point {number}", f"({point.x_mm:g}, {point.z_mm:g}) mm",
                f"a place on the {sensors.title(gel)}'s gel, x {along}, z within {across}",
                "Move it or set its force_n to 0",
            )  # fmt: skip
            error.second = point.time_s
            raise error


def motion(spec: RecordingSpec) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a recording's time (T,) s, place (T, 2) = (x, z) m and force (T,) N, rounded to a nanonewton, at 100 Hz,
    linear between the points of ``spec``."""
    points = np.array([[p.time_s, p.x_mm, p.z_mm, p.force_n] for p in spec.points])
    time = np.arange(round(points[0, 0] * sensors.SAMPLE_RATE), round(points[-1, 0] * sensors.SAMPLE_RATE) + 1)
    time = time / sensors.SAMPLE_RATE
    x, z, force = (np.interp(time, points[:, 0], points[:, k]) for k in (1, 2, 3))
    return time, np.column_stack([x, z]) * 1e-3, np.round(force, 9)


def _solve(
    where: str, indenter: Indenter, place: Placement, force: float, friction: float, used: Collection[Sensor],
    tiers: Mapping[Sensor, Tier],
) -> dict[Sensor, Solution]:  # fmt: skip
    """Return a frame's contact under a force, N, on each sensor; no entries if nothing presses.
    friction : coefficient; used : sensors to solve; where : the frame in words, for messages"""
    found = {}
    for sensor in used if force > 0 else ():
        try:
            tier = tiers.get(sensor, "fast")
            found[sensor] = solve(sensor, indenter, place, force=force, tier=tier, friction=friction)
        except UnreachableError as error:
            raise TactileError(
                where, f"{force:.3g} N at ({place.x * 1e3:.1f}, {place.z * 1e3:.1f}) mm",
                f"a force that the {sensors.title(sensor)} bears within 60 % of its thickness", "Lower force_n there",
            ) from error  # fmt: skip
    return found


def _frame(solved: Mapping[Sensor, Solution], keep: Collection[str]) -> _Frame:
    """Return what is kept of a frame's contacts; keep : names of ``outputs``. The force is that on the first sensor,
    the BioTac if it is solved."""
    moved, pressed = _field(solved, keep, "displacement"), _field(solved, keep, "traction")
    if not solved:
        return _Frame(moved, pressed, np.zeros(3), 0.0, np.zeros(sensors.ELECTRODES), np.full(2, np.nan))
    first = next(iter(solved.values()))
    change = signal_of(solved[SOURCE]) if "electrodes" in keep else np.zeros(sensors.ELECTRODES)
    centre = next((each.centre for sensor, each in solved.items() if sensors.is_gel(sensor)), np.full(2, np.nan))
    return _Frame(moved, pressed, first.force, first.pressure, change, centre)


def _field(solved: Mapping[Sensor, Solution], keep: Collection[str], name: str) -> dict[Sensor, np.ndarray]:
    """Return the solutions' field ``name`` (n, 3) float32, by sensor, if it is kept; zero if nothing presses."""
    kept = [sensor for sensor in sensors_of(keep) if f"{name}_{sensor}" in keep]
    if not solved:
        return {sensor: np.zeros(sensors.sensor_surface(sensor).rest.shape, np.float32) for sensor in kept}
    return {sensor: getattr(solved[sensor], name).astype(np.float32) for sensor in kept}


def pdc_counts(pressure: np.ndarray) -> np.ndarray:
    """Convert the fluid's pressure (...,), Pa above the air's, to counts (...,) int16, 0..4095, of its sensor, PDC."""
    return np.clip(np.round(pressure / sensors.PRESSURE_PER_COUNT), 0, sensors.COUNT_MAX).astype(np.int16)


def _truth(frames: list[_Frame], keep: Collection[str]) -> Truth:
    """Return the outputs ``keep`` of all frames, their force and, if a gel is solved, the centre of pressure."""

    def stacked(fields: Sequence[dict[Sensor, np.ndarray]]) -> dict[Sensor, np.ndarray]:
        return {sensor: np.stack([field[sensor] for field in fields]) for sensor in fields[0]}

    moved, pressed = (stacked([getattr(frame, name) for frame in frames]) for name in ("moved", "pressed"))
    centre = np.stack([frame.centre for frame in frames]) if any(map(sensors.is_gel, sensors_of(keep))) else None
    return Truth(
        moved.pop(SOURCE, None), moved.pop(TARGET, None), np.stack([frame.force for frame in frames]), centre,
        pressed.pop(SOURCE, None), pressed.pop(TARGET, None), moved, pressed,
    )  # fmt: skip
