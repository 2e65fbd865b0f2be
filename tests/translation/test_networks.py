"""The numpy networks on random weights: shapes, verification when loaded, and the same answer in any batch."""

import json
import shutil

import numpy as np
import pytest

from tactile_core.errors import TactileError
from tactile_core.translation import card as cards
from tactile_core.translation import layers, networks, weights

NODES = {"biotac": 30, "digit": 24}
MLP = {"width": 16, "blocks": 2}
SIZES = {
    "SVB": {"latent": 8},
    "MVB": {"latent": 6, "wide": 5, "near": 7, "nodes": NODES["biotac"], "rows": 7, "columns": 4, "half": 1, **MLP},
    "S2MPN": {"inputs": 8, "outputs": 6, "components": 3, **MLP},
    "R2MPN": {"inputs": 8, "outputs": 6, "components": 3, **MLP},
    "MVD": {"latent": 7, "wide": 4, "near": 9, "nodes": NODES["digit"], "rows": 6, "columns": 4, "half": 2, **MLP},
    "M2MPN": {"inputs": 8, "outputs": 7, **MLP},
    "D2BPN": {"inputs": 9, "outputs": 6, **MLP},
    "B2SPN": {"inputs": 8, "outputs": 8, **MLP},
    "force": {"inputs": 6, "outputs": 3, "width": 8, "blocks": 1},
    "pressure": {"inputs": 19, "outputs": 1, "width": 8, "blocks": 1},
    "error": {"inputs": 11, "outputs": 2, "width": 8, "blocks": 1},
}


def random_tensors(sizes):
    """Weights of the size of trained ones, float16 as they ship."""
    rng = np.random.default_rng(0)
    tensors = {}
    for net in cards.NETS:
        tensors[net] = {}
        for name, shape in cards.tensor_shapes(net, sizes[net]).items():
            values = rng.standard_normal(shape) / np.sqrt(shape[-1])
            if name in ("scale", "distance.residual"):
                values = np.full(shape, 1e-3 if name == "scale" else 0.1)
            tensors[net][name] = values.astype(np.float16)
    return tensors


def write_folder(folder, sizes=SIZES):
    """A weights folder as `tactile train` writes it, as far as loading is concerned."""
    folder.mkdir(exist_ok=True)
    nets = {}
    for net, tensors in random_tensors(sizes).items():
        data = weights.to_safetensors(tensors)
        weights.write_bytes(folder / f"{net}.safetensors", data)
        nets[net] = {"sha256": weights.sha256(data), "sizes": sizes[net]}
    weights.write_bytes(
        folder / weights.CARD_NAME,
        weights.card_bytes({"format": weights.CARD_FORMAT, "polarity": "falls", "nets": nets}),
    )
    return folder


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return write_folder(tmp_path_factory.mktemp("weights"))


@pytest.fixture(scope="module")
def nets(folder):
    return networks.load(folder)


def calls(nets, count):
    """Every forward pass with its input and the trailing shape of its result."""
    rng = np.random.default_rng(count)
    change = (100 * rng.standard_normal((count, 19))).astype(np.float32)
    latents = {size: rng.standard_normal((count, size)).astype(np.float32) for size in (6, 7, 8)}
    meshes = {name: (1e-3 * rng.standard_normal((count, size, 3))).astype(np.float32) for name, size in NODES.items()}
    return {
        "encode_signal": (nets.encode_signal, change, (8,)),
        "decode_signal": (nets.decode_signal, latents[8], (19,)),
        "likely_latents": (lambda z: nets.likely_latents(z)[0], latents[8], (6,)),
        "contact": (nets.contact, latents[8], (4,)),
        "m2m": (nets.m2m, latents[6], (7,)),
        "decode_source": (nets.decode_source, latents[6], (NODES["biotac"], 3)),
        "decode_target": (nets.decode_target, latents[7], (NODES["digit"], 3)),
        "encode_source": (nets.encode_source, meshes["biotac"], (6,)),
        "encode_target": (nets.encode_target, meshes["digit"], (7,)),
        "m2m_back": (nets.m2m_back, latents[7], (6,)),
        "m2s": (nets.m2s, latents[6], (8,)),
        "force": (nets.force, latents[6], (3,)),
        "pressure": (nets.pressure, change, ()),
        "expected_error": (nets.expected_error, change, (2,)),
    }


