"""Graded meshes: fine where asked, the sensor's own surface, and a smooth way back to its lattice."""

import numpy as np
import pytest

from tactile_core.mechanics.solids import graded_mesh
from tactile_core.mechanics.solids.finite_strain import FiniteStrainSolid
from tactile_core.mechanics.solids.graded_mesh import Footprint
from tactile_core.sensors import biotac_surface, describe, digit_surface

GEL, SKIN = Footprint((24, 17), (34, 27)), Footprint((26, 27), (36, 37))
CASES = {"digit": (GEL, digit_surface), "biotac": (SKIN, biotac_surface)}


@pytest.fixture(scope="module", params=CASES)
def case(request):
    footprint, surface = CASES[request.param]
    return graded_mesh.graded(request.param, footprint), footprint, surface()


def test_lines_are_fine_under_the_footprint_alone(case):
    graded, footprint, _ = case
    for lines, low, high in zip((graded.rows, graded.columns), footprint.low, footprint.high, strict=True):
        step, middle = np.diff(lines), (lines[1:] + lines[:-1]) / 2
        inside = (middle > low) & (middle < high)
        assert len(lines) % 2 == 1 and (step > 0).all()
        assert step[inside].max() < 1.5 * footprint.spacing
        assert step[~inside].max() > 2 * step[inside].max()


def test_a_smooth_field_comes_back_on_the_lattice(case):
    graded, footprint, surface = case
    at = graded.mesh.nodes[graded.mesh.surface]

    def field(points):
        return np.column_stack([np.cos(points[:, 0] / 5e-3), points[:, 2] / 7e-3, np.sin(points[:, 0] / 6e-3)])

    off = np.abs(graded.on_lattice(field(at)) - field(surface.rest))
    rows, columns = surface.shape
    first = footprint.low[0] - (rows < len(graded.to_rows))  # the skin's lattice keeps its poles apart
    row, column = np.divmod(np.arange(rows * columns), columns)
    fine = (row > first) & (row < first + 10) & (column > footprint.low[1]) & (column < footprint.high[1])
    assert off[: rows * columns][fine].max() < 2e-3  # of a field of size one: cubic splines over 0.4 to 0.6 mm
    assert off[: rows * columns].max() < 0.2  # and nothing wild where lines are millimetres apart


def test_flags_come_back_as_flags(case):
    graded, _, surface = case
    everything = graded.nearest_on_lattice(np.ones(len(graded.mesh.surface), bool))
    assert everything.shape == (len(surface.rest),) and everything.all()
    assert not graded.nearest_on_lattice(np.zeros(len(graded.mesh.surface), bool)).any()


def test_a_refined_mesh_has_eight_times_the_cells_and_the_same_volume(case):
    graded, footprint, surface = case
    twice = graded_mesh.graded(
        "digit" if surface.window else "biotac", Footprint(footprint.low, footprint.high, refine=2)
    )
    assert len(twice.mesh.cells) == 8 * len(graded.mesh.cells)
    volumes = [FiniteStrainSolid(g.mesh, describe("biotac").material, g.pattern).weight.sum() for g in (graded, twice)]
    assert volumes[0] == pytest.approx(volumes[1], rel=0.01)  # coarse cells at the gel's rim cut its corners


def test_meshes_of_one_kind_share_their_pattern():
    moved = Footprint((25, 18), (35, 28))
    first, second = graded_mesh.graded("digit", GEL), graded_mesh.graded("digit", moved)
    if len(first.mesh.cells) == len(second.mesh.cells):
        assert first.pattern is second.pattern
    assert graded_mesh.graded("digit", GEL).factor is first.factor
