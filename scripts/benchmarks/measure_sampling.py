"""Measure the error that surface lattice and height map add to a solved contact: full-tier presses, between the nodes.

    python scripts/benchmarks/measure_sampling.py                       writes data/sampling.json, two minutes
    python scripts/benchmarks/measure_sampling.py --quick --json FILE   two presses, and writes rows alone

The full tier's own mesh is finer under the indenter (0.1 to 0.2 mm) than the lattice (0.35 mm) that its result is put
on. A press's error is the rms distance of its surface nodes from the height map's surface, across that (beside a punch
gel stands upright), over those in the picture that have moved by more than 10 um.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))  # `benchmarks` is no package that is installed

from benchmarks.measured_rows import finished, parser_of, printed
from tactile_core import sensors
from tactile_core.accuracy import Row, row
from tactile_core.errors import TactileError
from tactile_core.files import atomic, provenance
from tactile_core.files.shipped import shipped
from tactile_core.mechanics.placement import Placement, pose_at, thickness_under
from tactile_core.mechanics.solve import Solution, solve
from tactile_core.pictures.height_map import gel_mapper
from tactile_core.pictures.perspective import bilinear, slopes
from tactile_core.recordings import prepare, read
from tactile_core.sensors.camera import HEIGHT_ZERO_Y
from tactile_core.simulation.scene import load_scene
from tactile_core.translation import networks

ROOT = Path(__file__).resolve().parents[2]
TABLE = shipped("sampling.json")
ROUND, FLAT = ("sphere_7mm", "sphere_14mm", "long_cylinder_7mm"), ("short_cylinder_7mm", "cube_14mm")
# Of scenes/training, by depth over the gel's thickness. Half way in, flat punches take the full tier minutes each.
INDENTERS = {0.1: (*ROUND, *FLAT), 0.25: (*ROUND, *FLAT), 0.5: ROUND}
PLACES = ((-8e-3, 0.0), (-11e-3, 2.5e-3))  # m, on the DIGIT
MOVED = 10e-6  # m


def main(arguments: list[str] | None = None) -> int:
    """Measure, print and write the results."""
    parser = parser_of(__doc__)
    parser.add_argument("--quick", action="store_true", help="two presses, and leave the table as it is")
    options = parser.parse_args(arguments)
    found = measured(options.quick)
    rows = printed(as_rows(found))
    if not options.quick:
        how = "scripts/benchmarks/measure_sampling.py: heights between nodes, full-tier presses of five indenters"
        atomic.write_json(TABLE, {"how": how, "gel": sensors.TARGET, "versions": provenance.versions(), **found})
    return finished(rows, options.json)


def measured(quick: bool) -> dict:
    """Tabulate the error by bins: of depth over thickness, error of heights m; float32_m: of the translation."""
    specs = {one.name: one for one in load_scene(ROOT / "scenes" / "training")[0].indenters}
    bins = []
    for share, names in list(INDENTERS.items())[: 2 if quick else None]:
        errors = [
            error
            for number, name in enumerate(names[: 1 if quick else None])
            if (error := press_error(specs[name].build(), Placement(*PLACES[number % 2], 0.0), share)) is not None
        ]
        bins.append({
            "depth_share_to": share, "contacts": len(errors), "rms_m": float(np.median(errors)),
            "rms_95_m": float(np.quantile(errors, 0.95)),
        })  # fmt: skip
    return {"bins": bins, "float32_m": rounding()}


def press_error(indenter, place: Placement, share: float) -> float | None:  # noqa: ANN001
    """RMS error, m, of the height map between nodes; None where the full tier finds no equilibrium."""
    pose = pose_at("digit", indenter, place)
    depth = share * thickness_under("digit", indenter, pose)
    try:
        solution = solve("digit", indenter, place, depth=depth, tier="full", friction=0.0)
    except TactileError:
        return None
    error = between_nodes(solution)
    print(f"{share:.0%} of the thickness: {1e6 * error:.2f} um", file=sys.stderr, flush=True)
    return error


def between_nodes(solution: Solution) -> float:
    """RMS error, m, over the full tier's own surface nodes in the picture that have moved."""
    solid, state = solution.volume
    rest = solid.mesh.nodes[solid.mesh.surface]
    moved = rest + state.displacement[solid.mesh.surface]
    mapper = gel_mapper()
    camera = mapper.camera
    seen = mapper(solution.displacement)
    row_at = (moved[:, 0] - camera.gel_x[0]) / (camera.gel_x[1] - camera.gel_x[0])
    column_at = (moved[:, 2] - camera.gel_z[0]) / (camera.gel_z[1] - camera.gel_z[0])
    inside = (row_at > 1) & (row_at < camera.height - 2) & (column_at > 1) & (column_at < camera.width - 2)
    inside &= np.abs(moved - rest).max(axis=1) > MOVED
    at = row_at[inside].astype(np.float32), column_at[inside].astype(np.float32)
    miss = bilinear(seen, *at) - (moved[inside, 1] - HEIGHT_ZERO_Y)
    steep = 1 + sum(bilinear(slope, *at) ** 2 for slope in slopes(seen, camera))
    return float(np.sqrt(np.mean(miss**2 / steep)))


def rounding() -> float:
    """Largest difference m of the shipped recording's gel in float32 from the same networks in float64."""
    signals = prepare(read(ROOT / "scenes" / "press_roll_slide" / "press_roll_slide.h5"))
    nets = networks.load()
    change = signals.typical[60:340:10]
    gels = [one.decode_target(one.likely_latents(one.encode_signal(change))[1]) for one in (nets, Double(nets))]
    return float(np.abs(gels[0] - gels[1]).max())


class Double(networks.Networks):
    """Run the same networks in float64, all frames at once."""

    def __init__(self, nets: networks.Networks) -> None:
        super().__init__(nets.tensors, nets.card)
        self.tensors = {
            net: {name: array.astype(float) for name, array in found.items()} for net, found in nets.tensors.items()
        }

    def _blocks(self, function: networks.Pass, x: np.ndarray, shape: tuple[int, ...], name: str) -> np.ndarray:
        return function(np.asarray(x, float))


def as_rows(found: dict) -> list[Row]:
    """Make one row a bin."""
    rows = [
        row(f"sampling_height_error_{one['depth_share_to']:.0%}", 1e6 * one["rms_m"], "um",
            of=f"median of {one['contacts']} full-tier presses, 95 %: {1e6 * one['rms_95_m']:.2f} um")
        for one in found["bins"]
    ]  # fmt: skip
    nodes = len(sensors.digit_surface().rest)
    return [*rows, row("float32_error", 1e6 * found["float32_m"], "um", of=f"largest of {nodes} nodes, 28 frames")]


if __name__ == "__main__":
    sys.exit(main())
