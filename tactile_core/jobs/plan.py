"""Predict, from measured tables, what a scene or a recording will build and at what cost, before it is run.

A plan is rows: what is built, by which verb, how much of it, and its expected time, memory and disk. Times are of one
thread of the machine that the tables were measured on.
"""

from __future__ import annotations

import dataclasses
import functools
import importlib.util
import json
import os
from collections.abc import Collection
from pathlib import Path
from typing import Any

from ..errors import TactileError
from ..files.shipped import shipped
from ..sensors import PAIR, title
from ..translation import network_sizes
from . import results
from .error_budget import Budget

COSTS = shipped("costs.json")
TIERS = shipped("mechanics_tiers.json")
OF_SCENE = ("electrodes", "displacement_biotac", "displacement_digit", "translation", "image")
OF_RECORDING = results.KEEPABLE
# Once, where matrices are not cached: CPU time measured on one core (AMD EPYC with AVX-512), memory as
# ``compliance.build`` asks for, and the size of the files.
BUILD_S, BUILD_MB, MATRICES_MB = {"biotac": 42.0, "digit": 18.0}, 2200.0, {"biotac": 342.0, "digit": 151.0}

NETWORKS = "signals to skin to gel; force, pressure, expected error"  # what a translation runs, in words
TRACTION_MS, TRACTION_KB = 1.5, 0.7  # a frame of the shipped recording, measured on one core
# Of memory more than the fast tier's, peak of the process (measured: scenes/press on the DIGIT, 147 contacts).
TIER_MB = {"fast": 0.0, "full": 650.0, "reference": 3100.0}


@dataclasses.dataclass(frozen=True)
class Part:
    """Output that is built, with its cost.

    verb : command that builds it; extent : how much of it, in words; seconds; memory, disk : MB it adds
    building : MB taken meanwhile, and given back
    """

    what: str
    verb: str
    extent: str
    seconds: float = 0.0
    memory: float = 0.0
    disk: float = 0.0
    building: float = 0.0


@dataclasses.dataclass(frozen=True)
class Plan:
    """Plan of a job: parts in the order they are built; left_out : parts that no requested output needs."""

    of: str
    parts: tuple[Part, ...]
    left_out: tuple[str, ...]

    @property
    def seconds(self) -> float:
        """Time of all parts together, s."""
        return sum(part.seconds for part in self.parts)

    @property
    def memory(self) -> float:
        """Memory, MB, of the hungriest verb: verbs run one after another, and matrices are built so, too."""
        verbs = {part.verb: [one for one in self.parts if one.verb == part.verb] for part in self.parts}
        return max(sum(p.memory for p in parts) + max(p.building for p in parts) for parts in verbs.values())

    @property
    def disk(self) -> float:
        """Size on disk, MB, of all parts together."""
        return sum(part.disk for part in self.parts)

    def as_json(self) -> dict[str, Any]:
        """Return the whole plan, fit for JSON."""
        whole = {"of": self.of, "parts": [dataclasses.asdict(part) for part in self.parts]}
        totals = {"seconds": self.seconds, "memory_mb": self.memory, "disk_mb": self.disk}
        return whole | {"left_out": list(self.left_out)} | {key: round(value, 3) for key, value in totals.items()}

    def lines(self) -> list[str]:
        """Return the whole plan as lines of text."""
        found = [self.of, f"{'verb':9}{'what':22}{'s':>9}{'MB':>7}{'disk MB':>9}  of"]
        for part in self.parts:
            numbers = f"{part.seconds:9.2f}{part.memory or part.building:7.0f}{part.disk:9.1f}"
            found.append(f"{part.verb:9}{part.what:22}{numbers}  {part.extent}")
        found.append(f"in all about {self.seconds:.3g} s, {self.memory:.0f} MB of memory, {self.disk:.3g} MB on disk")
        return [*found, f"not built: {', '.join(self.left_out) or 'nothing'}"]


@functools.cache
def costs() -> dict[str, Any]:
    """Read the results of ``scripts/benchmarks/measure_costs.py``."""
    return json.loads(COSTS.read_text(encoding="utf-8"))


