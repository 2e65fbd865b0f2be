"""The example of docs/blender.md, as it stands there: an author's whole way, from an empty file to a picture."""

import csv
import re
from pathlib import Path

import bpy
import numpy as np

PAGE = Path(__file__).resolve().parents[2] / "docs" / "blender.md"


def test_the_example_goes_from_an_empty_file_to_a_picture(scene, part, needs, monkeypatch, tmp_path):
    needs("h5py", "msgspec", "scipy")
    monkeypatch.chdir(tmp_path)
    code = re.search(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL).group(1)
    assert code.count("12") == 3 and code.count("(6,") == 1
    code = code.replace("12", "3").replace("(6,", "(2,")  # a quarter of the frames
    bpy.context.scene.frame_set(1)
    bpy.context.scene.render.fps = 100  # a contact a frame
    exec(compile(code, str(PAGE), "exec"), {})  # noqa: S102 (the page's own text)
    found = part("tactile_core.simulation.scene").load_scene(tmp_path / "author" / "press")[0]
    forces = [point.force_n for point in found.recording.points]
    assert forces[0] == 0 and max(forces) > 0.5
    picture = bpy.data.images.load(str(tmp_path / "author" / "press.png"))
    assert tuple(picture.size) == (240, 320) and np.ptp(np.array(picture.pixels)) > 0.3
    shown = np.array(picture.pixels)
    bpy.context.scene.frame_set(1)
    bpy.ops.render.render(write_still=True)
    picture.reload()
    assert np.abs(np.array(picture.pixels) - shown).max() > 0.1  # the page's picture shows the dent
    gel = next(thing for thing in bpy.context.scene.objects if thing.tactile.role == "DIGIT")
    assert gel["expected_error_um"] > 0  # translated, no longer the simulated one


def test_every_operator_is_documented(extension):
    with (PAGE.parent / "blender_operators.csv").open(encoding="utf-8", newline="") as file:
        named = {name for row in csv.reader(file) for name in row[0].split(", ")}
    registered = {name for name in dir(bpy.ops.tactile) if not name.startswith("_")}
    assert registered <= named
