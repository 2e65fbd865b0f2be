"""Condense the sensors' compliance matrices and write them compressed, so that users need not wait for them.

    python scripts/benchmarks/make/make_compliance.py                    a minute and 2.4 GB per sensor
    python scripts/benchmarks/make/make_compliance.py digit --out DIR

If a file is to change, first raise ``_FORMAT`` of tactile_core/mechanics/fast/compliance.py, so that no cache keeps
arrays of the old one.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

from tactile_core.files import atomic
from tactile_core.mechanics.fast import compliance
from tactile_core.mechanics.fast.compact_halves import BLOCK, PARITIES, Basis, Segment, turn
from tactile_core.mechanics.fast.condense import Half, axes_of
from tactile_core.mechanics.fast.sensing_points import electrode_feet, sensing_nodes

# Rounding step of an entry, m/N: most contacts then move by less than 0.1 um rms (random ones, docs/lean.md).
STEP = {"digit": 3e-7, "biotac": 1e-7}
LEAF = 12  # points of the smallest clusters: fewer give more levels, each a pass over the matrix (measured)
SWELL_STEPS = 2**14  # steps in the square root of the swell's work on itself: finer than single precision needs


def main(arguments: list[str] | None = None) -> int:
    """Write the files and say how large they are; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sensors", nargs="*", default=list(STEP), help="default: %(default)s")
    parser.add_argument("--out", type=Path, metavar="DIR", help="default: where they ship")
    options = parser.parse_args(arguments)
    for sensor in options.sensors:
        path = compliance.compact_file(sensor)
        path = path if options.out is None else options.out / path.name
        write(path, compliance.solid_of(sensor), *compliance.condensed(compliance.solid_of(sensor)), STEP[sensor])
        print(f"{path} ({path.stat().st_size / 1e6:.1f} MB)")
    return 0


def write(path: Path, solid: compliance.Solid, even: Half, odd: Half, step: float) -> None:
    """Pack the even and the odd half of a solid's compliance into a file; step : m/N, to which entries are rounded"""
    import h5py

    basis = basis_of(solid, even, step)
    path.parent.mkdir(parents=True, exist_ok=True)
    with atomic.new_file(path) as partial, h5py.File(partial, "w") as file:
        file.attrs.update(made_from=compliance.cache_entry(solid).name, touched=basis.touched, rows=basis.rows)
        clusters = [each for segment in basis.segments for each in segment.clusters]
        small = {
            "unknown": basis.unknown.astype(np.int32), "step": basis.step,
            "segments": np.array([(*each[:3], len(each.clusters)) for each in basis.segments]),
            "size": np.array([len(points) for points, _ in clusters], np.int32),
            "points": np.concatenate([points for points, _ in clusters]).astype(np.int32),
            "turned": np.concatenate([turned.ravel() for _, turned in clusters]).astype(np.float32),
        }  # fmt: skip
        for name, values in small.items():
            file.create_dataset(name, data=values, track_times=False, compression="gzip", shuffle=True)
        for name, half in zip(PARITIES, (even, odd), strict=True):
            packed = rounded(half, basis)
            file.create_dataset(
                name, data=packed, chunks=(BLOCK, packed.shape[1]), track_times=False, compression=9, shuffle=True
            )


