"""Files that are no indenter are refused with the reason, before anything is built."""

import sys

import numpy as np
import pytest
import trimesh

from tactile_core.errors import TactileError
from tactile_core.files.array_cache import cache_folder
from tactile_core.geometry.indenters import MeshIndenter, mesh_file
from tactile_core.geometry.indenters.mesh_grid import inside


def sphere(radius=2.0, at=(0, 0, 0)):
    ball = trimesh.creation.icosphere(2, radius)
    ball.apply_translation(at)
    return ball


def both(*meshes):
    return trimesh.util.concatenate(meshes)


def holed():
    ball = sphere()
    ball.update_faces(np.arange(len(ball.faces)) > 0)
    return ball


def one_flipped():
    ball = sphere()
    faces = ball.faces.copy()
    faces[7] = faces[7][::-1]
    return trimesh.Trimesh(ball.vertices, faces, process=False)


def inside_out():
    ball = sphere()
    ball.invert()
    return ball


def folded():
    """One vertex pushed through the other side: closed and well wound, but crossing itself.

    Its tip is 0.4 mm wide where it comes out: what is thinner than the grid's spacing is not seen.
    """
    ball = sphere()
    vertices = ball.vertices.copy()
    vertices[0] *= -2
    return trimesh.Trimesh(vertices, ball.faces, process=False)


def shifted_in_plane():
    """Two boxes that share part of a face's plane and overlap: no edge goes strictly through a triangle."""
    first, second = trimesh.creation.box((2, 2, 2)), trimesh.creation.box((2, 2, 2))
    return both(first, second)


def flat():
    """A pyramid whose tip lies in its base, seen from askew."""
    body = trimesh.Trimesh([[0, 0, 0], [9, 0, 0], [0, 9, 0], [2, 2, 0]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
    return body.apply_transform(trimesh.transformations.rotation_matrix(0.7, [1, 2, 3]))


def nan_vertex():
    ball = sphere()
    vertices = ball.vertices.copy()
    vertices[3] = np.nan
    return trimesh.Trimesh(vertices, ball.faces, process=False)


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (holed, "not closed: 3 edges"),
        (one_flipped, "face opposite ways"),
        (inside_out, "inside out"),
        (folded, "crosses itself"),
        (lambda: both(sphere(), sphere(at=(1, 0.1, 0.2))), "crosses itself"),
        (lambda: both(sphere(), sphere(at=(1, 0, 0))), "overlap"),  # mirrored, so that edges meet edges alone
        (lambda: both(sphere(), sphere(1.0)), "overlap"),  # a ball in a ball, both solid
        (shifted_in_plane, "two triangles|overlap"),
        (lambda: sphere(2e-3), r"0.004 mm across.*unit_mm = 1; .*in metres \(unit_mm = 1000\)"),
        (lambda: sphere(2e3), r"4000 mm across.*in micrometres"),
        (lambda: sphere(0.05), "Scale it|inches|centimetres"),
        (nan_vertex, "nan or infinite"),
        (flat, "flat: it encloses nothing"),
    ],
)
def test_no_solid_is_refused(tmp_path, make, said):
    before = set(cache_folder().glob("*"))
    path = tmp_path / "body.off"
    make().export(path)
    with pytest.raises(TactileError, match=said) as caught:
        MeshIndenter.from_file(path, spacing=0.3e-3)
    assert str(path) in str(caught.value)
    assert set(cache_folder().glob("*")) == before


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("body.glb", b"glTF", r"a .glb file"),
        ("body", b"", "a nameless file"),
        ("body.stl", b"", "cannot be read|no triangles"),
        ("body.stl", b"solid nothing\nendsolid nothing\n", "cannot be read|no triangles"),
        ("body.ply", b"ply\nformat ascii 1.0\nelement vertex 9000000000\nend_header\n", "cannot be read|no triangles"),
        ("body.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "cannot be read|missing vertices"),
        ("body.obj", b"v 0 0\nv 1 0\nv 0 1\nf 1 2 3\n", "three coordinates|cannot be read"),
        ("body.off", b"OFF\n1 1 0\n0 0 0\n3 0 0 0\n", "across|cannot be read|not closed"),
    ],
)
def test_damaged_files_are_refused(tmp_path, name, content, said):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(TactileError, match=said):
        MeshIndenter.from_file(path)


def test_missing_file(tmp_path):
    with pytest.raises(TactileError, match="cannot be read"):
        MeshIndenter.from_file(tmp_path / "none.stl")


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"scale": 0.0}, "unit_mm = 0"),
        ({"scale": float("nan")}, "unit_mm = nan"),
        ({"up": "w"}, "up = 'w'; expected one of x, y, z"),
        ({"spacing": 1e-6}, "0.01 to 1 mm"),
        ({"spacing": float("nan")}, "0.01 to 1 mm"),
        ({"spacing": 0.02e-3}, r"million nodes with spacing_mm = 0.02.*Give it spacing_mm = 0.0\d"),
    ],
)
def test_bad_settings_are_refused(ball_file, settings, said):
    with pytest.raises(TactileError, match=said):
        MeshIndenter.from_file(ball_file, **settings)


def test_too_much_is_refused(ball_file, monkeypatch):
    monkeypatch.setattr(mesh_file, "MAX_FACES", 100)
    with pytest.raises(TactileError, match="5120 triangles"):
        MeshIndenter.from_file(ball_file)
    monkeypatch.setattr(mesh_file, "MAX_BYTES", 100)
    with pytest.raises(TactileError, match="more than"):
        MeshIndenter.from_file(ball_file)


def test_files_that_a_mesh_names_are_not_opened(tmp_path):
    """Materials name pictures, and those any file."""
    opened = []
    (tmp_path / "look.mtl").write_text("newmtl a\nmap_Kd look.png\n")
    text = "mtllib look.mtl\nusemtl a\n" + trimesh.exchange.obj.export_obj(sphere())
    (tmp_path / "ball.obj").write_text(text)
    sys.addaudithook(lambda event, values: opened.append(str(values[0])) if event == "open" else None)
    MeshIndenter.from_file(tmp_path / "ball.obj", spacing=0.3e-3)
    assert any(name.endswith("ball.obj") for name in opened)
    assert not [name for name in opened if "look" in name]


def test_inside_counts_layers():
    """A box whose faces lie exactly on grid nodes, then the same box twice."""
    box = trimesh.creation.box((2, 2, 2)).triangles
    within = inside(box, np.full(3, -1.5), 0.5, (7, 7, 7), "box")
    sure = np.abs(np.arange(7) * 0.5 - 1.5) < 0.9
    assert within[np.ix_(sure, sure, sure)].all()
    assert not within[[0, -1]].any() and not within[:, [0, -1]].any() and not within[:, :, [0, -1]].any()
    with pytest.raises(TactileError, match="crosses itself"):
        inside(np.concatenate([box, box]), np.full(3, -1.5), 0.5, (7, 7, 7), "box")


def test_a_binary_stl_that_is_cut_short_says_so(tmp_path):
    sphere().export(tmp_path / "ball.stl")
    whole = (tmp_path / "ball.stl").read_bytes()
    for length in (len(whole) // 2, 84, 83, 10):
        (tmp_path / "ball.stl").write_bytes(whole[:length])
        with pytest.raises(TactileError, match="cut short"):
            MeshIndenter.from_file(tmp_path / "ball.stl")
