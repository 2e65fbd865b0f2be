"""The numpy forward passes against torch, on random weights of the shipped sizes: relative 1e-5."""

import numpy as np
import pytest

torch = pytest.importorskip("torch", reason="training needs torch")

from tactile_core.training import modules  # noqa: E402
from tactile_core.training.data import Contacts  # noqa: E402
from tactile_core.training.export_weights import net_sizes, net_tensors  # noqa: E402
from tactile_core.training.options import Options  # noqa: E402
from tactile_core.training.stages import Model  # noqa: E402
from tactile_core.training.surface_codec import SurfaceCodec  # noqa: E402
from tactile_core.translation.card import NETS, SURFACES  # noqa: E402
from tactile_core.translation.contact_frame import ContactFrame  # noqa: E402
from tactile_core.translation.layers import compress  # noqa: E402
from tactile_core.translation.networks import Networks  # noqa: E402
from tactile_core.translation.posterior import FORCE_SCALE  # noqa: E402

OPTIONS = Options()
SHAPES = {"biotac": (30, 28), "digit": (36, 34)}  # smaller lattices: how long a basis is does not matter
# float32 sums of up to 3,700 terms through eight layers; measured below 3e-6 of the largest value
TOLERANCE = 1e-5


def random_surface(name, rng):
    """A surface with random bases of the shipped sizes, as far as networks look at it."""
    rows, columns = SHAPES[name]
    surface = SurfaceCodec.__new__(SurfaceCodec)
    wide, near, half = (getattr(OPTIONS, f"{what}_{name}") for what in ("wide", "near", "half"))
    turn = rng.uniform(-1, 1, rows * columns).astype(np.float32)
    surface.frame = ContactFrame(rows, columns, half, turn)
    surface.data = np.zeros((1, rows * columns, 3), np.int16)
    sizes = {"wide": (wide, 3 * rows * columns), "near": (near, 3 * surface.frame.width**2)}
    for basis, size in sizes.items():  # float16, as they ship
        random = rng.standard_normal(size) / np.sqrt(size[1])
        setattr(surface, basis, torch.from_numpy(random.astype(np.float16).astype(np.float32)))
    surface.scale = torch.from_numpy(rng.uniform(1e-4, 1e-3, wide + near).astype(np.float32))
    surface.modes = torch.zeros(1, wide + near)
    return surface


@pytest.fixture(scope="module")
def contacts():
    rng = np.random.default_rng(5)
    contacts = Contacts.__new__(Contacts)
    contacts.options, contacts.electrodes = OPTIONS, 19
    contacts.biotac, contacts.digit = (random_surface(name, rng) for name in SURFACES)
    return contacts


@pytest.fixture(scope="module")
def model(contacts):
    generator = torch.Generator().manual_seed(5)
    model = Model(OPTIONS, contacts, generator)
    for parameter in model.parameters():  # no zero layers and no unit norms: every term must count
        parameter.data.normal_(0.0, 1.0 / parameter.shape[-1] ** 0.5, generator=generator)
        parameter.data = parameter.data.half().float()
    return model.requires_grad_(False)


@pytest.fixture(scope="module")
def nets(model, contacts):
    sizes = net_sizes(contacts)
    tensors = {net: net_tensors(net, model, contacts) for net in NETS}
    return Networks(tensors, {"nets": {net: {"sizes": sizes[net]} for net in NETS}})


def same(found, expected):
    """Largest difference against the largest value."""
    expected = expected.detach().numpy()
    assert np.abs(expected).max() > 0
    assert np.abs(found - expected.reshape(found.shape)).max() <= TOLERANCE * np.abs(expected).max()


def latent(size):
    return np.random.default_rng(size).standard_normal((40, size)).astype(np.float32)


def signals():
    """Changes (40, 19) from light to firm, whether they are rectified (40,), and both as torch sees them."""
    change = (np.random.default_rng(0).standard_normal((40, 19)) * np.logspace(0, 3, 40)[:, None]).astype(np.float32)
    rectified = np.arange(40) % 3 == 0
    read = np.where(rectified[:, None], -np.abs(change), change)  # rectified readings have the sign of a thinning film
    both = np.concatenate([read, rectified[:, None]], -1).astype(np.float32)
    return change, rectified, torch.from_numpy(both)


