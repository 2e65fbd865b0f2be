"""Train the network that separates the signals of two contacts, on sums of two simulated ones.

Contacts far apart bend the skin independently, so the electrodes respond about as to the sum of both (the fluid, which
both press, is neglected). A sum has no first and second: the error counts in the order in which it is smaller."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import torch
from torch import Tensor, nn

from ..simulation.pairs_file import Split
from ..translation.layers import COUNT_SCALE
from ..translation.second_contact import FINE, PARTED
from .data import measured
from .modules import Residual, initialise, take_step
from .options import Options
from .surface_codec import image_of_electrodes

WIDTH, BLOCKS = 256, 3
BATCH = 512
APART = (4e-3, 15e-3)  # m, between two contacts: nearer ones count as one, and the gel is 19 mm wide
LIGHTEST = 0.25  # least force over the other's: lighter ones are lost in the other's noise (assumed)
TRIES = 4  # pairs drawn for each one wanted: one in three lies as far apart
SINGLE = 0.99  # share of single contacts on validation presses that are not separated
SINGLES = 20_000  # contacts that determine the threshold for it


@dataclass(frozen=True)
class Presses:
    """Simulated contacts: signal (C, e) counts, true changes; place (C, 2) = (x, z) m on the gel; force (C,) N."""

    signal: np.ndarray
    place: np.ndarray
    force: np.ndarray


def train_parts(
    presses: Presses, split: Split, options: Options, rest: np.ndarray, sensor: str, seed: int,
    progress: Callable[[float, str], None],
) -> dict[str, np.ndarray]:  # fmt: skip
    """Train on the split's training presses; return tensors by `networks.py`'s names, equal for equal arguments.
    rest : (e,) counts from which changes are counted; sensor : name of the one with these electrodes; seed : of draws
    progress : called now and then with the share done (0 to 1) and a line of text"""
    random, generator = np.random.default_rng([seed, BATCH]), torch.Generator().manual_seed(seed)
    network, image = Residual(**parts_sizes(len(rest))), image_of_electrodes(sensor)
    initialise(network, generator)
    optimiser = torch.optim.AdamW(network.parameters(), lr=options.rate, weight_decay=options.weight_decay)
    steps = max(1, round(options.effort * options.parts_steps))
    for step in range(steps):
        share = (step + 1) / steps
        loss_of_batch = partial(parts_loss, network, *_drawn(presses, split.train, options, rest, image, random))
        loss = take_step(optimiser, loss_of_batch, share, options.rate)
        if step % 100 == 99 or step + 1 == steps:
            progress(share, f"parts {step + 1}/{steps}: loss {loss:.4f}")
    tensors = {f"map.{name}": tensor.numpy().astype(np.float16) for name, tensor in network.state_dict().items()}
    alone = presses.signal[random.choice(split.validation, SINGLES)]
    read = torch.from_numpy(measured(alone, random, options, 0.0, options.unit, rest)[:, :-1])
    with torch.no_grad():
        likely = network(network_input(read))[:, -1].numpy()
    return tensors | {"single": np.array([np.quantile(likely, SINGLE)], np.float32)}


def parts_sizes(electrodes: int) -> dict[str, int]:
    """Return inputs, outputs, width, blocks of the `Residual` that maps ``network_input`` of so many electrodes to half
    the difference of both parts' signals and the logit of there being two."""
    return {"inputs": 2 * electrodes, "outputs": electrodes + 1, "width": WIDTH, "blocks": BLOCKS}


def network_input(change: Tensor) -> Tensor:
    """Convert change (B, e) counts to the network's input (B, 2e): arcsinh(change / 15), then arcsinh(change / 3)."""
    return torch.cat([torch.asinh(change / COUNT_SCALE), torch.asinh(FINE * change / COUNT_SCALE)], -1)


def parts_loss(network: Residual, read: Tensor, first: Tensor, second: Tensor) -> Tensor:
    """Return the parts' squared error, mean over samples of two contacts, plus the cross entropy of one or two.
    read : (B, e) counts; first, second : (B, e) true changes of the contacts, the second all zero for one contact"""
    found, two = network(network_input(read)), second.abs().amax(-1) > 0
    half = found[:, :-1] * read.square().sum(-1, keepdim=True).sqrt() * PARTED
    parts = read / 2 + half, read / 2 - half
    orders = torch.stack([_apart(parts, true) for true in ((first, second), (second, first))])
    error = (orders.amin(0) * two).sum() / two.sum().clamp(min=1)
    return error + nn.functional.binary_cross_entropy_with_logits(found[:, -1], two.float())


def _apart(parts: tuple[Tensor, Tensor], true: tuple[Tensor, Tensor]) -> Tensor:
    """Return the squared error (B,) of both parts (B, e) from the true ones, in asinh(counts / 3), mean over e."""
    fine = [torch.asinh(FINE * each / COUNT_SCALE) for each in (*parts, *true)]
    return ((fine[0] - fine[2]).square() + (fine[1] - fine[3]).square()).mean(-1)


def _drawn(
    presses: Presses, rows: np.ndarray, options: Options, rest: np.ndarray, image: np.ndarray,
    random: np.random.Generator,
) -> tuple[Tensor, Tensor, Tensor]:  # fmt: skip
    """Draw a batch of the contacts rows, half of it sums of two: return readings (B, e), and both contacts' true
    changes (B, e), counts. rest : (e,) counts of the unit; image : (e,) int, the mirror image of each electrode"""
    first, second = random.choice(rows, (2, TRIES * BATCH // 2))
    apart = np.linalg.norm(presses.place[first] - presses.place[second], axis=1)
    ratio = presses.force[first] / presses.force[second]
    good = (apart > APART[0]) & (apart < APART[1]) & (ratio > LIGHTEST) & (ratio < 1 / LIGHTEST)
    chosen = np.flatnonzero(good)[: BATCH // 2]
    alone = random.choice(rows, BATCH - len(chosen))
    one = presses.signal[np.concatenate([first[chosen], alone])]
    two = np.zeros_like(one)
    two[: len(chosen)] = presses.signal[second[chosen]]
    turned = random.random(BATCH) < options.mirrored
    one[turned], two[turned] = one[turned][:, image], two[turned][:, image]
    read = measured(one + two, random, options, 0.0, options.unit, rest)[:, :-1]
    return tuple(torch.from_numpy(np.asarray(each, np.float32)) for each in (read, one, two))