def plan(path: str | os.PathLike, keep: str | None, budget: Budget, preset: str | None) -> Plan:
    """Plan a scene (a folder or a .toml) or a recording.

    keep : its outputs as text; None for all that a scene can have, and for what `tactile convert` keeps by itself

    Raises TactileError for what cannot be read, another word, or a bound that nothing meets.
    """
    path = Path(path)
    if path.is_dir() or path.suffix == ".toml":
        return of_scene(path, results.parse_words(keep, OF_SCENE), budget, preset)
    usual = ",".join(results.DEFAULT_KEEP)
    return of_recording(path, results.parse_words(usual if keep is None else keep, OF_RECORDING), budget, preset)


def of_scene(path: Path, keep: Collection[str], budget: Budget, preset: str | None) -> Plan:
    """Plan `tactile simulate`, then `tactile convert` for a translation and `tactile render` for pictures."""
    from ..simulation import scene_recording, tier_choice
    from ..simulation.scene import load_scene

    scene, _ = load_scene(path)
    spec = scene_recording.recording_of(scene, path)
    time, place, force = scene_recording.motion(spec)
    frames, pressed = len(time), int((force > 0).sum())
    contacts = len({(*at, newtons) for at, newtons in zip(place.tolist(), force.tolist(), strict=True) if newtons > 0})
    needed = set(keep) & set(scene_recording.outputs())
    needed |= {"electrodes"} if "translation" in keep else set()
    needed |= {"displacement_digit"} if "image" in keep else set()
    used = scene_recording.sensors_of(needed)
    choices = tier_choice.choose_for_scene(path, used, budget.um)
    start, extent = _part("simulate_nothing"), f"{frames} frames, {pressed} in contact; indenter {spec.indenter}"
    parts = [Part("start", "simulate", extent, start["start"], start["mb"])]
    for sensor in used:
        kept = pressed if f"displacement_{sensor}" in needed else 0
        parts += [*_matrices(sensor), _contacts(sensor, choices[sensor], contacts, spec.friction > 0, kept)]
    if "electrodes" in needed:
        disk = _part("simulate_electrodes")["kb"] * frames / 1e3
        parts.append(Part("electrodes", "simulate", "19, from the film over each; noise and drift", disk=disk))
    parts += _translation(frames, "latent", "convert") if "translation" in keep else []
    parts += _rendered(frames, budget, preset) if "image" in keep else []
    left = [f"{title(sensor)} and its matrices" for sensor in PAIR if sensor not in used]
    left += [] if "translation" in keep else ["networks"]
    left += [] if "image" in keep else ["height maps, LEDs and pictures"]
    return Plan(f"scene {scene.name}: {', '.join(keep)}", tuple(parts), tuple(left))


def of_recording(path: Path, keep: Collection[str], budget: Budget, preset: str | None) -> Plan:
    """Plan `tactile convert --keep`."""
    from .. import recordings
    from ..recordings.readers import each_finger

    frames = sum(len(recordings.read(finger)) for finger in each_finger(path))
    whole = _translation(frames, "displacement" if "displacement" in keep else "latent", "convert")
    if "height" in keep:
        whole.append(_each("height maps", "convert", "240 x 320, packed", frames, "convert_height", "convert_latent"))
    if "image" in keep:
        name = _preset(budget, preset or "fast")
        extra = _preset_ms(name) - _preset_ms("fast")
        drawn = _each("pictures", "convert", _lit(name), frames, "convert_image", "convert_latent")
        whole.append(dataclasses.replace(drawn, seconds=drawn.seconds + extra * frames / 1e3))
    if "traction" in keep:
        extent = f"{frames} frames, 2,867 nodes, packed"
        pressed = Part("force field", "convert", extent, TRACTION_MS * frames / 1e3, disk=TRACTION_KB * frames / 1e3)
        whole += [*(dataclasses.replace(part, verb="convert") for part in _matrices("digit")), pressed]
    left = [] if {"height", "image"} & set(keep) else ["height maps and pictures but those of the contact sheet"]
    left += [] if "traction" in keep else ["contact mechanics"]
    return Plan(f"recording {path.name}: {', '.join(keep)}", tuple(whole), tuple(left))


def _part(name: str) -> dict[str, float]:
    return costs()["parts"][name]


def _each(what: str, verb: str, extent: str, frames: int, name: str, beside: str) -> Part:
    """Return the cost of one output a frame beyond the work that is done in any case."""
    own, other = _part(name), _part(beside)
    seconds, disk = (max(own[key] - other[key], 0) * frames / 1e3 for key in ("ms", "kb"))
    return Part(what, verb, extent, seconds, max(own["mb"] - other["mb"], 0), disk)


