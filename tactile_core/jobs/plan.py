"""Estimate what a command builds and costs before it runs, from measured tables. Times are of one thread of the machine
that the tables were measured on (``scripts/benchmarks/measure_costs.py``)."""

from __future__ import annotations

import functools
import json
import os
from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from ..files.shipped import shipped
from ..sensors import PAIR, SOURCE, TARGET, title

if TYPE_CHECKING:
    from ..simulation.tier_choice import TierChoice

COSTS = shipped("costs.json")
# Once, where matrices are not cached but unpacked: CPU time and memory measured on one busy core, and the size of the
# files.
BUILD_S, BUILD_MB, MATRICES_MB = {SOURCE: 8.2, TARGET: 4.9}, 700.0, {SOURCE: 342.0, TARGET: 151.0}
TRACTION_MS, TRACTION_KB = 1.5, 0.7  # a frame of the shipped recording, measured on one core
SOLVED_MS = 24.0  # a contact that is solved on the DIGIT (docs/convert.md)
# Of memory more than the fast tier's, peak of the process (measured: scenes/press on the DIGIT, 147 contacts).
TIER_MB = {"fast": 0.0, "full": 650.0, "reference": 3100.0}


class Part(NamedTuple):
    """Cost of a part of a command's output: what it is, its extent in words, CPU s, MB of memory and of disk, and
    whether these were measured."""

    what: str
    extent: str
    seconds: float = 0.0
    memory: float = 0.0
    disk: float = 0.0
    measured: bool = True


class Plan(NamedTuple):
    """Cost of a command, part by part. Memory to build matrices counts once, as they are built one by one."""

    parts: Sequence[Part]

    @property
    def seconds(self) -> float:
        """Return the CPU time of all parts together, s."""
        return sum(part.seconds for part in self.parts)

    @property
    def memory(self) -> float:
        """Return the peak memory, MB: the sum of what the parts add, that to build matrices once."""
        built = [part.memory for part in self.parts if part.memory == BUILD_MB]
        return sum(part.memory for part in self.parts) - sum(built[1:])

    def lines(self) -> list[str]:
        """Return a table of the parts, and a line of totals, as lines of text."""
        found = [f"{'what':22}{'s':>9}{'MB':>7}{'disk MB':>9}  of"]
        found += [f"{what:22}{s:9.2f}{mb:7.0f}{disk:9.1f}  {extent}" for what, extent, s, mb, disk, _ in self.parts]
        disk = sum(part.disk for part in self.parts)
        more = "" if all(part.measured for part in self.parts) else ", and what was not measured"
        total = f"{self.seconds:.3g} s, {self.memory:.0f} MB of memory, {disk:.3g} MB on disk"
        return [*found, f"in all about {total}{more}"]


@functools.cache
def costs() -> dict[str, Any]:
    """Return the shipped costs.json: ``parts``, name -> ms and kb a frame, mb, start s; full_ms by sensor; machine."""
    return json.loads(COSTS.read_text(encoding="utf-8"))


def of_scene(path: str | os.PathLike, keep: Collection[str], choices: Mapping[str, TierChoice]) -> Plan:
    """Return the cost of `tactile simulate`. keep : words of its --keep; choices : sensor -> tier of mechanics
    Raises TactileError for a scene that cannot be read."""
    from ..simulation import scene_recording
    from ..simulation.scene import load_scene

    spec = scene_recording.recording_of(load_scene(path)[0], path)
    time, place, force = scene_recording.motion(spec)
    frames, pressed = len(time), int((force > 0).sum())
    contacts = len({(*at, newtons) for at, newtons in zip(place.tolist(), force.tolist(), strict=True) if newtons > 0})
    start, extent = _part("simulate_nothing"), f"{frames} frames, {pressed} in contact; indenter {spec.indenter}"
    parts = [Part("start", extent, start["start"], start["mb"])]
    for sensor, choice in choices.items():
        kept = pressed if f"displacement_{sensor}" in keep else 0
        parts += [_matrices(sensor), _contacts(sensor, choice, contacts, spec.friction > 0, kept)]
    if "electrodes" in keep:
        disk = _part("simulate_electrodes")["kb"] * frames / 1e3
        parts.append(Part("electrodes", "from the film over each; noise and drift", disk=disk))
    return Plan(parts)