@pytest.mark.parametrize("count", [0, 1, layers.BLOCK, 2 * layers.BLOCK + 3])
def test_shapes_and_dtype(nets, count):
    for name, (function, x, shape) in calls(nets, count).items():
        result = function(x)
        assert result.shape == (count, *shape) and result.dtype == np.float32, name
        assert np.isfinite(result).all(), name
    distance = nets.signal_distance(calls(nets, count)["encode_signal"][1])
    assert distance.mahalanobis.shape == distance.residual.shape == distance.largest.shape == (count,)


def test_pressure_of_rectified_changes_grows_with_their_sum_whatever_their_pattern(nets):
    change = np.abs(calls(nets, 3)["encode_signal"][1])
    expected = nets.tensors["pressure"]["rectified"] * change.sum(-1)
    np.testing.assert_allclose(nets.pressure(change[:, ::-1], True), expected, rtol=1e-5)
    np.testing.assert_allclose(nets.pressure(2 * change, True), 2 * expected, rtol=1e-5)
    assert not np.allclose(nets.pressure(change), expected)


def test_a_frame_does_not_depend_on_its_neighbours(nets):
    count = 3 * layers.BLOCK + 1
    for name, (function, x, _) in calls(nets, count).items():
        together = function(x)
        for start, stop in ((0, 1), (5, 6), (7, 30)):
            # equal bits where the matrix product treats rows alike; a BLAS may not: rounding of sums of up to 90 terms
            scale = np.abs(together).max()
            np.testing.assert_allclose(
                function(x[start:stop]), together[start:stop], rtol=0, atol=1e-5 * scale, err_msg=name
            )


def test_wrong_input_says_what_is_expected(nets):
    with pytest.raises(TactileError, match=r"encode_signal: array of shape \(5, 24\); expected \(T, 19\)"):
        nets.encode_signal(np.zeros((5, 24)))
    with pytest.raises(TactileError, match=r"MVB encoder.*\(T, 30, 3\)"):
        nets.encode_source(np.zeros((5, 24, 3)))


def test_compress_and_expand_are_inverse():
    change = np.array([-3300, -15, -1, 0, 1, 15, 795, 4095], np.float32)
    np.testing.assert_allclose(layers.expand(layers.compress(change)), change, rtol=1e-5)  # float32, exp of up to 6.3
    assert np.isfinite(layers.expand(np.float32([1e9, -1e9]))).all()


def test_silu_does_not_overflow():
    with np.errstate(all="raise"):
        np.testing.assert_allclose(layers.silu(np.float32([-200, 0, 200])), [0, 0, 200], atol=1e-6)


def test_distance_grows_with_distance(nets):
    change = np.outer([0, 10, 100, 4000], np.ones(19))
    distance = nets.signal_distance(change)
    np.testing.assert_array_equal(distance.largest, [0, 10, 100, 4000])
    assert (np.diff(distance.residual) > 0).all()


def test_rectified_signals_are_read_as_such(nets):
    change = np.abs(calls(nets, 8)["encode_signal"][1])
    said = np.arange(8) % 2 == 1
    mixed, signed, folded = (nets.encode_signal(change, each) for each in (said, False, True))
    np.testing.assert_array_equal(mixed[said], folded[said])
    np.testing.assert_array_equal(mixed[~said], signed[~said])
    assert np.abs(folded - signed).max() > 0.01


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda card: card.pop("nets"), "nets.SVB"),
        (lambda card: card["nets"].pop("M2MPN"), "nets.M2MPN"),
        (lambda card: card["nets"]["MVB"]["sizes"].pop("wide"), "nets.MVB"),
        (lambda card: card["nets"]["MVB"]["sizes"].update(wide="12"), "nets.MVB"),
        (lambda card: card["nets"]["MVB"]["sizes"].update(rows=8), "nets.MVB: a lattice of 8 x 4"),
        (lambda card: card["nets"]["SVB"].pop("sha256"), "nets.SVB"),
        (lambda card: card.update(format="tactile-weights-9"), "tactile-weights-9"),
    ],
)
def test_wrong_cards_are_refused(folder, tmp_path, change, message):
    copy = shutil.copytree(folder, tmp_path / "w")
    card = json.loads((copy / "card.json").read_text())
    change(card)
    (copy / "card.json").write_text(json.dumps(card))
    with pytest.raises(TactileError, match=message):
        networks.load(copy)


def test_networks_that_do_not_fit_together_are_refused(tmp_path):
    sizes = SIZES | {"M2MPN": SIZES["M2MPN"] | {"inputs": 5}}
    with pytest.raises(TactileError, match=r"nets\.M2MPN: inputs 5; expected 8"):
        networks.load(write_folder(tmp_path / "w", sizes))
