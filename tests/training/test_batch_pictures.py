"""Many frames at once in torch against the same frames one after the other in numpy; gradients against differences."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="training needs torch")

from tactile_core import recordings, sensors  # noqa: E402
from tactile_core.errors import TactileError  # noqa: E402
from tactile_core.pictures.height_map import HeightMapper, gel_mapper  # noqa: E402
from tactile_core.pictures.shading import Shader  # noqa: E402
from tactile_core.recordings.electrode_gains import prepare_unit  # noqa: E402
from tactile_core.recordings.flags import Flag  # noqa: E402
from tactile_core.sensors.calibration import LARGEST_LEVEL, Markers  # noqa: E402
from tactile_core.sensors.calibration_file import load_calibration  # noqa: E402
from tactile_core.training.batch_pictures import BLOCKS, BatchPictures  # noqa: E402
from tactile_core.translation.answer import Answer  # noqa: E402
from tactile_core.translation.translate import load_translator  # noqa: E402

RECORDING = "scenes/press_roll_slide/press_roll_slide.h5"
CLOSE = 1e-5  # of the largest level, on pixels where no table or nearest pixel is another; measured 3e-6


@pytest.fixture(scope="module")
def translator():
    return load_translator(answer=Answer(frames_apart=True))


@pytest.fixture(scope="module")
def batch(translator):
    return BatchPictures(translator)


@pytest.fixture(scope="module")
def signals(request):
    return prepare_unit(recordings.read(request.config.rootpath / RECORDING), None, None).at(slice(0, 360, 8))


def levels(displacement: np.ndarray, shader: Shader, mapper: HeightMapper) -> np.ndarray:
    """Pictures (B, H, W, 3), 0 to 1 and not rounded, by numpy."""
    change = np.stack([shader.radiance(mapper(each)) for each in displacement]) - np.moveaxis(
        shader.rest_radiance, 0, -1
    )
    found = shader.background + np.einsum("clhw,bhwl->bhwc", shader.response, change)
    return np.clip(found, 0, LARGEST_LEVEL) / LARGEST_LEVEL


def dents() -> np.ndarray:
    """Displacements (4, n, 3) m of steep dents that throw shadows, one beside the other, and of none."""
    rest = sensors.digit_surface().rest
    found = np.zeros((4, *rest.shape), np.float32)
    for k, (x, z, depth, width) in enumerate(
        [(-8e-3, 0, 1.2e-3, 1e-3), (-3e-3, 5e-3, 0.9e-3, 1.3e-3), (-12e-3, -4e-3, 1e-3, 2e-3)]
    ):
        away = rest[:, [0, 2]] - [x, z]
        deep = depth * np.exp(-np.square(away).sum(1) / (2 * width**2))
        found[k, :, 1] = deep
        found[k, :, [0, 2]] = (0.3 * deep[:, None] * away / width).T
    return found


def test_the_shipped_example_is_numpys_frame_by_frame(batch, translator, signals, compiled_loops):
    compiled_loops(False)
    expected = translator(signals)
    with torch.no_grad():
        change, rectified = batch.changes(signals)
        gel = batch.displacement(change, rectified).numpy()
        pictures = batch(change, rectified).numpy()
    size = np.abs(expected.displacement_digit).max()
    assert size > 0.3e-3
    assert np.abs(gel - expected.displacement_digit).max() < CLOSE * size
    assert np.abs(pictures - levels(expected.displacement_digit, Shader(), gel_mapper())).max() < CLOSE
    touched = expected.displacement_digit.any(axis=(1, 2))
    assert 10 < touched.sum() < len(touched) and (np.ptp(pictures[~touched], axis=0) == 0).all()


def test_dents_that_throw_shadows_are_numpys_too(batch, compiled_loops):
    compiled_loops(False)
    shader, mapper, given = Shader(), gel_mapper(), dents()
    expected, heights = levels(given, shader, mapper), mapper(given)
    with torch.no_grad():
        np.testing.assert_allclose(batch.heights(torch.from_numpy(given)).numpy(), heights, rtol=0, atol=1e-9)
        found = batch.pictures(torch.from_numpy(given)).numpy()
    # A shadow's share is looked up in a table of 257: where rounding chooses the neighbour it is another.
    off = np.abs(found - expected)
    assert np.quantile(off, 0.999) < CLOSE and off.max() < 1 / LARGEST_LEVEL
    sight = [
        batch.lamps[0].shadows.sight(torch.from_numpy(heights[:1]), torch.ones(1, *shader.camera.shape, dtype=bool), 2)[
            0
        ]
    ]
    assert float(sight[0].min()) < 0  # there are shadows
    # A frame's picture does not depend on those beside it.
    for k, each in enumerate(given):
        with torch.no_grad():
            np.testing.assert_allclose(batch.pictures(torch.from_numpy(each[None]))[0].numpy(), found[k], atol=1e-6)


def test_gel_that_hides_itself_from_the_camera_is_seen_from_above(batch, compiled_loops):
    compiled_loops(False)
    heights = np.array(gel_mapper()(dents()[:2]))
    heights[0, :, :20] += np.float32(20e-3) * np.linspace(1, 0, 20, dtype=np.float32) ** 2
    view = Shader().view
    expected = np.stack([view(each) for each in heights])
    assert np.abs(expected[0] - heights[0]).max() > 1e-3
    with torch.no_grad():
        found = batch.view(torch.from_numpy(heights)).numpy()
    np.testing.assert_allclose(found, expected, atol=1e-8)


def test_rectified_frames_go_their_own_way(batch, translator, signals):
    folded = dataclasses.replace(
        signals, change=np.abs(signals.change), flags=signals.flags | np.uint16(Flag.RECTIFIED)
    )
    expected = translator(folded).displacement_digit
    with torch.no_grad():
        change, rectified = batch.changes(folded)
        found = batch.displacement(change, rectified).numpy()
    assert rectified.any()
    assert np.abs(found - expected).max() < CLOSE * np.abs(expected).max()


def test_a_units_own_dome_and_light_are_numpys(translator, compiled_loops):
    compiled_loops(False)
    unit = dataclasses.replace(load_calibration(), dome_scale=0.7, ambient_rise=(30.0, 20.0, 40.0))
    given = dents()[2:]
    with torch.no_grad():
        found = BatchPictures(translator, unit).pictures(torch.from_numpy(given)).numpy()
    off = np.abs(found - levels(given, Shader(unit), gel_mapper(unit.camera)))
    assert np.quantile(off, 0.999) < CLOSE


@pytest.mark.parametrize("frame", [15, 22, 34])
def test_gradients_by_place_and_force_are_those_of_differences(translator, signals, frame):
    """Of a picture's squared distance from another contact's, as a search for the contact takes it."""
    batch = BatchPictures(translator).double()
    change, rectified = (each[frame : frame + 1] for each in batch.changes(signals))
    with torch.no_grad():
        state = batch.state(change, rectified)
        goal = batch(change, rectified, state + torch.tensor([[0.02, -0.02, 0.2, 0.2]]))

    def miss(state):
        return (batch(change, rectified, state) - goal).square().sum()

    given = state.clone().requires_grad_()
    miss(given).backward()
    step = 1e-3  # a hundredth of a cell, a thousandth of the force
    with torch.no_grad():
        steps = step * torch.eye(4, dtype=state.dtype)
        found = [float(miss(state + one) - miss(state - one)) / (2 * step) for one in steps]
    gradient = given.grad[0].numpy()
    # Shadows go in steps of their table, which differences see and gradients do not: measured below 0.6 %.
    np.testing.assert_allclose(gradient, found, rtol=0.02)
    assert np.abs(gradient).min() > 1


def test_frames_of_several_blocks_are_those_of_each(batch, signals):
    """Pictures without gradients and with them, and the gradients."""
    change, rectified = (each[15:21] for each in batch.changes(signals))
    state = batch.state(change, rectified)

    def drawn(parts):
        given = state.clone().requires_grad_()
        pictures = [batch(change[part], rectified[part], given[part]) for part in parts]
        sum(each.square().sum() for each in pictures).backward()
        with torch.no_grad():
            without = torch.cat([batch(change[part], rectified[part], state[part]) for part in parts])
        np.testing.assert_allclose(torch.cat(pictures).detach(), without, rtol=0, atol=1e-6)
        return without, given.grad

    assert BLOCKS["cpu"] == 4
    whole, apart = drawn([slice(0, 6)]), drawn([slice(0, 4), slice(4, 6)])
    np.testing.assert_allclose(whole[0], apart[0], rtol=0, atol=1e-6)  # single precision's rounding
    np.testing.assert_allclose(whole[1], apart[1], rtol=1e-4, atol=1e-4 * float(apart[1].abs().max()))
    assert whole[1].abs().max() > 1


def test_gradients_by_the_displacement_are_those_of_differences(translator):
    batch = BatchPictures(translator).double()
    given = torch.from_numpy(dents()[2:3]).double()
    way = torch.from_numpy(np.random.default_rng(0).standard_normal(given.shape)) * 1e-4 * (given[..., 1:2] > 1e-5)
    weight = torch.from_numpy(np.random.default_rng(1).standard_normal((20, 15, 3))).repeat_interleave(16, 0)
    weight = weight.repeat_interleave(16, 1)

    def value(gel):
        return (batch.pictures(gel) * weight).sum()

    at = given.clone().requires_grad_()
    value(at).backward()
    with torch.no_grad():
        step = 1e-2
        found = float(value(given + step * way) - value(given - step * way)) / (2 * step)
    assert float((at.grad * way).sum()) == pytest.approx(found, rel=0.02)


def test_what_it_cannot_do_is_said(translator, signals):
    with pytest.raises(TactileError, match="device"):
        BatchPictures(translator, device="tpu")
    with pytest.raises(TactileError, match=r"batch, calibration: of a gelsight_mini"):
        BatchPictures(translator, load_calibration(None, "gelsight_mini"))
    with pytest.raises(TactileError, match="dots"):
        BatchPictures(translator, dataclasses.replace(load_calibration(), markers=Markers(7, 9, 2e-3, 0.5e-3, 0.1)))
    high = torch.from_numpy(30 * dents()[:1])
    with pytest.raises(TactileError, match="a gel below LEDs and camera"):
        BatchPictures(translator).pictures(high)