def _matrices(sensor: str) -> list[Part]:
    """Return the surface compliance as a part of the plan, with the cost of building it where it is not cached."""
    from ..mechanics.fast.compliance import stored

    found = stored(sensor)
    nodes = f"{found.surface} surface nodes, {found.touchable} of them touchable; solid of {found.volume} nodes"
    if found.bytes:
        return [Part(f"{title(sensor)} matrices", "simulate", f"{found.bytes / 1e6:.0f} MB, cached; {nodes}")]
    extent = f"to be built once in {found.folder}; {nodes}"
    what = f"{title(sensor)} matrices"
    return [Part(what, "simulate", extent, BUILD_S[sensor], disk=MATRICES_MB[sensor], building=BUILD_MB)]


def _contacts(sensor: str, choice: Any, contacts: int, rough: bool, kept: int) -> Part:
    """The solves of one sensor, in its tier: of contacts that differ, of which so many frames are kept.

    rough : with friction, which takes the full tier several times as long
    """
    part, start = _part(f"simulate_{sensor}"), _part("simulate_nothing")
    ms = part["ms"]
    if choice.tier != "fast":
        tiers = json.loads(TIERS.read_text(encoding="utf-8"))["tiers"]
        full = costs()["full_ms"][sensor]["rough" if rough else "smooth"]
        ms += full * tiers[choice.tier][sensor]["ms"] / tiers["full"][sensor]["ms"]
    once = max(part["start"] - start["start"], 0)
    extent = f"{contacts} different contacts; {choice.describe(sensor)}"
    disk = part["kb"] * kept / 1e3
    seconds, memory = once + ms * contacts / 1e3, max(part["mb"] - start["mb"], 0) + TIER_MB[choice.tier]
    return Part(f"{title(sensor)} contacts", "simulate", extent, seconds, memory, disk)


def _translation(frames: int, keep: str, verb: str) -> list[Part]:
    part = _part(f"convert_{keep}")
    extent = f"{frames} frames; {NETWORKS}; surfaces {' and '.join(network_sizes.SURFACES)}; contact sheet"
    seconds = part["start"] + part["ms"] * frames / 1e3
    return [Part("networks", verb, extent, seconds, part["mb"], part["kb"] * frames / 1e3)]


def _rendered(frames: int, budget: Budget, preset: str | None) -> list[Part]:
    """Height maps and pictures by `tactile render`."""
    from ..pictures.presets import DEFAULT

    name = _preset(budget, preset or DEFAULT)
    part = _part("render_fast")
    seconds = part["start"] + (part["ms"] + _preset_ms(name) - _preset_ms("fast")) * frames / 1e3
    return [Part("pictures", "render", f"{frames}; {_lit(name)}", seconds, part["mb"], part["kb"] * frames / 1e3)]


def _preset(budget: Budget, preset: str) -> str:
    from ..pictures.mitsuba.variant import fitting
    from ..pictures.presets import NAMES as PRESET_NAMES

    if preset not in PRESET_NAMES:
        raise TactileError("--preset", repr(preset), f"one of {', '.join(PRESET_NAMES)}")
    return preset if budget.levels is None else fitting(budget.levels)


def _preset_ms(name: str) -> float:
    """Time of a picture, ms, by the variant that runs here where it was measured."""
    from ..pictures.presets import measured

    ms = measured()["presets"][name]["ms"]
    return ms.get(_variant(name) or "numpy", max(ms.values()))


def _variant(preset: str) -> str:
    """Variant of Mitsuba that runs here; "" where none is needed or present. Mitsuba itself is not loaded."""
    from ..pictures.mitsuba.variant import LLVM, SCALAR, llvm_trouble

    if preset == "fast" or importlib.util.find_spec("mitsuba") is None:
        return ""
    return SCALAR if llvm_trouble(os.environ.get("DRJIT_LIBLLVM_PATH", "")) else LLVM


def _lit(name: str) -> str:
    from ..pictures.presets import measured

    found = measured()["presets"][name]
    needs = "numpy alone" if name == "fast" else f"Mitsuba, {_variant(name) or 'which is missing here'}"
    return f"3 LEDs, preset {name}: {found['says']}; {found['error']:.2g} levels; {needs}; PNG by Huffman coding"
