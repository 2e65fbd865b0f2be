"""A release: one version everywhere, nothing that no commit holds."""

import shutil
import subprocess

import pytest
import release
from conftest import ROOT


@pytest.fixture
def copied(tmp_path):
    """A folder with the files that name the version."""
    for name in release.VERSIONS:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)
    return tmp_path


def test_manifest_citation_and_changelog_name_the_package_s_version(copied):
    from tactile_core import __version__

    assert release.agreed_version(copied) == __version__


@pytest.mark.parametrize("name", release.VERSIONS)
def test_a_version_that_differs_is_named(copied, name):
    file = copied / name
    text = file.read_text(encoding="utf-8")
    file.write_text(text.replace(release.agreed_version(copied), "9.9.9"), encoding="utf-8")
    with pytest.raises(release.ReleaseError, match=rf"{name}: 9\.9\.9"):
        release.agreed_version(copied)


def test_changes_that_no_commit_holds_are_refused(tmp_path, monkeypatch):
    subprocess.run(["git", "init", "--quiet", str(tmp_path)], check=True)
    (tmp_path / "changed.py").write_text("x = 1\n")
    monkeypatch.setattr(release, "run", lambda *command: subprocess.check_output(command, cwd=tmp_path, text=True))
    with pytest.raises(release.ReleaseError, match=r"in no commit.*\n.*changed\.py"):
        release.check_clean(tmp_path / "dist")


def test_a_folder_that_holds_another_release_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(release, "run", lambda *command: "")
    (tmp_path / "tactile-0.1.0.zip").write_bytes(b"")
    with pytest.raises(release.ReleaseError, match="is not empty"):
        release.check_clean(tmp_path)


def test_hashes_are_those_that_sha256sum_checks(tmp_path):
    (tmp_path / "a.whl").write_bytes(b"abc")
    known = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"  # FIPS 180-2, appendix B.1
    assert release.write_hashes(tmp_path) == f"{known}  a.whl\n" == release.write_hashes(tmp_path)
