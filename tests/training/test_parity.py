"""The numpy forward passes against torch, on random weights of the shipped sizes: relative 1e-5."""

from __future__ import annotations

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="training needs torch")

from tactile_core.networks import NETS, Networks, compress  # noqa: E402
from tactile_core.training import modules  # noqa: E402
from tactile_core.training.options import Options  # noqa: E402
from tactile_core.training.stages import FORCE_BLOCKS, FORCE_WIDTH, Model  # noqa: E402

OPTIONS = Options()
BIOTAC, DIGIT = 400, 300  # nodes: the basis is a plain product, its length does not matter
# float32 sums of up to 1,200 terms through eight layers; measured below 2e-6 of the largest value
TOLERANCE = 1e-5


@pytest.fixture(scope="module")
def model():
    generator = torch.Generator().manual_seed(5)
    model = Model(OPTIONS, OPTIONS.modes_biotac, OPTIONS.modes_digit, generator)
    for parameter in model.parameters():  # no zero layers and no unit norms: every term must count
        parameter.data.normal_(0.0, 1.0 / parameter.shape[-1] ** 0.5, generator=generator)
    return model


@pytest.fixture(scope="module")
def bases():
    rng = np.random.default_rng(5)
    shapes = {"MVB": (OPTIONS.modes_biotac, 3 * BIOTAC), "MVD": (OPTIONS.modes_digit, 3 * DIGIT)}
    return {net: (rng.standard_normal(shape) / np.sqrt(shape[1])).astype(np.float32) for net, shape in shapes.items()}


@pytest.fixture(scope="module")
def nets(model, bases):
    common = {"width": OPTIONS.width, "blocks": OPTIONS.blocks}
    signal, biotac, digit = OPTIONS.latent_signal, OPTIONS.latent_biotac, OPTIONS.latent_digit
    sizes = {
        "SVB": {"latent": signal},
        "MVB": {"latent": biotac, "modes": OPTIONS.modes_biotac, "nodes": BIOTAC, **common},
        "MVD": {"latent": digit, "modes": OPTIONS.modes_digit, "nodes": DIGIT, **common},
        "S2MPN": {"inputs": signal, "outputs": biotac, **common},
        "M2MPN": {"inputs": biotac, "outputs": digit, **common},
        "force": {"inputs": biotac, "outputs": 3, "compliance": 0, "width": FORCE_WIDTH, "blocks": FORCE_BLOCKS},
    }
    tensors = {}
    for net in NETS:
        prefix = "map." if net in ("S2MPN", "M2MPN", "force") else ""
        tensors[net] = {prefix + name: value.numpy() for name, value in getattr(model, net).state_dict().items()}
    for net, basis in bases.items():
        tensors[net] |= {"basis": basis, "scale": np.float32([2e-3])}
    tensors["force"]["scale"] = np.float32([3.0])
    return Networks(tensors, {"nets": {net: {"sizes": sizes[net]} for net in NETS}})


def same(found, expected):
    """Largest difference against the largest value."""
    expected = expected.detach().numpy()
    assert np.abs(expected).max() > 0
    assert np.abs(found - expected.reshape(found.shape)).max() <= TOLERANCE * np.abs(expected).max()


def latent(size):
    return np.random.default_rng(size).standard_normal((40, size)).astype(np.float32)


def test_svb(model, nets):
    change = (np.random.default_rng(0).standard_normal((40, 19)) * np.logspace(0, 3, 40)[:, None]).astype(np.float32)
    same(nets.encode_signal(change), model.SVB.mean(modules.compress(torch.from_numpy(change))))
    same(compress(nets.decode_signal(latent(8))), model.SVB.decoder(torch.from_numpy(latent(8))))


@pytest.mark.parametrize(("net", "name"), [("MVB", "biotac"), ("MVD", "digit")])
def test_mesh_autoencoders(model, nets, bases, net, name):
    vae, basis = getattr(model, net), torch.from_numpy(bases[net])
    displacement = 1e-3 * np.random.default_rng(1).standard_normal((40, basis.shape[1] // 3, 3)).astype(np.float32)
    modes = torch.from_numpy(displacement).flatten(1) @ basis.T / 2e-3
    same(getattr(nets, f"encode_{name}")(displacement), vae.mean(modes))
    z = latent(nets.sizes[net]["latent"])
    same(getattr(nets, f"decode_{name}")(z), vae.decoder(torch.from_numpy(z)) * 2e-3 @ basis)


@pytest.mark.parametrize(
    ("net", "method", "scale"), [("S2MPN", "s2m", 1.0), ("M2MPN", "m2m", 1.0), ("force", "force", 3.0)]
)
def test_maps(model, nets, net, method, scale):
    z = latent(nets.sizes[net]["inputs"])
    same(getattr(nets, method)(z), getattr(model, net)(torch.from_numpy(z)) * scale)


def test_sampled_latent_has_the_posterior_it_says():
    """Mean, spread and KL of the reparameterised sample against the closed form, for one posterior."""
    vae = modules.Vae(torch.nn.Identity(), torch.nn.Identity())
    x = torch.tensor([[0.5, -1.0, np.log(0.25), 0.0]], dtype=torch.float32).repeat(20_000, 1)
    z, divergence = vae.sample(x, torch.Generator().manual_seed(0))
    # 20,000 draws: standard error of the mean 0.007, so 5 of them
    torch.testing.assert_close(z.mean(0), torch.tensor([0.5, -1.0]), atol=0.035, rtol=0)
    torch.testing.assert_close(z.std(0), torch.tensor([0.5, 1.0]), atol=0.035, rtol=0)
    normal = torch.distributions.Normal
    parts = torch.distributions.kl_divergence(
        normal(torch.tensor([0.5, -1.0]), torch.tensor([0.5, 1.0])), normal(0.0, 1.0)
    )
    torch.testing.assert_close(divergence, parts.sum())