def test_svb(model, nets):
    change, rectified, both = signals()
    same(nets.encode_signal(change, rectified), model.SVB.mean(modules.compress(both)))
    same(compress(nets.decode_signal(latent(16))), model.SVB.decoder(torch.from_numpy(latent(16))))


@pytest.mark.parametrize("name", SURFACES)
def test_mesh_autoencoders(model, nets, contacts, name):
    net, role = {"biotac": ("MVB", "source"), "digit": ("MVD", "target")}[name]
    surface = getattr(contacts, name)
    vae, frame = getattr(model, net), surface.frame
    z = latent(nets.sizes[net]["latent"])
    displacement = getattr(nets, f"decode_{role}")(z)
    same(frame.to_local(displacement), vae.field(torch.from_numpy(z)))
    local = frame.to_local(displacement)
    place = frame.place(local)
    cells, left = frame.cells(place)
    wide = torch.from_numpy(local).flatten(1) @ surface.wide.T
    rest = torch.from_numpy(local).flatten(1) - wide @ surface.wide
    windows = torch.from_numpy(frame.windows(rest.view(local.shape).numpy(), cells)).flatten(1)
    seen = torch.cat([wide, windows @ surface.near.T], -1) / surface.scale
    x = torch.cat([seen, torch.from_numpy(np.concatenate([place, left], -1))], -1)
    same(getattr(nets, f"encode_{role}")(displacement), vae.mean(x))


def test_maps(model, nets):
    biotac, digit = (torch.from_numpy(latent(nets.sizes[net]["latent"])) for net in ("MVB", "MVD"))
    rectified = np.arange(len(latent(16))) % 3 == 0
    z = torch.from_numpy(latent(16))
    signed, folded = (net.given(z, net.contact(z)) for net in (model.S2MPN, model.R2MPN))
    same(nets.likely_latents(latent(16))[0], signed)
    either = torch.where(torch.from_numpy(rectified)[:, None], folded, signed)
    same(nets.likely_latents(latent(16), rectified)[0], either)
    same(nets.m2m(biotac.numpy()), model.across(biotac))
    state = latent(4)[:40]
    both = torch.from_numpy(state), biotac[:40]
    same(nets.to_target(*(each.numpy() for each in both)), model.to_target(*both))
    same(nets.m2m_back(digit.numpy()), model.back(digit))
    same(compress(nets.decode_signal(nets.m2s(biotac.numpy()))), model.to_signal(biotac))
    state = np.abs(latent(4))
    size = np.linalg.norm(nets.force_in(state, biotac.numpy()[:40]), axis=-1)
    np.testing.assert_allclose(size, FORCE_SCALE * np.sinh(state[:, 2]), rtol=1e-5)
    same(nets.force(biotac.numpy()), FORCE_SCALE * torch.sinh(model.force(biotac)))


def test_the_surprise_is_that_of_a_mixture_of_gaussians(model):
    z, state = (torch.from_numpy(latent(size)) for size in (16, 4))
    weight, mean, spread = model.S2MPN.mixture(z)
    parts = torch.distributions.Independent(torch.distributions.Normal(mean, spread), 1)
    mixture = torch.distributions.MixtureSameFamily(torch.distributions.Categorical(logits=weight), parts)
    constant = 2 * np.log(2 * np.pi)  # of four numbers, which the surprise leaves out
    torch.testing.assert_close(model.S2MPN.surprise(z, state), -mixture.log_prob(state) - constant)


def test_the_answer_lies_among_the_components_of_the_heaviest_place(model, nets):
    z = latent(16)
    found = nets.posterior(z)
    same(found.likely, model.S2MPN.contact(torch.from_numpy(z)))
    same(nets.likely_latents(z)[0], model.S2MPN.given(*(torch.from_numpy(each) for each in (z, found.likely))))


def test_posterior(model, nets):
    z, rectified = latent(16), np.arange(len(latent(16))) % 3 == 0
    found = nets.posterior(z, rectified)
    for net, which in ((model.S2MPN, ~rectified), (model.R2MPN, rectified)):
        weight, mean, spread = net.mixture(torch.from_numpy(z[which]))
        same(found.weight[which], weight.exp())
        same(found.mean[which], mean)
        same(found.spread[which], spread)


def test_expected_error(model, nets):
    change, rectified, both = signals()
    found = np.log(nets.expected_error(change, rectified) / 10e-6)
    same(found, model.expected_error(both).clamp(-8, 8))


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
