"""The reader of Isaac Gym's meshes: it reads the public one, and names what it cannot read."""

import numpy as np
import pytest
from benchmarks.isaac.tet_file import read_tet

from tactile_core.errors import TactileError

# two tetrahedra that share a face, 10 mm on a side
NODES = [[0, 0, 0], [0.01, 0, 0], [0, 0.01, 0], [0, 0, 0.01], [0.01, 0.01, 0.01]]
CELLS = [[0, 1, 2, 3], [1, 2, 3, 4]]


def text(nodes=NODES, cells=CELLS, head=True):
    lines = [f"# {len(nodes)} vertices"] if head else []
    lines += [f"v {x} {y} {z} 0" for x, y, z in nodes]
    lines += [f"# {len(cells)} tetrahedra"] if head else []
    return "\n".join(lines + ["t " + " ".join(map(str, cell)) for cell in cells])


@pytest.fixture
def write(tmp_path):
    def to_file(content):
        path = tmp_path / "mesh.tet"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return to_file


def volumes(mesh):
    corners = mesh.nodes[mesh.cells]
    return np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6


def test_a_mesh_is_read_and_turned_right_side_out(write):
    mesh = read_tet(write(text(cells=[[0, 2, 1, 3], [1, 2, 3, 4]])))
    np.testing.assert_array_equal(mesh.nodes, NODES)
    assert (volumes(mesh) > 0).all()


def test_comments_spaces_and_line_ends_do_not_matter(write):
    plain = read_tet(write(text()))
    other = "\r\n".join(f"  {line}  # of a tool" for line in text(head=False).split("\n")) + "\r\n\r\n"
    found = read_tet(write(other))
    np.testing.assert_array_equal(found.nodes, plain.nodes)
    np.testing.assert_array_equal(found.cells, plain.cells)


def test_the_surface_is_closed_and_faces_outward(write):
    mesh = read_tet(write(text()))
    corners = mesh.nodes[mesh.surface]
    enclosed = np.linalg.det(corners).sum() / 6  # divergence theorem
    assert len(mesh.surface) == 6
    assert enclosed == pytest.approx(volumes(mesh).sum(), rel=1e-12)  # round-off


BAD = {
    "cut in a line": (text(head=False)[:-2], "line 7"),
    "a stranger": ("solid cube\nfacet normal 0 0 1\n", "line 1"),
    "words for numbers": (text().replace("0.01", "wide"), "line 3"),
    "a fraction": (text().replace("t 0 1 2 3", "t 0 1 2 3.5"), "line 8"),
    "flat": (text(nodes=[*NODES[:4], [0.005, 0.005, 0]], cells=[*CELLS[:1], [0, 1, 2, 4]]), "without volume"),
    "binary": (b"\x89HDF\r\n\xff\xfe", "cannot be read"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_file_is_refused_in_words(case, write):
    content, said = BAD[case]
    with pytest.raises(TactileError, match=said):
        read_tet(write(content))


def test_the_public_mesh_is_read(outside_data):
    mesh = read_tet(outside_data("biotac_mesh") / "skin.tet")
    assert (len(mesh.nodes), len(mesh.cells)) == (4246, 15410)
    assert (volumes(mesh) > 0).all()
