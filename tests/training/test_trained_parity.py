"""The shipped weights in numpy and in torch: relative 1e-5 on the signals of light and firm touches."""

from __future__ import annotations

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="training needs torch")

from tactile_core import networks  # noqa: E402
from tactile_core.training import modules  # noqa: E402

# float32 sums of up to 11,000 terms through eight layers; measured 1e-7 to 2e-6 of the largest value
TOLERANCE = 1e-5


@pytest.fixture(scope="module")
def nets():
    if not (networks.WEIGHTS_FOLDER / "card.json").exists():
        pytest.skip("no weights ship with this checkout")
    return networks.load()


@pytest.fixture(scope="module")
def change():
    rng = np.random.default_rng(0)
    return (rng.standard_normal((64, 19)) * np.logspace(0, 2.5, 64)[:, None]).astype(np.float32)


def filled(module, nets, net, prefix=""):
    """The torch module with the weights of a numpy network."""
    names = module.state_dict()
    module.load_state_dict({name: torch.tensor(nets.tensors[net][prefix + name]) for name in names})
    return module.requires_grad_(False)


def mesh_vae(nets, net):
    sizes = nets.sizes[net]
    return filled(modules.mesh_vae(sizes["modes"], sizes["latent"], sizes["width"], sizes["blocks"]), nets, net)


def residual(nets, net):
    sizes = nets.sizes[net]
    return filled(
        modules.Residual(sizes["inputs"], sizes["outputs"], sizes["width"], sizes["blocks"]), nets, net, "map."
    )


def same(found, expected):
    expected = expected.numpy().reshape(found.shape)
    assert np.abs(expected).max() > 0
    assert np.abs(found - expected).max() <= TOLERANCE * np.abs(expected).max()


def test_every_network_alone(nets, change):
    svb = filled(modules.signal_vae(nets.sizes["SVB"]["latent"]), nets, "SVB")
    latent = nets.encode_signal(change)
    same(latent, svb.mean(modules.compress(torch.from_numpy(change))))
    same(networks.compress(nets.decode_signal(latent)), svb.decoder(torch.from_numpy(latent)))
    biotac = nets.s2m(latent)
    same(biotac, residual(nets, "S2MPN")(torch.from_numpy(latent)))
    digit = nets.m2m(biotac)
    same(digit, residual(nets, "M2MPN")(torch.from_numpy(biotac)))
    if not nets.sizes["force"]["compliance"]:
        scale = torch.tensor(nets.tensors["force"]["scale"])
        same(nets.force(biotac), residual(nets, "force")(torch.from_numpy(biotac)) * scale)
    for net, name, z in (("MVB", "biotac", biotac), ("MVD", "digit", digit)):
        vae = mesh_vae(nets, net)
        basis, scale = (torch.tensor(nets.tensors[net][part]) for part in ("basis", "scale"))
        displacement = getattr(nets, f"decode_{name}")(z)
        same(displacement, vae.decoder(torch.from_numpy(z)) * scale @ basis)
        modes = torch.from_numpy(displacement).flatten(1) @ basis.T / scale
        same(getattr(nets, f"encode_{name}")(displacement), vae.mean(modes))


def test_the_chain(nets, change):
    svb = filled(modules.signal_vae(nets.sizes["SVB"]["latent"]), nets, "SVB")
    z = residual(nets, "M2MPN")(residual(nets, "S2MPN")(svb.mean(modules.compress(torch.from_numpy(change)))))
    basis, scale = (torch.from_numpy(nets.tensors["MVD"][part]) for part in ("basis", "scale"))
    expected = mesh_vae(nets, "MVD").decoder(z) * scale @ basis
    found = nets.decode_digit(nets.m2m(nets.s2m(nets.encode_signal(change))))
    same(found, expected)
