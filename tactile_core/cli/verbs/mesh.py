"""``tactile mesh``: write the mesh of a sensor for other tools."""

from __future__ import annotations

import argparse
import os
import sys
from typing import TYPE_CHECKING

from ...errors import TactileError
from ..terminal import next_step, say, tell

if TYPE_CHECKING:
    from ...geometry.indenters import Indenter
    from ...mechanics.solve import Solution

BRIEF = "write the mesh of a sensor for other tools"
TEXT = """\
Write the mesh of a sensor in metres, x along the finger, -y out of the pad. The ending of --out chooses the format:
  .ply  surface with normals and numbers of each vertex, read by MeshLab, Blender and trimesh
  .stl  surface alone
  .vtu  volume of 27-node hexahedra, read by ParaView (Warp By Vector shows the deformation) and meshio

The sensor is at rest, deformed as in a frame of frames.h5 or of a simulated recording (--frames, surface alone), or
pressed (--press). The mesh of a press holds displacement (m) and contact. The full and reference tiers solve the
volume, and add the force on each node (N), Cauchy stress and von Mises stress (Pa). The fast tier solves the surface
alone."""
EPILOG = """\
examples:
  tactile mesh biotac --out biotac.ply
  tactile mesh digit --frames results/touch/frames.h5 --frame 120 --out frame_120.ply
  tactile mesh digit --press sphere --diameter 7 --depth-mm 0.6 --tier full --out contact.vtu
  tactile mesh biotac --press scenes/press_sphere --indenter sphere_14mm --force-n 0.5 --out contact.ply"""
MOST_TILT = 45.0  # degrees off the normal, as in scenes
TIERS = ("fast", "full", "reference")
_EDGE_MM = 0.5  # of a cylinder's rim, as in scenes


def arguments(verb: argparse.ArgumentParser) -> None:
    """Add the arguments of this verb."""
    verb.add_argument("sensor", metavar="SENSOR", help="biotac, digit, or one of your own")
    verb.add_argument("--out", required=True, metavar="FILE", help="new file to write: .ply, .stl or .vtu")
    frame = verb.add_argument_group("deformed by a frame")
    frame.add_argument("--frames", metavar="FILE.h5", help="frames.h5 of `tactile convert`, or a simulated recording")
    frame.add_argument("--frame", type=int, metavar="N", help="which frame, by its number in the recording, from 0")
    press = verb.add_argument_group("deformed by a press")
    about = "sphere or cylinder, of --diameter; or a scene, for its indenter"
    press.add_argument("--press", metavar="WHAT", help=about)
    press.add_argument("--diameter", type=float, metavar="MM", help="diameter of the sphere or cylinder")
    press.add_argument("--indenter", metavar="NAME", help="which indenter of the scene (default: its first)")
    press.add_argument("--depth-mm", type=float, metavar="MM", help="depth from first touch")
    press.add_argument("--force-n", type=float, metavar="N", help="force along the motion, instead of the depth")
    press.add_argument(
        "--x-mm",
        type=float,
        metavar="MM",
        help="place along the DIGIT's plane, onto which the BioTac rolls (default: -8, the middle)",
    )
    press.add_argument("--z-mm", type=float, metavar="MM", help="place across the finger (default: 0)")
    press.add_argument("--tilt-deg", type=float, metavar="DEG", help="angle off the normal (default: 0)")
    press.add_argument("--tier", choices=TIERS, help="solver; takes milliseconds, seconds or minutes (default: fast)")


def run(options: argparse.Namespace) -> int:
    """Write the mesh that the options name; returns the exit status."""
    _check(options)
    from ...files import atomic
    from ...mechanics import sensor_meshes
    from ...sensors import describe

    describe(options.sensor)  # raises for a name that is none
    sensor_meshes.check_suffix(options.out)
    atomic.claim(options.out)
    if options.frames:
        from ...jobs.gel_frames import frame_displacement

        moved = frame_displacement(options.frames, options.sensor, options.frame)
        sensor_meshes.write_surface(options.out, options.sensor, moved, {})
    elif options.press:
        solution = _pressed(options, _indenter(options))
        if not solution.converged:
            say("warning: the contact did not converge; the file holds the last state")
        sensor_meshes.write_solution(options.out, options.sensor, solution)
    else:
        sensor_meshes.write_rest(options.out, options.sensor)
    tell(options.out)
    volume = os.path.splitext(options.out)[1].lower() == ".vtu"
    next_step(f"open {options.out} in {'ParaView' if volume else 'MeshLab or Blender'}; lengths are in metres")
    return 0


