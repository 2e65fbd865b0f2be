"""Compressed storage of a condensed solid: the matrices of its two halves in a wavelet basis, quantised.

Points form a tree of clusters. Each cluster transforms the motions of its points into a few combinations, constant or
linear over it, which go on to the next larger cluster, and details, which forces far away hardly move (B. Alpert,
SIAM J. Math. Anal. 24, 1993, 246-262). Nearly all entries between details therefore round to zero and compress well.
"""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from .condense import Half, mirror_upper

if TYPE_CHECKING:
    import h5py

PARITIES = ("even", "odd")
BLOCK = 64  # rows at a time, those of one chunk of the file
TILE = 256  # rows and columns transposed at a time: they fit in a processor's cache, which is seven times as quick


class Segment(NamedTuple):
    """Unknowns ``first`` to ``last`` - 1 of a matrix, ``axes`` of them per point, side by side; and clusters of points.
    clusters : each one's points (k,) and the transform (k, k) of their motions; parts come before wholes"""

    first: int
    last: int
    axes: int
    clusters: list[tuple[np.ndarray, np.ndarray]]


class Basis(NamedTuple):
    """Unknowns of one half's matrix: first the touched nodes' axes, then loads, then the other nodes' axes.
    touched : number of the axes of touched nodes; rows : number of these and the loads
    unknown : (n,) int, for each unknown its axis 3 i + k of the i-th kept node, or its load's number
    step : (n,) float32; the quantisation step of an entry is the product of its row's and its column's
    segments : stretches of unknowns that are transformed together"""

    touched: int
    rows: int
    unknown: np.ndarray
    step: np.ndarray
    segments: list[Segment]


def turn(values: np.ndarray, segments: list[Segment], *, back: bool = False) -> None:
    """Transform rows of values (n, c) in ``segments`` to the wavelet basis or, with ``back``, out of it, in place."""
    for first, last, axes, clusters in segments:
        of_points = values[first:last].reshape((last - first) // axes, -1)
        for points, turned in reversed(clusters) if back else clusters:
            of_points[points] = (turned.T if back else turned) @ of_points[points]


def unpack(path: Path, made_from: str) -> tuple[Half, Half] | None:
    """Read the even and the odd half from a shipped file; return None if there is no file, or it is of another solid.
    made_from : name of the solid's cache entry (``compliance.cache_entry``), which the file states"""
    if not path.is_file():
        return None
    import h5py

    with h5py.File(path) as file:
        if file.attrs["made_from"] != made_from:
            return None
        basis = _read_basis(file)
        even, odd = (_half(basis, _matrix(file[parity], basis)) for parity in PARITIES)
    return even, odd


def _read_basis(file: h5py.File) -> Basis:
    touched, rows = file.attrs["touched"], file.attrs["rows"]
    size, points, turned = file["size"][()], file["points"][()], file["turned"][()]
    segments, cluster, point, entry = [], 0, 0, 0
    for first, last, axes, count in file["segments"][()]:
        clusters = []
        for k in size[cluster : cluster + count]:
            clusters.append((points[point : point + k], turned[entry : entry + k * k].reshape(k, k)))
            point, entry = point + k, entry + k * k
        segments.append(Segment(first, last, axes, clusters))
        cluster += count
    return Basis(touched, rows, file["unknown"][()], file["step"][()], segments)


def _matrix(packed: h5py.Dataset, basis: Basis) -> np.ndarray:
    """Return a half's matrix (rows, n) float32 from its quantised form (n, rows), symmetric part: upper triangle."""
    rows, step = basis.rows, basis.step
    turned = np.empty(packed.shape, np.float32)
    for start in range(0, len(turned), BLOCK):
        part = slice(start, start + BLOCK)
        whole = packed[part]
        signed = (whole >> 1).astype(np.int32) ^ -(whole & 1).astype(np.int32)  # 0, -1, 1, -2: small numbers first
        np.multiply(signed, step[part, None] * step[:rows], out=turned[part], casting="same_kind")
    mirror_upper(turned[:rows])
    turn(turned, basis.segments, back=True)
    matrix = np.empty(turned.shape[::-1], np.float32)
    for row, column in itertools.product(range(0, rows, TILE), range(0, len(turned), TILE)):
        to_row, to_column = slice(row, row + TILE), slice(column, column + TILE)
        matrix[to_row, to_column] = turned[to_column, to_row].T
    turn(matrix, [segment for segment in basis.segments if segment.last <= rows], back=True)
    return matrix


def _half(basis: Basis, matrix: np.ndarray) -> Half:
    """Return the half whose matrix (rows, n) is in the basis's order of unknowns; its parts are in node order."""
    touched, rows, unknown = basis.touched, basis.rows, basis.unknown
    surface = np.r_[:touched, rows : len(unknown)]
    columns = surface[np.argsort(unknown[surface])]
    loads = touched + np.argsort(unknown[touched:rows])
    answer = np.empty((touched, len(columns)), np.float32)
    for row, source in zip(answer, np.argsort(unknown[:touched]), strict=True):
        matrix[source].take(columns, out=row, mode="clip")  # "raise" would buffer it
    return Half(answer, matrix[np.ix_(loads, columns)].T, matrix[np.ix_(loads, loads)].astype(float))
