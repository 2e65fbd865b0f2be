"""Folders of photographs: what is read out of them, and what is refused."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from plain_unit import plain_unit
from pressed_unit import BALL, PLACES, photograph, write_photographs

from tactile_core.errors import TactileError
from tactile_core.pictures.calibrate.evaluate import evaluate_unit
from tactile_core.pictures.calibrate.photographs import chosen, estimated_background, lighting_drift, read_photographs

UNIT = plain_unit()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_photographs(tmp_path_factory.mktemp("unit") / "presses", UNIT)


def test_presses_background_and_noise_are_found(folder: Path) -> None:
    found = read_photographs(folder)
    assert [press.name for press in found.presses] == [f"press_{k}.png" for k in range(5)]
    assert found.estimated and not found.untouched
    # The median of five noisy pictures (1 level) of which up to two show a press at a pixel.
    assert np.abs(found.background - 128).mean() < 0.7
    assert np.abs(found.background - 128).max() <= 8
    # Noise of 1 level, rounding to whole levels (sd 0.29) and the median's own noise (about 0.5) add up.
    assert all(0.9 < level < 1.3 for level in found.noise)


def test_photographed_background_is_taken(folder: Path) -> None:
    found = read_photographs(folder, folder.parent / "untouched.png")
    np.testing.assert_array_equal(found.background, np.asarray(Image.open(folder.parent / "untouched.png")))
    assert not found.estimated


def test_untouched_photograph_among_presses_is_named(folder: Path, tmp_path: Path) -> None:
    for file in [*folder.iterdir(), folder.parent / "untouched.png"]:
        (tmp_path / file.name).write_bytes(file.read_bytes())
    assert read_photographs(tmp_path).untouched == ("untouched.png",)


def test_presses_hardly_pull_the_estimate(tmp_path: Path) -> None:
    # Two of five presses overlap all over; the other three tell what lies below.
    places = (PLACES[0], (0.8, 0.5, 0.9), PLACES[1], PLACES[2], PLACES[3])
    folder = write_photographs(tmp_path / "presses", UNIT, places)
    pictures = np.stack([np.asarray(Image.open(file)) for file in sorted(folder.iterdir())])
    error = np.abs(estimated_background(pictures) - 128)
    assert (error > 5).mean() < 0.002
    assert error.max() < 18


def test_what_is_no_photograph_of_8_bits_is_named(folder: Path, tmp_path: Path) -> None:
    """Pillow cuts 16 bits off at 255, all white; what is no file was passed over without a word."""
    Image.fromarray(np.full((320, 240), 40000, np.uint16)).save(tmp_path / "deep.png")
    (tmp_path / "loop.png").symlink_to("loop.png")
    for name, said in (("deep.png", "more than 8 bits"), ("loop.png", "symbolic links")):
        mixed = tmp_path / f"with_{name}"
        shutil.copytree(folder, mixed)
        shutil.copy(tmp_path / name, mixed, follow_symlinks=False)
        with pytest.raises(TactileError, match=rf"{name}: cannot be read .*{said}"):
            read_photographs(mixed)


def test_a_press_that_is_there_twice_or_grey_and_files_of_several_pictures_are_named(
    folder: Path, tmp_path: Path
) -> None:
    files = sorted(folder.iterdir())
    pictures = [Image.open(file).convert("RGB") for file in files]
    for name, said in (
        ("twice.png", "same picture as press_1"),
        ("grey.png", "no colours"),
        ("all.tif", "several pictures"),
    ):
        mixed = tmp_path / name
        shutil.copytree(folder, mixed)
        if name == "twice.png":
            shutil.copy(files[1], mixed / name)
        elif name == "grey.png":
            pictures[0].convert("L").convert("RGB").save(mixed / name)
        else:
            pictures[0].save(mixed / name, save_all=True, append_images=pictures[1:])
        with pytest.raises(TactileError, match=rf"{name}: .*{said}"):
            read_photographs(mixed)
    assert len(read_photographs(tmp_path / "twice.png", only=["press_1.png", "press_2.png"]).presses) == 2


@pytest.mark.filterwarnings("error")
def test_a_spot_that_every_press_covers_is_estimated_in_silence() -> None:
    """In two halves of two kinds of light no photograph is near the median of all."""
    pictures = np.repeat(np.array([0, 200], np.uint8), 2)[:, None, None, None] * np.ones((1, 3, 3, 3), np.uint8)
    assert (estimated_background(pictures) == 100).all()


def test_some_are_chosen_by_name(folder: Path) -> None:
    whole = read_photographs(folder)
    some = chosen(whole, ["press_3.png", "press_1.png"])
    assert [press.name for press in some.presses] == ["press_3.png", "press_1.png"]
    np.testing.assert_array_equal(some.background, whole.background)
    with pytest.raises(TactileError, match=r"press_9\.png"):
        chosen(whole, ["press_9.png"])


def test_over_exposed_photograph_is_flagged(tmp_path: Path) -> None:
    folder = write_photographs(tmp_path / "presses", UNIT, PLACES[:3])
    bright = photograph(UNIT, PLACES[0]).astype(int)
    Image.fromarray((bright + 90).clip(0, 255).astype(np.uint8)).save(folder / "press_0.png")
    background = np.full((320, 240, 3), 218, np.uint8)
    Image.fromarray(background).save(tmp_path / "bright.png")
    flags = {press.name: press.flags for press in read_photographs(folder, tmp_path / "bright.png").presses}
    assert "over-exposed" in flags["press_0.png"]
    assert any("another lighting" in flag for flag in flags["press_1.png"])


@pytest.mark.parametrize(("exposure", "words"), [(0.8, "-20 % beside"), (0.95, ""), (1.15, "+15 % beside")])
def test_another_exposure_than_the_background_s_is_flagged(
    folder: Path, tmp_path: Path, exposure: float, words: str
) -> None:
    press = np.asarray(Image.open(folder / "press_1.png")) * exposure
    Image.fromarray(np.rint(press).astype(np.uint8)).save(tmp_path / "press.png")
    (found,) = read_photographs(tmp_path, folder.parent / "untouched.png").presses
    assert any("exposed otherwise" in flag and words in flag for flag in found.flags) == bool(words)


def test_no_folder_no_picture_no_press(tmp_path: Path) -> None:
    with pytest.raises(TactileError, match="no folder"):
        read_photographs(tmp_path / "absent")
    with pytest.raises(TactileError, match="no photographs"):
        read_photographs(tmp_path)
    random = np.random.default_rng(0)
    for k in range(4):
        noise = random.normal(128, 2, (320, 240, 3)).clip(0, 255)
        Image.fromarray(noise.astype(np.uint8)).save(tmp_path / f"{k}.png")
    with pytest.raises(TactileError, match="no press in 4 photographs"):
        read_photographs(tmp_path)


def test_different_sizes_and_unreadable_files_are_named(folder: Path, tmp_path: Path) -> None:
    for file in folder.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    Image.fromarray(np.zeros((100, 80, 3), np.uint8)).save(tmp_path / "press_2.png")
    with pytest.raises(TactileError, match=r"press_2\.png: 80 x 100 pixels"):
        read_photographs(tmp_path)
    Image.fromarray(np.zeros((320, 240), np.uint8)).save(tmp_path / "press_2.png")
    with pytest.raises(TactileError, match=r"press_2\.png: .*no colours"):
        read_photographs(tmp_path)
    (tmp_path / "press_2.png").write_bytes(b"no picture")
    with pytest.raises(TactileError, match=r"press_2\.png"):
        read_photographs(tmp_path)


def test_two_photographs_need_a_background(tmp_path: Path) -> None:
    folder = write_photographs(tmp_path / "presses", UNIT, PLACES[:2])
    with pytest.raises(TactileError, match="--background"):
        read_photographs(folder)
    assert len(read_photographs(folder, tmp_path / "untouched.png").presses) == 2
    Image.fromarray(np.zeros((160, 120, 3), np.uint8)).save(tmp_path / "small.png")
    with pytest.raises(TactileError, match=r"small\.png: 120 x 160"):
        read_photographs(folder, tmp_path / "small.png")


DOWN, RIGHT = np.meshgrid(np.linspace(-1, 1, 320), np.linspace(-1, 1, 240), indexing="ij")
# Grey levels, a channel each: more than the 18 that count as a press, over a third of the picture.
DRIFT = np.stack([30 * RIGHT - 5, 12 * DOWN**2 + 8 * RIGHT, -20 * DOWN * RIGHT + 6], axis=-1)


def test_a_quadratic_is_found_beside_a_press():
    press = np.where(((RIGHT - 0.3) ** 2 + DOWN**2 < 0.2)[..., None], (60.0, -50.0, 40.0), 0)  # a sixth of the picture
    noise = np.random.default_rng(0).normal(scale=2, size=DRIFT.shape)
    assert np.abs(lighting_drift(DRIFT + press + noise) - DRIFT).max() < 1.5
    assert np.abs(lighting_drift(noise)).max() < 0.5  # nothing is made of nothing


def test_presses_are_found_under_a_drifted_light(tmp_path):
    unit = plain_unit().at_size(60, 80)
    folder = write_photographs(tmp_path / "presses", unit, PLACES[:3])
    for file in sorted(folder.iterdir()):
        picture = np.asarray(Image.open(file)).astype(float) + DRIFT[::4, ::4]
        Image.fromarray(np.rint(picture).clip(0, 255).astype(np.uint8)).save(file)
    tried = evaluate_unit(unit, read_photographs(folder, tmp_path / "untouched.png"), BALL, search_radius=False)
    for each, (right, down, depth) in zip(tried, PLACES, strict=False):
        assert each.ball.right == pytest.approx(1e-3 * right, abs=0.15e-3)
        assert each.ball.down == pytest.approx(1e-3 * down, abs=0.15e-3)
        assert each.ball.depth == pytest.approx(1e-3 * depth, abs=0.1e-3)
        assert each.metrics["frame_l1"] < 2.5
