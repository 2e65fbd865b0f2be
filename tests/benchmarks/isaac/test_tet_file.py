"""The reader of user-given meshes: it reads the public one, and says of each bad one what is wrong with it."""

import numpy as np
import pytest
from benchmarks.isaac import tet_file
from benchmarks.isaac.tet_file import checked, read_tet

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
    assert mesh.turned == 1
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
    "empty": ("", "no vertices"),
    "vertices alone": (text(cells=[], head=False), "no tetrahedra"),
    "cut in a line": (text(head=False)[:-2], r"line 7.*cut short"),
    "cut after a line": (text().rsplit("\n", 1)[0], "1 tetrahedra; expected the 2"),
    "cut in the vertices": ("\n".join(text().split("\n")[:4]), "3 vertices; expected the 5"),
    "a stranger": ("solid cube\nfacet normal 0 0 1\n", "line 1"),
    "words for numbers": (text().replace("0.01", "wide"), "line 3"),
    "not a number": (text().replace("v 0.01 0 0 ", "v nan 0 0 "), "vertex 1 is nan"),
    "infinite": (text().replace("v 0.01 0 0 ", "v inf 0 0 "), "vertex 1 is nan or infinite"),
    "a number out of range": (text(cells=[[0, 1, 2, 3], [1, 2, 3, 5]]), r"names the vertices \[1, 2, 3, 5\]"),
    "a negative number": (text(cells=[[0, 1, 2, 3], [1, 2, 3, -1]]), "expected numbers 0 to 4"),
    "a fraction": (text().replace("t 0 1 2 3", "t 0 1 2 3.5"), "line 8"),
    "millimetres": (text(nodes=(np.array(NODES) * 1e3).tolist()), "looks like millimetres"),
    "micrometres": (text(nodes=(np.array(NODES) * 1e-3).tolist()), "Scale it to metres"),
    "flat": (text(nodes=[*NODES[:4], [0.005, 0.005, 0]], cells=[*CELLS[:1], [0, 1, 2, 4]]), "without volume"),
    "a corner twice": (text(cells=[[0, 1, 2, 3], [1, 2, 4, 4]]), "names a vertex twice"),
    "a cell twice": (text(cells=[*CELLS, [3, 2, 1, 0]]), "there twice"),
    "two vertices at one place": (text(nodes=[*NODES, NODES[0]]), "vertices 0 and 5 are at one place"),
    "a loose vertex": (text(nodes=[*NODES, [0.02, 0, 0]]), "belong to no tetrahedron"),
    "binary": (b"\x89HDF\r\n\xff\xfe", "cannot be read"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_file_is_refused_in_words(case, write):
    content, said = BAD[case]
    with pytest.raises(TactileError, match=said):
        read_tet(write(content))


def test_a_file_that_is_not_there_or_too_large_is_refused(tmp_path, write, monkeypatch):
    with pytest.raises(TactileError, match="cannot be read"):
        read_tet(tmp_path / "absent.tet")
    with pytest.raises(TactileError, match="cannot be read"):
        read_tet(tmp_path)
    monkeypatch.setattr(tet_file, "MAX_CELLS", 1)
    with pytest.raises(TactileError, match="more than 1 vertices"):
        read_tet(write(text()))
    monkeypatch.setattr(tet_file, "MAX_BYTES", 10)
    with pytest.raises(TactileError, match="more than 10 bytes"):
        read_tet(write(text()))


def test_each_cut_of_a_file_is_read_whole_or_refused(write):
    """A cut can only pass where nothing but the end of the last line is missing."""
    whole = text()
    for end in range(len(whole)):
        try:
            mesh = read_tet(write(whole[:end]))
        except TactileError:
            continue
        np.testing.assert_array_equal(mesh.nodes, NODES)
        assert len(mesh.cells) == 2


def test_arrays_are_checked_like_files():
    assert checked(np.array(NODES), np.array(CELLS)).turned == 0
    with pytest.raises(TactileError, match="millimetres"):
        checked(np.array(NODES) * 1e3, np.array(CELLS))


def test_the_public_mesh_is_read(outside_data):
    mesh = read_tet(outside_data("biotac_mesh") / "skin.tet")
    assert (len(mesh.nodes), len(mesh.cells)) == (4246, 15410)
    assert (volumes(mesh) > 0).all()
