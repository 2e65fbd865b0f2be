"""The networks that ship for a BioTac SP: taken for its recordings, small, and better than the baselines they state."""

import json
import subprocess
import sys

import h5py
import numpy as np
import pytest

from tactile_core.cli.main import main
from tactile_core.recordings.flags import Flag
from tactile_core.translation import networks, reference_signals
from tactile_core.translation.card import chain_error, doubt
from tactile_core.translation.translate import load_translator
from tactile_core.translation.trust_words import LOW_CONFIDENCE

NAME, MOST = "biotac_sp", 8e6  # bytes


@pytest.fixture(scope="module")
def network():
    return load_translator(source=NAME)


def test_they_are_its_own_small_and_worth_something(network):
    assert (network.source, network.target, network.nets.electrodes) == (NAME, "digit", 24)
    folder = networks.shipped_folder(NAME)
    assert folder != networks.WEIGHTS_FOLDER and networks.shipped_folder("biotac") == networks.WEIGHTS_FOLDER
    assert sum(file.stat().st_size for file in folder.iterdir()) < MOST
    error, baseline = chain_error(network.card)
    assert error < 0.8 * baseline and doubt(network.card).startswith("these are guesses")


def test_its_recordings_are_converted_by_them_and_a_biotac_s_beside_is_refused(network, tmp_path, slide_csv, capsys):
    typical = reference_signals.read(networks.shipped_folder(NAME)).typical  # simulated contacts
    counts = np.tile(np.round(network.card["rest_counts"]), (40, 1))
    counts[20:] += np.round(typical[np.abs(typical).max(axis=1).argsort()[len(typical) // 2]])
    path = tmp_path / "slip.csv"
    header = ",".join(f"ff_e{number}" for number in range(1, 25))
    path.write_text("\n".join([header, *(",".join(map(str, row)) for row in counts)]), encoding="utf-8")
    words = ["--keep", "displacement", "--tare", "0:20", "--out", str(tmp_path / "out")]
    assert main(["convert", str(path), str(slide_csv()), *words]) == 2
    assert "19 electrodes: a BioTac; expected the 24" in capsys.readouterr().err
    with h5py.File(tmp_path / "out/slip/frames.h5") as file:
        moved, force = file["displacement_digit"][:], np.linalg.norm(file["force"][:], axis=1)
        assert file[f"displacement_{NAME}"].shape[0] == len(moved) == 40
        guesses, flags = file["confidence"][:] < LOW_CONFIDENCE, file["flags"][:]
    assert json.loads((tmp_path / "out/slip/note.json").read_text())["warnings"][0].startswith("these are guesses")
    assert guesses[22:].all() and (flags[22:] & Flag.LAW_DOUBTED).all() and not (flags[:18] & Flag.LAW_DOUBTED).any()
    assert not moved[:18].any() and not force[:18].any()
    assert np.abs(moved[22:]).max() > 20e-6 and (force[22:] > 0).all()


READS = """
import sys
opened = []
sys.addaudithook(lambda event, args: opened.append(str(args[0])) if event == "open" else None)
import tactile_core as tactile
tactile.translate(tactile.read(sys.argv[1]))
data = [path for path in opened if path.endswith((".safetensors", ".json", ".toml", ".csv", ".npy"))]
assert any("MVD.safetensors" in path for path in data)
print([path for path in data if "biotac_sp" in path or "gelsight_mini" in path])
"""


def test_they_cost_a_biotac_s_recordings_nothing(request):
    recording = request.config.rootpath / "scenes/press_roll_slide/press_roll_slide.h5"
    ran = subprocess.run([sys.executable, "-c", READS, recording], capture_output=True, text=True, check=True)
    assert ran.stdout.strip() == "[]"
