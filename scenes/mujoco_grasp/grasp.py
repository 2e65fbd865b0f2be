"""Grasp a ball with two DIGITs in MuJoCo, and see what each of them sees: runs without a display.

    python scenes/mujoco_grasp/grasp.py --out out/mujoco_grasp      a contact sheet, an observation, the speed
    python scenes/mujoco_grasp/grasp.py --seconds 0.3 --out DIR     the first moments alone

The gripper closes, squeezes harder, lifts, and turns loose. MuJoCo's own contact force drives each gel; frames are
taken 100 times a second. Needs the extras [mujoco] and, for speed, [fast]: pip install -e ".[mujoco,fast]".
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path

os.environ.setdefault("MUJOCO_GL", "egl")  # pictures of the scene without a display

import mujoco
import numpy as np

from tactile_core.errors import TactileError
from tactile_core.files import atomic
from tactile_core.geometry.indenters import Sphere
from tactile_core.jobs.gel import Gel
from tactile_core.jobs.gel_observation import marker_nodes, observation_space, observe
from tactile_core.jobs.mujoco_gel import MujocoGel

HERE = Path(__file__).resolve().parent
RATE, SECONDS = 100, 2.4  # frames a second; of the whole grasp
SHOWN = 8  # moments on the sheet
SIDES = ("left", "right")


def main(arguments: list[str] | None = None) -> int:
    """Simulate, draw, report; the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("out/mujoco_grasp"), metavar="DIR", help="(%(default)s)")
    parser.add_argument("--seconds", type=float, default=SECONDS, help="of simulated time (%(default)s)")
    parser.add_argument("--no-speed", action="store_true", help="do not time the scene without and with one sensor")
    options = parser.parse_args(arguments)
    try:
        frames = list(run(options.seconds, SIDES, scene_pictures=True))
        options.out.mkdir(parents=True, exist_ok=True)
        atomic.write_bytes(options.out / "contact_sheet.png", sheet(frames))
    except TactileError as error:
        print(error, file=sys.stderr)
        return 2
    print(f"{len(frames)} frames of two DIGITs; {options.out / 'contact_sheet.png'}")
    if not options.no_speed:
        print(speed(options.seconds))
    return 0


def controls(seconds: float) -> dict[str, float]:
    """Return the gripper's commands after `seconds`: N of each finger, m of the lift."""
    squeeze = np.interp(seconds, [0, 0.1, 0.5, 1.0, 1.9, 2.1], [1.0, 1.0, 1.5, 3.0, 3.0, -2.0])
    return {"close_left": squeeze, "close_right": squeeze, "lift": np.interp(seconds, [1.0, 1.6], [0.0, 0.05])}


def run(seconds: float, sides: tuple[str, ...], *, scene_pictures: bool = False):  # noqa: ANN201
    """Yield a dict a frame for `seconds`: time s, by side the observation and MuJoCo's force (3,) N, and a picture."""
    model = mujoco.MjModel.from_xml_path(str(HERE / "grasp.xml"))
    data = mujoco.MjData(model)
    touches = {side: MujocoGel(model, f"gel_{side}", f"gel_{side}") for side in sides}
    view, markers, space = (_view(model) if scene_pictures else None), None, None
    each = round(1 / RATE / model.opt.timestep)
    for step in range(round(seconds / model.opt.timestep)):
        for name, value in controls(data.time).items():
            data.actuator(name).ctrl = value
        mujoco.mj_step(model, data)
        if step % each:
            continue
        frame = {"time": data.time}
        for side, touch in touches.items():
            contact = touch(data)
            frame[f"{side} MuJoCo"] = sum(touch.forces(data).values(), np.zeros(3))
            if contact is None:
                continue
            if markers is None:
                markers = marker_nodes(touch.gel)
                space = observation_space(markers)
            frame[side] = observe(touch.gel, markers)
            if not space.contains(frame[side]):
                raise TactileError("observation", f"at {data.time:.2f} s outside of its space", str(space))
            frame[f"{side} flags"] = contact.flags
        if view is not None:
            view.update_scene(data, "side")
            frame["scene"] = view.render()
        yield frame


def _view(model):  # noqa: ANN001, ANN202
    """A renderer of the scene, or None where the machine has nothing that draws without a display."""
    try:
        return mujoco.Renderer(model, 320, 240)
    except Exception as error:  # each platform's library raises its own
        print(f"no pictures of the scene itself: {error}", file=sys.stderr)
        return None


def sheet(frames: list[dict]) -> bytes:
    """PNG bytes: moments of the grasp as columns, the scene and both gels as rows, forces below."""
    import io

    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    rest = Gel("digit", Sphere(3e-3)).picture()  # nothing has touched it
    chosen = [frames[i] for i in np.linspace(0, len(frames) - 1, min(SHOWN, len(frames))).astype(int)]
    figure = Figure(figsize=(1.35 * len(chosen), 7.6), layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(4, len(chosen), height_ratios=[1, 1, 1, 1.1])
    for column, frame in enumerate(chosen):
        pictures = frame.get("scene"), *(frame.get(side, {}).get("picture", rest) for side in SIDES)
        for row, (name, picture) in enumerate(zip(("scene", "left DIGIT", "right DIGIT"), pictures, strict=True)):
            axes = figure.add_subplot(grid[row, column])
            axes.set_xticks([])
            axes.set_yticks([])
            if picture is not None:
                axes.imshow(picture)
            if column == 0:
                axes.set_ylabel(name)
            if row == 0:
                axes.set_title(f"{frame['time']:.2f} s", fontsize=9)
    axes = figure.add_subplot(grid[3, :])
    times = [frame["time"] for frame in frames]
    for side, colour in zip(SIDES, ("tab:blue", "tab:orange"), strict=True):
        force = np.array([frame.get(side, {}).get("force", np.zeros(3)) for frame in frames])
        given = np.array([frame[f"{side} MuJoCo"] for frame in frames])
        axes.plot(times, given[:, 1], ":", color=colour, label=f"{side}: normal, MuJoCo")
        axes.plot(times, force[:, 1], color=colour, label=f"{side}: normal, gel")
        axes.plot(times, force[:, 0], "--", color=colour, label=f"{side}: along the finger, gel")
        axes.plot(times, given[:, 0], "-.", color=colour, lw=0.8, label=f"{side}: along the finger, MuJoCo")
    axes.set_xlabel("time, s")
    axes.set_ylabel("force, N")
    axes.legend(fontsize=7, ncols=2)
    found = io.BytesIO()
    figure.savefig(found, dpi=110, format="png")
    return found.getvalue()


def speed(seconds: float) -> str:
    """Return steps of 1 ms a second of CPU time, in `seconds` of grasp, without sensors and with one and two."""
    rows = []
    for sides in ((), SIDES[:1], SIDES):
        began = time.process_time()
        count = sum(1 for _ in run(seconds, sides))
        took = time.process_time() - began
        rows.append(f"{len(sides)} sensors: {1000 * seconds / took:7.0f} steps a second of CPU time, {count} frames")
    return "\n".join(rows)


if __name__ == "__main__":
    sys.exit(main())
