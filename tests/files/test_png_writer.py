"""Pictures as PNG: their own pixels by either packer, and files of one size."""

import io

import numpy as np
import pytest

from tactile_core.files import png_writer
from tactile_core.files.png_writer import pack_png, write_png
from tactile_core.pictures.renderer import Renderer
from tactile_core.sensors.calibration_file import load_calibration


def picture() -> np.ndarray:
    """A unit's picture at rest, with its camera's grain, cut to odd sizes."""
    return np.ascontiguousarray(Renderer(load_calibration(), "fast").background.astype(np.uint8)[:317, :239])


def test_files_hold_the_pixels_in_no_more_space_than_pillows(tmp_path, monkeypatch):
    from PIL import Image

    size = {}
    for packer in ("fast", "plain"):
        if packer == "plain":
            monkeypatch.setattr(png_writer, "_has_libdeflate", lambda: False)
        else:
            pytest.importorskip("deflate", reason="the extra [fast] is not installed")
        write_png(tmp_path / "one.png", picture())
        out = io.BytesIO(content := pack_png(picture()))
        assert content == (tmp_path / "one.png").read_bytes()
        with Image.open(out) as opened:
            opened.verify()  # the chunks' check sums
        np.testing.assert_array_equal(np.asarray(Image.open(out)), picture())
        size[packer] = len(content)
    assert size["fast"] < 1.05 * size["plain"], size  # measured 0.96


def test_a_full_disk_is_an_os_error(tmp_path):
    with pytest.raises(OSError, match="missing"):
        write_png(tmp_path / "missing" / "one.png", picture())