def basis_of(solid: compliance.Solid, half: Half, step: float) -> Basis:
    """Order the unknowns: touched nodes, sensing points, electrode feet and fluid (in no clusters), other nodes.
    half : either half of the solid's compliance; step : m/N, to which entries are rounded"""
    rows, columns = solid.lattice.shape
    number = np.arange(len(solid.lattice.rest))
    places = np.column_stack(np.divmod(number, columns)).astype(float)
    if solid.lattice.closed:
        places[rows * columns :] = [[-1, columns / 4], [rows, columns / 4]]  # the poles
    kept, touched = compliance.kept_nodes(solid)
    loads = len(half.among)
    feet = len(electrode_feet(solid.name).gap) if loads else 0
    inner = sensing_nodes(solid.name)[compliance.kept_loads(solid)[0][feet:] - feet] if loads else touched[:0]
    rest = np.setdiff1d(np.arange(len(kept)), touched)
    groups: list = [(touched, kept[touched], 3), (rest, kept[rest], 3)]
    groups[1:1] = [
        (feet + np.arange(len(inner)), inner, 1),
        (np.r_[:feet, loads - 1 : loads] if loads else inner, None, 1),
    ]
    parts, first = [], 0
    for members, nodes, axes in groups:
        if not len(members):
            continue
        clusters, order = ([], np.arange(len(members))) if nodes is None else tree(places[nodes])
        unknown = axes_of(members[order]) if axes == 3 else members[order]
        parts.append((unknown, Segment(first, first + len(unknown), axes, clusters)))
        first += len(unknown)
    steps = np.full(first, np.sqrt(step), np.float32)
    if loads:
        steps[3 * len(touched) + loads - 1] = np.sqrt(half.among[-1, -1]) / SWELL_STEPS
    unknowns = np.concatenate([unknown for unknown, _ in parts])
    return Basis(3 * len(touched), 3 * len(touched) + loads, unknowns, steps, [segment for _, segment in parts])


def tree(places: np.ndarray) -> tuple[list[tuple[np.ndarray, np.ndarray]], np.ndarray]:
    """Cluster points at places (n, 2), row and column, as a tree. Return ``Segment.clusters`` in new numbers of points,
    and the order (n,) that gives these numbers: points that describe large clusters first."""
    clusters: list[tuple[np.ndarray, np.ndarray]] = []
    level = np.zeros(len(places), int)
    linear = np.column_stack([np.ones(len(places)), places])

    def gather(points: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
        """Return points whose motion goes on to the next cluster, their linear basis (k, 3), and the tree's height."""
        if len(points) <= LEAF:
            handed, moments, height = points, linear[points], 0
        else:
            widest = int(np.argmax(np.ptp(places[points], axis=0)))
            points = points[np.argsort(places[points, widest], kind="stable")]
            halves = gather(points[: len(points) // 2]), gather(points[len(points) // 2 :])
            handed, moments = (np.concatenate([each[i] for each in halves]) for i in (0, 1))
            height = 1 + max(each[2] for each in halves)
        turned, left = np.linalg.qr(moments, mode="complete")
        clusters.append((handed, turned.T))
        level[handed] = height
        return handed[: linear.shape[1]], left[: linear.shape[1]], height

    level[gather(np.arange(len(places)))[0]] += 1
    order = np.argsort(-level, kind="stable")
    renumbered = np.argsort(order)
    return [(renumbered[points], turned) for points, turned in clusters], order


def rounded(half: Half, basis: Basis) -> np.ndarray:
    """Return a half's upper triangle in a basis, (n, rows) uint32, in rounding steps; 0, -1, 1, -2 are 0, 1, 2, 3."""
    touched, rows, unknown = basis.touched, basis.rows, basis.unknown
    order = np.empty(touched, int)
    order[np.argsort(unknown[:touched])] = np.arange(touched)
    surface, loads = np.r_[unknown[:touched], unknown[rows:]], unknown[touched:rows]
    matrix = np.empty((rows, len(unknown)))
    on_surface = np.r_[:touched, rows : len(unknown)]
    matrix[:touched, on_surface] = half.answer[order][:, surface]
    matrix[touched:, on_surface] = half.under_loads.T[np.ix_(loads, surface)]
    matrix[:touched, touched:rows] = matrix[touched:, :touched].T
    matrix[touched:, touched:rows] = half.among[np.ix_(loads, loads)]
    turn(matrix, [segment for segment in basis.segments if segment.last <= rows])
    matrix = np.ascontiguousarray(matrix.T)
    turn(matrix, basis.segments)
    whole = np.rint(matrix / (basis.step[:, None] * basis.step[:rows])).astype(np.int64)
    whole[:rows] = np.triu(whole[:rows])
    return np.where(whole < 0, -2 * whole - 1, 2 * whole).astype(np.uint32)


if __name__ == "__main__":
    sys.exit(main())
