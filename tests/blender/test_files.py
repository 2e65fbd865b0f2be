"""What may be chosen to import: every layout that is read, a finger of a hand, a map of columns, a unit, snapshots."""

import importlib.util
import json
import re
from types import SimpleNamespace

import bpy
import numpy as np
import pytest

ENDINGS = [".csv", ".h5", ".hdf5", ".npz", ".npy", ".mat", ".bag", ".mcap", ".db3", ".json"]


@pytest.fixture
def counts(slide_csv):
    """Electrodes (150, 19) of a made-up press, and the CSV file that holds it."""
    path = slide_csv()
    return np.loadtxt(path, delimiter=",", skiprows=1)[:, -19:], path


def shown(frame=140):
    """The skin's electrodes (19,) on a frame."""
    bpy.context.scene.frame_set(frame)
    return np.array(bpy.context.object.evaluated_get(bpy.context.evaluated_depsgraph_get())["electrodes"])


@pytest.mark.parametrize("ending", ENDINGS)
def test_browser_and_drop_offer_what_is_read(part, ending):
    found = part("addon.operators.import_recording")
    glob = bpy.ops.tactile.import_recording.get_rna_type().properties["filter_glob"].default
    assert f"*{ending}" in glob.split(";")
    assert ending in found.TACTILE_FH_recording.bl_file_extensions.split(";")


def test_the_menu_says_so(part):
    said = []
    layout = SimpleNamespace(operator=lambda name, text: said.append(text))
    part("addon.operators.import_recording")._menu(SimpleNamespace(layout=layout), None)
    assert all(ending in said[0] for ending in (".csv", ".h5", ".npz", ".mat", ".json", ".bag", ".mcap"))


def test_a_finger_of_a_hand_is_picked_from_a_menu(counts, part, needs, tmp_path, capfd):
    needs("scipy")
    import scipy.io

    electrodes, pdc = counts[0].T, np.full((1, 150), 2000.0)
    path = tmp_path / "hand.mat"
    hand = {"F0Electrodes": electrodes[::-1], "F0pdc": pdc, "F1Electrodes": electrodes, "F1pdc": pdc}
    scipy.io.savemat(path, hand)
    operator = SimpleNamespace(filepath=str(path))
    browser = SimpleNamespace(directory=str(tmp_path).encode() + b"/", filename="hand.mat")
    items = part("addon.operators.import_recording")._fingers
    listed = items(operator, SimpleNamespace(space_data=None))
    assert [label for _, label, _ in listed] == ["0", "1"]
    operator.filepath = ""
    assert items(operator, SimpleNamespace(space_data=SimpleNamespace(params=browser))) == listed
    bpy.ops.tactile.import_recording(filepath=str(path), finger="1")
    second, recording = shown(), bpy.context.object.tactile.recording
    assert recording.endswith("hand.mat#1")
    assert "Finger picks" not in capfd.readouterr().out
    bpy.ops.tactile.import_recording(filepath=str(path))
    assert "hand.mat#0 is one of 2 recordings; Finger picks another" in capfd.readouterr().out
    assert np.abs(second - shown()).max() > 50
    bpy.ops.tactile.translate()
    if importlib.util.find_spec("msgspec") is not None:  # a map picks one finger, which was refused
        bpy.ops.tactile.import_recording(filepath=str(path), columns=str(tmp_path / "map.toml"))


def test_a_bag_says_what_it_lacks(part, tmp_path):
    if importlib.util.find_spec("rosbags") is not None:
        pytest.skip("rosbags is here")
    path = tmp_path / "hands.bag"
    path.write_bytes(b"#ROSBAG V2.0\n" + bytes(4096))
    with pytest.raises(RuntimeError, match="rosbags missing; expected it for ROS bags and MCAP"):
        bpy.ops.tactile.import_recording(filepath=str(path))


def test_a_map_of_columns_is_written_and_then_read_by(counts, needs, tmp_path):
    needs("msgspec")
    path, columns = tmp_path / "own.json", tmp_path / "map.toml"
    rows = [{"t": k / 100, "taxel": row.tolist()} for k, row in enumerate(counts[0])]
    path.write_text(json.dumps(rows))
    with pytest.raises(RuntimeError, match="Columns") as error:
        bpy.ops.tactile.import_recording(filepath=str(path))
    assert "--columns" not in str(error.value)
    bpy.ops.tactile.import_recording(filepath=str(path), columns=str(columns))
    by_map = shown()
    assert columns.is_file()
    bpy.ops.tactile.translate()
    bpy.ops.tactile.import_recording(filepath=str(counts[1]))
    np.testing.assert_allclose(by_map, shown(), atol=1)  # counts; the CSV file has PDC besides, which bounds contacts


def test_a_unit_is_obeyed_and_kept_for_the_translation(counts, needs, tmp_path):
    needs("msgspec")
    unit = tmp_path / "unit.toml"
    rows = f"gain = {[2.0] * 19}\noffset_counts = {[0.0] * 19}\n"
    unit.write_text(f'format = "tactile-sensor-2"\n[unit]\nnote = "made up"\n{rows}')
    bpy.ops.tactile.import_recording(filepath=str(counts[1]))
    typical = shown()
    bpy.ops.tactile.import_recording(filepath=str(counts[1]), unit=str(unit))
    assert bpy.context.object.tactile.unit == str(unit)
    assert np.linalg.norm(shown()) < 0.7 * np.linalg.norm(typical)
    bpy.ops.tactile.translate()


def test_snapshots_are_translated_each_alone(counts, part, monkeypatch):
    import dataclasses

    reader = part("addon.process.recording_reader")
    read = reader.read

    def without_time(*given):
        found = read(*given)
        return dataclasses.replace(found, time=np.full(len(found.time), np.nan))

    monkeypatch.setattr(reader, "read", without_time)
    with pytest.raises(RuntimeError, match=r"snapshots.*Each Frame Alone"):
        bpy.ops.tactile.import_recording(filepath=str(counts[1]))
    bpy.ops.tactile.import_recording(filepath=str(counts[1]), apart=True)
    bpy.ops.tactile.translate()
    assert "DIGIT gel" in bpy.context.scene.objects


def test_several_files_stand_side_by_side(counts, tmp_path, capfd):
    electrodes = counts[0]
    head = "timestamp,tdc,tac,pdc," + ",".join(f"pac{k}" for k in range(1, 23)) + ","
    head += ",".join(f"ele{k}" for k in range(1, 20))
    for name, rows in (("a", 150), ("b", 100), ("c", 150)):
        table = np.column_stack([np.arange(rows) / 100, np.full((rows, 25), 2000), electrodes[:rows]])
        table[:, -1] = 2000 if name == "c" else table[:, -1]
        np.savetxt(tmp_path / f"{name}.csv", table, delimiter=",", header=head, comments="", fmt="%g")
    (tmp_path / "bad.csv").write_text("no,recording\n1,2\n")
    files = [{"name": f"{name}.csv"} for name in ("b", "bad", "a", "c")]
    with pytest.raises(RuntimeError, match=r"bad\.csv: no known recording"):
        bpy.ops.tactile.import_recording(directory=str(tmp_path), files=files)
    skins = [thing for thing in bpy.context.scene.objects if thing.tactile.role == "BIOTAC"]
    assert [round(skin.location.y) for skin in skins] == [0, -85, -170]
    assert (bpy.context.scene.frame_start, bpy.context.scene.frame_end) == (0, 149)
    said = capfd.readouterr().out
    assert re.search(r"Warning: c\.csv: .*E19", said) and "Info: a.csv: 150 frames" in said
