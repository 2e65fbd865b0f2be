"""``tactile simulate``: simulate the recording of a scene."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

from ...errors import TactileError
from ..terminal import agree, bar, duration, next_step, say, tell
from . import engine
from .common import add, check_seed

if TYPE_CHECKING:
    from ...jobs.plan import Plan
    from ...mechanics.solution import Tier
    from ...simulation.tier_choice import TierChoice

BRIEF = "simulate the recording that a scene describes"
TEXT = """\
Simulate the recording that a scene describes. The file is marked as simulated and holds the true meshes. Only sensors
that --keep needs are solved: electrodes, displacement_biotac and traction_biotac need the BioTac, the others the DIGIT.

--error 50um picks for each sensor the cheapest tier of contact mechanics (default: fast) whose measured error is at
most 50 um, and prints the tier. The error is the rms of the surface that 95 of 100 contacts stay below, to the depth
that the scene reaches. The full and reference tiers print their cost first; for more than a minute they ask, or
need --yes.

--grid simulates many recordings into a folder, with grid.json, which lists the values of each. Recordings wait in
OUT.parts until all are there, and the same command continues after any interruption."""
EPILOG = """\
examples:
  tactile simulate scenes/press_roll_slide/scene.toml --seed 1 --out press_roll_slide.h5
  tactile simulate scenes/press --keep electrodes --out press.h5          the BioTac alone
  tactile simulate scenes/press --error 50um --out press.h5
  tactile simulate scenes/press --out press.h5 --plan                     what it would build and cost; nothing is run
  tactile simulate scenes/press_roll_slide --grid force_n=0.2:1:5 --grid recording.tilt_deg=0,10 --out many"""


def arguments(verb: argparse.ArgumentParser) -> None:
    """Add the arguments of this verb."""
    verb.add_argument("scene", metavar="SCENE", help="scene.toml with a [recording]")
    add(verb, "--seed", same="file")
    verb.add_argument("--out", required=True, metavar="FILE", help="HDF5 file to write")
    verb.add_argument(
        "--keep",
        metavar="WORDS",
        help="what to store, joined by commas: electrodes; displacement_S, m, of a sensor S such as biotac or digit;"
        " traction_S, Pa on each surface node (fast tier alone); traction, short for traction_biotac,traction_digit"
        " (default: electrodes,displacement_biotac,displacement_digit)",
    )
    add(verb, "--error", bound="um of the surface, such as 50um")
    about = "begin at once, however long the tier that --error picks will take"
    verb.add_argument("--yes", action="store_true", help=about)
    verb.add_argument(
        "--grid",
        action="append",
        metavar="NAME=A:B:N",
        help="simulate a recording for each of N values from A to B, or for V,V,...; repeat it for all combinations."
        " NAME is force_n (the greatest force), x_mm, z_mm (where that is), or a field of the scene such as"
        " recording.tilt_deg or indenters.0.radius_mm. --out is then a folder; the first recording has --seed, the"
        " next --seed + 1, and so on",
    )
    about = "print what is built and its cost, and stop; with --grid print no cost, write the job into OUT.parts"
    engine.parts_arguments(verb, about)
    add(verb, "--progress")


def run(options: argparse.Namespace) -> int:
    """Simulate the scene; returns the exit status."""
    check_seed(options.seed)
    keep = _keep(options.keep)
    if options.grid:
        return _run_grid(options, keep)
    for name in ("workers", "cluster", "insecure"):
        if getattr(options, name):
            raise TactileError(f"--{name}", "given without --grid", "--grid NAME=A:B:N", "One recording is one task")
    if options.plan:
        tell("\n".join(_planned(options, keep)[1].lines()))
        return 0
    with bar("simulate", "frame", options.progress) as shown:
        from ...simulation.scene_recording import simulate_recording

        tiers = {} if options.error is None else _tiers(options, keep)
        pressing = simulate_recording(options.scene, options.out, options.seed, shown, keep=keep, tiers=tiers)
    if not pressing:
        say(f"{options.scene}: no frame presses: raise force_n, or hold it for 0.01 s and more")
    tell(options.out)
    if "electrodes" in keep:
        next_step(f"tactile convert {quote(options.out)} --out results")
    return 0


def _keep(text: str | None) -> tuple[str, ...]:
    """Parse --keep: return names of ``scene_recording.outputs``; ``traction`` stands for both sensors'. Raises
    TactileError for other words."""
    from ...jobs import results
    from ...sensors import PAIR
    from ...simulation.scene_recording import DEFAULT, outputs

    if text is None:
        return DEFAULT
    known = outputs()
    words = set(results.parse_words(text, (*known, "traction")))
    if "traction" in words:
        words |= {f"traction_{sensor}" for sensor in PAIR}
    return tuple(word for word in known if word in words)


def _planned(options: argparse.Namespace, keep: tuple[str, ...]) -> tuple[Mapping[str, TierChoice], Plan]:
    """Return the cheapest tier for each sensor within the bound of --error (without it the fast one), and the plan."""
    from ...jobs.error_budget import parse_budget
    from ...jobs.plan import of_scene
    from ...simulation.scene_recording import sensors_of
    from ...simulation.tier_choice import choose_for_scene

    bound = options.error and parse_budget(options.error).only("um", "Pictures are drawn by `tactile render`")
    choices = choose_for_scene(options.scene, sensors_of(keep), bound)
    return choices, of_scene(options.scene, keep, choices)


def _tiers(options: argparse.Namespace, keep: tuple[str, ...]) -> dict[str, Tier]:
    """Return the tier of each sensor, and say why. Raises TactileError for a long simulation without consent."""
    choices, cost = _planned(options, keep)
    for sensor, choice in choices.items():
        say(choice.describe(sensor))
    if any(choice.tier != "fast" for choice in choices.values()):
        agree(f"about {duration(cost.seconds)} and {cost.memory:.0f} MB of memory", cost.seconds, options.yes)
    return {sensor: choice.tier for sensor, choice in choices.items()}


def _run_grid(options: argparse.Namespace, keep: tuple[str, ...]) -> int:
    """Simulate every scene of a grid; returns the exit status."""
    engine.check_place(options, "workers")
    if options.error:
        raise TactileError("--grid", "given with --error", "one of the two")
    from ...jobs import simulate

    job = simulate.plan(options.scene, options.grid, options.out, options.seed, keep)
    if options.plan:
        return engine.plan_parts(options.out, job)
    with bar("simulate", "task", options.progress) as shown:
        simulate.simulate_grid(job, options.out, shown, engine.place_of(options))
    tell(options.out)
    next_step(f"{Path(options.out) / 'grid.json'} lists the values of each recording")
    return 0
