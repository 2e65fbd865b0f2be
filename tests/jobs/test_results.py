import json
import os

import pytest

from tactile_core.errors import TactileError
from tactile_core.jobs import results

KNOWN = ("electrodes", "displacement_biotac", "displacement_digit")


def make_result(folder):
    folder.mkdir(parents=True)
    (folder / results.NOTE).write_text(json.dumps({"format": results.FORMAT}))


def test_two_recordings_of_one_name_are_refused(tmp_path):
    with pytest.raises(TactileError, match="same name") as error:
        results.result_folders(["day1/touch.csv", "day2/Touch.h5"], tmp_path, False)
    assert "day1" in str(error.value) and "day2" in str(error.value)
    for pair in (["touch.csv", "touch.csv"], ["a/\u00e9.csv", "b/e\u0301.csv"]):  # an accent, written in two ways
        with pytest.raises(TactileError, match="same name"):
            results.result_folders(pair, tmp_path, True)


def test_an_older_result_needs_overwrite_and_other_folders_are_never_replaced(tmp_path):
    make_result(tmp_path / "touch")
    with pytest.raises(TactileError, match="already holds a result"):
        results.result_folders(["a.csv", "touch.csv"], tmp_path, False)
    assert results.result_folders(["touch.csv"], tmp_path, True) == [tmp_path / "touch"]
    (tmp_path / "documents").mkdir()
    for overwrite in (False, True):
        with pytest.raises(TactileError, match="is no result"):
            results.result_folders(["documents.csv"], tmp_path, overwrite)
    (tmp_path / "raw").write_text("a recording without an extension, beside its results")
    with pytest.raises(TactileError, match="is no result"):
        results.result_folders([tmp_path / "raw"], tmp_path, True)


def test_a_folder_that_cannot_be_written_is_refused(tmp_path):
    (tmp_path / "file").write_text("x")
    for out in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(TactileError, match="cannot be written"):
            results.result_folders(["touch.csv"], out, False)


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="root and Windows write everywhere")
def test_a_folder_without_permission_is_refused(tmp_path):
    tmp_path.chmod(0o500)
    with pytest.raises(TactileError, match="cannot be written"):
        results.result_folders(["touch.csv"], tmp_path, False)
    tmp_path.chmod(0o700)


def test_results_of_another_verb_and_files_of_others_are_not_replaced(tmp_path):
    make_result(tmp_path / "touch")
    with pytest.raises(TactileError, match="is no result of this verb"):
        results.check_free(tmp_path / "touch", True, "tactile render")
    (tmp_path / "touch" / "mine.txt").write_text("mine")
    with pytest.raises(TactileError, match=r"holds mine\.txt"):
        results.check_free(tmp_path / "touch", True)


def test_words_come_in_their_own_order_and_all_without_a_text():
    assert results.parse_words("displacement_digit, electrodes", KNOWN) == ("electrodes", "displacement_digit")
    assert results.parse_words(" ", KNOWN, least=0) == ()


@pytest.mark.parametrize(("text", "match"), [("electrodes,image", "image"), (" , ", "nothing"), ("digit", "digit")])
def test_words_that_are_none_are_refused(text, match):
    with pytest.raises(TactileError, match=f"--keep.*{match}"):
        results.parse_words(text, KNOWN)