def _check(options: argparse.Namespace) -> None:
    """Raise TactileError for options that do not fit together, before any work."""
    if options.frames and options.press:
        raise TactileError("--press", "given with --frames", "one of the two")
    if (options.frames is None) != (options.frame is None):
        raise TactileError("--frames and --frame", "one of them alone", "both", "Say which frame of which file")
    of_press = "diameter", "indenter", "depth_mm", "force_n", "x_mm", "z_mm", "tilt_deg", "tier"
    given = [name for name in of_press if getattr(options, name) is not None]
    if given and not options.press:
        raise TactileError("--" + given[0].replace("_", "-"), "given without --press", "--press WHAT")
    if options.tilt_deg is not None and not abs(options.tilt_deg) <= MOST_TILT:  # nan, too
        raise TactileError("--tilt-deg", f"{options.tilt_deg:g}", f"-{MOST_TILT:g} to {MOST_TILT:g}, as in scenes")
    if options.press and (options.depth_mm is None) == (options.force_n is None):
        advice = "Say how far or how hard"
        raise TactileError("--press", "both or none of --depth-mm and --force-n", "one of them", advice)


def _indenter(options: argparse.Namespace) -> Indenter:
    from ...geometry.indenters import Cylinder, Sphere

    if options.press not in ("sphere", "cylinder"):
        return _of_scene(options)
    if options.diameter is None or options.indenter is not None:
        found = "no --diameter" if options.diameter is None else "--indenter, which names one of a scene"
        raise TactileError(f"--press {options.press}", found, "--diameter MM")
    radius = options.diameter / 2 * 1e-3
    return Sphere(radius) if options.press == "sphere" else Cylinder(radius, min(_EDGE_MM * 1e-3, radius / 2))


def _of_scene(options: argparse.Namespace) -> Indenter:
    from ...geometry.indenters.mesh_file import SUFFIXES
    from ...simulation.scene import load_scene

    if options.diameter is not None:
        raise TactileError("--diameter", "given with a scene", "--press sphere or --press cylinder")
    if not os.path.exists(options.press):
        raise TactileError("--press", repr(options.press), "sphere, cylinder, or a scene file that exists")
    if os.path.splitext(options.press)[1].lower() in SUFFIXES:
        advice = 'Write a scene with kind = "mesh", as `tactile scenes copy user_mesh` has one'
        raise TactileError(options.press, "a mesh file", "sphere, cylinder, or a scene", advice)
    specs = {spec.name: spec for spec in load_scene(options.press)[0].indenters}
    name = next(iter(specs)) if options.indenter is None else options.indenter
    if name not in specs:
        raise TactileError("--indenter", repr(name), f"one of {', '.join(specs)}")
    return specs[name].build()


def _pressed(options: argparse.Namespace, indenter: Indenter) -> Solution:
    import math

    from ...mechanics.placement import Placement
    from ...mechanics.solve import solve

    x_mm = -8.0 if options.x_mm is None else options.x_mm  # the middle
    place = Placement(x_mm * 1e-3, (options.z_mm or 0.0) * 1e-3, math.radians(options.tilt_deg or 0.0))
    depth = None if options.depth_mm is None else options.depth_mm * 1e-3
    tier = options.tier or "fast"
    if tier != "fast" and sys.stderr.isatty():
        say(f"solving the volume ({'minutes' if tier == 'reference' else 'seconds'})")
    return solve(options.sensor, indenter, place, depth=depth, force=options.force_n, tier=tier)
