"""The shipped weights in numpy and in torch: relative 1e-5 on the signals of light and firm touches."""

from __future__ import annotations

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="training needs torch")

from tactile_core.training import modules  # noqa: E402
from tactile_core.translation import network_sizes, networks  # noqa: E402

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


def residual(nets, net):
    sizes = nets.sizes[net]
    size = (sizes["inputs"], sizes["outputs"], sizes["width"], sizes["blocks"])
    return filled(modules.Residual(*size), nets, net, "map.")


def posterior(nets, net):
    sizes = nets.sizes[net]
    size = (sizes[name] for name in ("inputs", "outputs", "width", "blocks", "components"))
    return filled(modules.ContactPosterior(*size), nets, net)


def decoder(nets, net):
    """The decoder of a mesh autoencoder, without its frame."""
    sizes = nets.sizes[net]
    size = (sizes["latent"] + network_sizes.PLACE, sizes["wide"] + sizes["near"], sizes["width"], sizes["blocks"])
    return filled(modules.Residual(*size), nets, net, "decoder.")


def placed(nets, net, latent):
    left = nets.frames[net].cells(latent[:, : network_sizes.PLACE])[1]
    return torch.from_numpy(np.concatenate([latent, left], -1))


def same(found, expected):
    expected = expected.numpy().reshape(found.shape)
    assert np.abs(expected).max() > 0
    assert np.abs(found - expected).max() <= TOLERANCE * np.abs(expected).max()


@pytest.mark.parametrize("rectified", [False, True])
def test_the_chain(nets, change, rectified):
    svb = filled(modules.signal_vae(nets.sizes["SVB"]["latent"]), nets, "SVB")
    said = np.full((len(change), 1), rectified, np.float32)
    change = -np.abs(change) if rectified else change
    latent = nets.encode_signal(change, rectified)
    same(latent, svb.mean(modules.compress(torch.from_numpy(np.concatenate([change, said], -1)))))
    biotac, _ = nets.likely_latents(latent, rectified)
    same(biotac, posterior(nets, "R2MPN" if rectified else "S2MPN")(torch.from_numpy(latent)))
    digit = nets.m2m(biotac)
    same(digit, residual(nets, "M2MPN")(placed(nets, "MVB", biotac)))
    for net, z, decode in (("MVB", biotac, nets.decode_biotac), ("MVD", digit, nets.decode_digit)):
        modes = decoder(nets, net)(placed(nets, net, z)) * torch.tensor(nets.tensors[net]["scale"])
        wide = nets.sizes[net]["wide"]
        whole = modes[:, :wide] @ torch.tensor(nets.tensors[net]["wide"])
        frame, near = nets.frames[net], modes[:, wide:] @ torch.tensor(nets.tensors[net]["near"])
        cells = frame.cells(z[:, : network_sizes.PLACE])[0]
        windows = near.view(len(z), frame.width, frame.width, 3).numpy()
        expected = frame.to_shared(frame.add(whole.view(len(z), -1, 3).numpy(), windows, cells))
        same(decode(z), torch.from_numpy(expected))