def of_pairs(count: int, pair: Sequence[str] = PAIR) -> Plan:
    """Return the cost of `tactile pairs`, `count` in the fast tier; a sensor whose cost was not measured counts 0."""
    parts = []
    for sensor in pair:
        what = f"{title(sensor)} contacts"
        if sensor not in BUILD_S:
            parts.append(Part(what, f"{count}, cost not measured", measured=False))
            continue
        cost = _part(f"simulate_{sensor}")
        contacts = Part(what, str(count), cost["ms"] * count / 1e3, cost["mb"], cost["kb"] * count / 1e3)
        parts += [_matrices(sensor), contacts]
    return Plan(parts)


def of_frames(
    frames: int, keep: Collection[str], preset: str = "fast", *, solved: bool = False, target: str = TARGET
) -> Plan:
    """Return the cost of converting a number of frames.
    keep : words of --keep; preset : name of the pictures' preset; solved : true if the gel is solved
    target : name of the gel; one whose cost was not measured counts 0"""
    cost, other = _part("convert_displacement" if "displacement" in keep else "convert_latent"), _part("convert_latent")
    seconds, disk = cost["start"] + cost["ms"] * frames / 1e3, cost["kb"] * frames / 1e3
    parts = [Part("networks", f"{frames} frames", seconds, cost["mb"], disk)]
    extra = _preset_ms(preset) - _preset_ms("fast")
    for word, what, ms in (("height", "height maps", 0.0), ("image", f"pictures, {preset}", extra)):
        if word in keep:  # beyond the work that is done in any case
            beyond = {key: max(_part(f"convert_{word}")[key] - other[key], 0) for key in ("ms", "mb", "kb")}
            seconds, disk = (beyond["ms"] + ms) * frames / 1e3, beyond["kb"] * frames / 1e3
            parts.append(Part(what, f"{frames} frames", seconds, beyond["mb"], disk))
    if target not in BUILD_S:
        return Plan([*parts, Part(f"{title(target)} gel", f"{frames} frames, cost not measured", measured=False)])
    if solved or "traction" in keep:
        parts.append(_matrices(target))
    if solved:
        parts.append(Part("gel, solved", f"{frames} frames, if all are in contact", SOLVED_MS * frames / 1e3))
    if "traction" in keep:
        seconds, disk = TRACTION_MS * frames / 1e3, TRACTION_KB * frames / 1e3
        parts.append(Part("force field", f"{frames} frames", seconds, disk=disk))
    return Plan(parts)


def _part(name: str) -> dict[str, float]:
    return costs()["parts"][name]


def _matrices(sensor: str) -> Part:
    """Return the cost of a sensor's surface compliance: memory, and the building if it is not cached."""
    from ..mechanics.fast.compliance import stored

    found, what = stored(sensor), f"{title(sensor)} matrices"
    nodes = f"{found.surface} surface nodes, {found.touchable} of them touchable; solid of {found.volume} nodes"
    if found.bytes:
        return Part(what, f"{found.bytes / 1e6:.0f} MB, cached; {nodes}")
    extent = f"to be unpacked once in {found.folder}; {nodes}"
    return Part(what, extent, BUILD_S[sensor], BUILD_MB, MATRICES_MB[sensor])


def _contacts(sensor: str, choice: TierChoice, contacts: int, rough: bool, kept: int) -> Part:
    """Return the cost of a sensor's solves. kept : number of frames kept; rough : true with friction"""
    part, start = _part(f"simulate_{sensor}"), _part("simulate_nothing")
    ms = part["ms"]
    if choice.tier != "fast":
        from ..mechanics.error_estimate import measured

        tiers = measured()["tiers"]
        full = costs()["full_ms"][sensor]["rough" if rough else "smooth"]
        ms += full * tiers[choice.tier][sensor]["ms"] / tiers["full"][sensor]["ms"]
    seconds = max(part["start"] - start["start"], 0) + ms * contacts / 1e3
    memory = max(part["mb"] - start["mb"], 0) + TIER_MB[choice.tier]
    extent = f"{contacts} different contacts; {choice.describe(sensor)}"
    return Part(f"{title(sensor)} contacts", extent, seconds, memory, part["kb"] * kept / 1e3)


def _preset_ms(name: str) -> float:
    """Return a preset's time per picture, ms, in the slowest of the measured variants of Mitsuba."""
    from ..pictures.presets import measured

    return max(measured()["presets"][name]["ms"].values())
