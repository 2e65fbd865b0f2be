"""A simulated BioTac recording: a scene's motion solved frame by frame, with the defects of real electrodes."""

from __future__ import annotations

import os
from collections.abc import Callable

import numpy as np

from .. import __version__, atomic, sensors
from ..errors import TactileError
from ..recordings import Truth, write_simulated
from ..scene import RecordingSpec, load_scene
from .compliance import biotac_compliance, digit_compliance
from .contact import Contact, fluid_pressure, surface_displacement
from .electrodes import electrode_gaps, raw_counts, signal_of_gaps
from .pairs import contact_center
from .press import Placement, Press, biotac_pose, digit_pose, on_gel

PRESSURE_PER_COUNT = 100e3 / 4096  # Pa: the fluid's 0 to 100 kPa over 12 bits (sensors.md)
PRESSURE_AT_REST = 1750.0  # Pa, initial pressure of the independent COMSOL model (sensors.md)
REST_SPREAD = 150.0  # counts, spread of the rest readings from electrode to electrode: assumed
_STILL_COUNT = 2000  # TDC and TAC, not simulated: a constant reading

Pair = tuple[Contact, Contact]


def simulate_recording(
    scene_path: str | os.PathLike,
    out: str | os.PathLike,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
) -> None:
    """Simulate the [recording] of a scene at 100 Hz into the HDF5 file ``out``, with its true meshes.

    The motion is linear between the scene's points; rolling and sliding differ in nothing else, for contact is without
    friction here. progress : called with (frames done, frames). Raises TactileError for a scene without a recording, or
    one that presses harder than the linear model may be asked.
    """
    scene, text = load_scene(scene_path)
    spec = scene.recording
    if spec is None:
        raise TactileError(
            f"{scene_path}, recording", "missing", "a [recording] table", "See scenes/press_roll_slide/scene.toml"
        )
    atomic.claim(out)
    _check_places(scene_path, spec)
    indenter = next(i for i in scene.indenters if i.name == spec.indenter).build()
    time, place, force = _motion(spec)
    frames: list[Pair | None] = []
    for t, (x, z), newtons in zip(time, place, force, strict=True):
        at = Placement(x, z, np.radians(spec.tilt_deg))
        frames.append(_solve(scene_path, indenter, at, newtons, t) if newtons > 0 else None)
        if progress:
            progress(len(frames), len(time))
    random = np.random.default_rng(seed)
    rest = sensors.REST_COUNT + np.round(random.uniform(-REST_SPREAD, REST_SPREAD, 19))
    drift = random.uniform(-spec.drift_counts, spec.drift_counts, 19)
    electrodes = raw_counts(_signals(frames), rest, spec.noise_counts, drift, seed)
    still = np.full(len(time), _STILL_COUNT, np.int16)
    write_simulated(
        out, time=time, electrodes=electrodes, pdc=_pressure_counts(frames), tac=still, tdc=still, truth=_truth(frames),
        scene=text, seed=seed, made_by=f"tactile {__version__}, mechanics.recording",
        note=f"Simulated, not measured: {scene.description}",
    )  # fmt: skip


def _check_places(scene_path: str | os.PathLike, spec: RecordingSpec) -> None:
    for number, point in enumerate(spec.points, 1):
        if point.force_n > 0 and not on_gel(point.x_mm * 1e-3, point.z_mm * 1e-3):
            raise TactileError(
                f"{scene_path}, recording.points, point {number}", f"({point.x_mm:g}, {point.z_mm:g}) mm",
                "a place on the DIGIT's gel, x -20.06 to 4.94 mm, z within 9.17 mm", "Move it or set its force_n to 0",
            )  # fmt: skip


def _motion(spec: RecordingSpec) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """time (T,) s, place (T, 2) m and force (T,) N at 100 Hz."""
    points = np.array([[p.time_s, p.x_mm, p.z_mm, p.force_n] for p in spec.points])
    time = np.arange(round(points[0, 0] * sensors.SAMPLE_RATE), round(points[-1, 0] * sensors.SAMPLE_RATE) + 1)
    time = time / sensors.SAMPLE_RATE
    x, z, force = (np.interp(time, points[:, 0], points[:, k]) for k in (1, 2, 3))
    return time, np.column_stack([x, z]) * 1e-3, force


def _solve(scene_path, indenter, place: Placement, force: float, time: float) -> Pair:  # noqa: ANN001
    biotac = Press(biotac_compliance(), indenter, biotac_pose(indenter, place)).at_force(force)
    digit = Press(digit_compliance(), indenter, digit_pose(indenter, place)).at_force(force)
    if biotac is None or digit is None:
        which = "BioTac" if biotac is None else "DIGIT"
        raise TactileError(
            f"{scene_path}, recording, {time:.2f} s", f"{force:.3g} N at ({place.x * 1e3:.1f}, {place.z * 1e3:.1f}) mm",
            f"a force that the {which} bears within 1.2 mm and without touching its core", "Lower force_n there",
        )  # fmt: skip
    return biotac, digit


def _signals(frames: list[Pair | None]) -> np.ndarray:
    skin = biotac_compliance()
    return np.stack([np.zeros(19) if f is None else signal_of_gaps(electrode_gaps(skin, f[0])) for f in frames])


def _pressure_counts(frames: list[Pair | None]) -> np.ndarray:
    rise = np.array([0.0 if f is None else fluid_pressure(biotac_compliance(), f[0]) for f in frames])
    return np.round((PRESSURE_AT_REST + rise) / PRESSURE_PER_COUNT).astype(np.int16)


def _truth(frames: list[Pair | None]) -> Truth:
    skin, gel = biotac_compliance(), digit_compliance()

    def moved(compliance, contact: Contact | None) -> np.ndarray:  # noqa: ANN001
        if contact is None:
            return np.zeros((len(compliance.surface.rest), 3), np.float32)
        return surface_displacement(compliance, contact).astype(np.float32)

    return Truth(
        displacement_biotac=np.stack([moved(skin, f and f[0]) for f in frames]),
        displacement_digit=np.stack([moved(gel, f and f[1]) for f in frames]),
        force=np.stack([np.zeros(3) if f is None else f[0].force for f in frames]),
        contact_center=np.stack([np.full(2, np.nan) if f is None else contact_center(f[1]) for f in frames]),
    )
