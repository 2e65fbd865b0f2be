"""The metrics of a trial against their definitions and against scikit-image, where that is installed."""

import numpy as np
import pytest

from tactile_core.pictures.calibrate.photo_metrics import lobe_overlap, metrics, psnr, similarity
from tactile_core.pictures.calibrate.photographs import dilated, press_of


@pytest.fixture(scope="module")
def pictures() -> tuple[np.ndarray, np.ndarray]:
    random = np.random.default_rng(0)
    smooth = np.cumsum(np.cumsum(random.normal(0, 1, (60, 50, 3)), 0), 1) + 120
    return smooth.clip(0, 255), (smooth + random.normal(0, 6, smooth.shape)).clip(0, 255)


def test_figures_by_their_words(pictures: tuple[np.ndarray, np.ndarray]) -> None:
    one, other = pictures
    region = np.zeros(one.shape[:2], bool)
    region[10:30, 5:25] = True
    found = metrics(one, other, np.full_like(one, 120), region)
    inside = (one - other)[10:30, 5:25]
    assert found["roi_l1"] == pytest.approx(np.abs(inside).mean())
    assert found["roi_psnr"] == pytest.approx(10 * np.log10(255**2 / (inside**2).mean()))
    assert found["frame_l1"] == pytest.approx(np.abs(one - other).mean())


def test_lobes_overlap_by_colour() -> None:
    region = np.ones((4, 6), bool)
    region[3] = False
    ours, true = np.zeros((4, 6, 3)), np.zeros((4, 6, 3))
    true[:, :4, 0], ours[:, 2:, 0] = -11, -11  # 2 of 6 columns in both
    true[0, 0, 1] = -10  # not below
    assert lobe_overlap(ours, true, region) == pytest.approx(2 / 6)
    assert lobe_overlap(np.zeros_like(true), true, region) == 0
    assert np.isnan(lobe_overlap(np.zeros_like(true), np.zeros_like(true), region))


def test_similarity_is_scikit_image_s(pictures: tuple[np.ndarray, np.ndarray]) -> None:
    reference = pytest.importorskip("skimage.metrics", reason="scikit-image is not installed")
    _, expected = reference.structural_similarity(*pictures, channel_axis=-1, data_range=255, full=True)
    np.testing.assert_allclose(similarity(*pictures)[3:-3, 3:-3], expected[3:-3, 3:-3], atol=1e-9)


def test_similarity_of_equals_is_one_and_falls_with_noise(pictures: tuple[np.ndarray, np.ndarray]) -> None:
    one, other = pictures
    np.testing.assert_allclose(similarity(one, one), 1)
    assert similarity(one, one + 3 * (other - one)).mean() < similarity(one, other).mean() < 1


def test_equal_pictures_have_a_finite_psnr() -> None:
    assert psnr(np.zeros((3, 3))) == pytest.approx(10 * np.log10(255**2 / 1e-6))


def test_dilation_is_a_disc() -> None:
    mask = np.zeros((40, 50), bool)
    mask[20, 25] = mask[0, 0] = True
    rows, columns = np.indices(mask.shape)
    near = (rows - 20) ** 2 + (columns - 25) ** 2 <= 81
    near |= rows**2 + columns**2 <= 81
    np.testing.assert_array_equal(dilated(mask, 9), near)


def test_region_looks_at_the_largest_change_of_a_channel() -> None:
    background = np.full((60, 60, 3), 100, np.float32)
    picture = background.astype(np.uint8)
    picture[:8, :8] = 160  # the press
    picture[30, 30, 2], picture[30, 50, 0] = 81, 118  # 19 and 18 levels
    region = press_of("one", picture, background).region
    assert region[30, 39] and region[21, 30] and not region[30, 40] and not region[30, 50]
