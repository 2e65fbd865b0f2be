"""A simulated BioTac recording: a scene's motion solved frame by frame, with the defects of real electrodes."""

from __future__ import annotations

import os
from collections.abc import Callable

import numpy as np

from .. import __version__, atomic, sensors
from ..errors import TactileError
from ..indenters import Indenter
from ..recordings import Truth, write_simulated
from ..scene import RecordingSpec, load_scene
from .compliance import Compliance, biotac_compliance, compliance_of, digit_compliance
from .corrected_press import CorrectedPress, FastContact
from .electrodes import Wiring, electrode_gaps, readings, signal_of_gaps
from .pair_rows import contact_center
from .placement import Placement, on_gel, pose_at
from .thickness import DEPTH_LIMIT, thickness_under

# Pa a count: the range 0 to 100 kPa (SynTouch, BioTac sensor details, 2011) over the 12 bits of PDC: assumed.
PRESSURE_PER_COUNT = 100e3 / 4096
PRESSURE_AT_REST = 1750.0  # Pa, initial pressure of the independent COMSOL model (sensors.md)
_STILL_COUNT = 2000  # TDC and TAC, not simulated: a constant reading

Pair = tuple[FastContact, FastContact]


def simulate_recording(
    scene_path: str | os.PathLike,
    out: str | os.PathLike,
    seed: int = 0,
    progress: Callable[[int, int], None] | None = None,
    wiring: Wiring | None = None,
) -> None:
    """Simulate the [recording] of a scene at 100 Hz into the HDF5 file ``out``, with its true meshes.

    The motion is linear between the scene's points; rolling and sliding differ in nothing else, for contact is without
    friction here. progress : called with (frames done, frames). wiring : in place of the scene's noise and drift.
    Raises TactileError for a scene without a recording, one that presses harder than the linear model may be asked, or
    tared wiring: this kind of file holds raw counts.
    """
    scene, text = load_scene(scene_path)
    spec = scene.recording
    if spec is None:
        raise TactileError(
            f"{scene_path}, recording", "missing", "a [recording] table", "See scenes/press_roll_slide/scene.toml"
        )
    wiring = wiring or _wiring(spec)
    if wiring.tared:
        raise TactileError("wiring, tared", "True", "raw counts in a simulated recording", "Tare it when it is read")
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
    electrodes = readings(_signals(frames), time, wiring, seed)
    pressure = _pressure(frames)
    still = np.full(len(time), _STILL_COUNT, np.int16)
    write_simulated(
        out, time=time, electrodes=electrodes, pdc=pdc_counts(pressure), tac=still, tdc=still, truth=_truth(frames),
        scene=text, seed=seed, made_by=f"tactile {__version__}, mechanics.recording",
        note=f"Simulated, not measured: {scene.description} {_told(pressure)}",
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
    biotac, digit = (_press(sensor, indenter, place).at_force(force) for sensor in ("biotac", "digit"))
    if biotac is None or digit is None:
        which = "BioTac" if biotac is None else "DIGIT"
        raise TactileError(
            f"{scene_path}, recording, {time:.2f} s", f"{force:.3g} N at ({place.x * 1e3:.1f}, {place.z * 1e3:.1f}) mm",
            f"a force that the {which} bears within 60 % of its thickness", "Lower force_n there",
        )  # fmt: skip
    return biotac, digit


def _press(sensor: str, indenter: Indenter, place: Placement) -> CorrectedPress:
    pose = pose_at(sensor, indenter, place)
    return CorrectedPress(compliance_of(sensor), indenter, pose, DEPTH_LIMIT * thickness_under(sensor, indenter, pose))


def _signals(frames: list[Pair | None]) -> np.ndarray:
    skin = biotac_compliance()
    return np.stack([np.zeros(19) if f is None else signal_of_gaps(electrode_gaps(skin, f[0].linear)) for f in frames])


def _pressure(frames: list[Pair | None]) -> np.ndarray:
    """The fluid's pressure (T,) Pa over the surrounding air."""
    rise = [0.0 if f is None else f[0].pressure for f in frames]
    return PRESSURE_AT_REST + np.array(rise)


def pdc_counts(pressure: np.ndarray) -> np.ndarray:
    """PDC (...,) int16 counts, 0..4095, for the fluid's pressure, Pa; the scale is assumed, as the range is given."""
    return np.clip(np.round(pressure / PRESSURE_PER_COUNT), 0, sensors.COUNT_MAX).astype(np.int16)


def _told(pressure: np.ndarray) -> str:
    """The fluid's pressure in words for the file."""
    low, high = pressure.min() / 1e3, pressure.max() / 1e3
    return f"Fluid pressure {low:.2f} to {high:.2f} kPa; PDC counts {PRESSURE_PER_COUNT:.2f} Pa each (assumed)."


def _wiring(spec: RecordingSpec) -> Wiring:
    """The scene's defects; its drift is given from the first to the last frame."""
    lasts = spec.points[-1].time_s - spec.points[0].time_s
    return Wiring(noise=spec.noise_counts, drift=spec.drift_counts / lasts)


def _truth(frames: list[Pair | None]) -> Truth:
    skin, gel = biotac_compliance(), digit_compliance()

    def moved(compliance: Compliance, contact: FastContact | None) -> np.ndarray:
        if contact is None:
            return np.zeros((len(compliance.surface.rest), 3), np.float32)
        return contact.corrected.displacement.astype(np.float32)

    return Truth(
        displacement_biotac=np.stack([moved(skin, f and f[0]) for f in frames]),
        displacement_digit=np.stack([moved(gel, f and f[1]) for f in frames]),
        force=np.stack([np.zeros(3) if f is None else f[0].force for f in frames]),
        contact_center=np.stack([np.full(2, np.nan) if f is None else contact_center(f[1].linear) for f in frames]),
    )
