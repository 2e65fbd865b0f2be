"""Training of the baseline after ACROSS on a file of pairs, and its errors on the test contacts.

    python scripts/benchmark.py --across PAIRS      calls `measure` and keeps its rows in across_rows.json

Losses and rates are the published ones. Passes over the data are as many as fit the CPU time that our networks take
for 10,000 pairs, four minutes, in batches of 32 meshes instead of 128: one of the mesh networks in place of 300. So the
rows compare what a budget buys, and do not tell how far these networks come in hours.
"""

from __future__ import annotations

import concurrent.futures
import multiprocessing
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn

from benchmarks.translation.noise import as_read
from benchmarks.translation.test_set import SEED
from tactile_core import accuracy, sensors
from tactile_core.accuracy import Row, row
from tactile_core.simulation.pairs_file import Pairs, read_pairs, split_presses
from tactile_core.training.error_summary import metric_rows
from tactile_core.training.noise_model import measured
from tactile_core.training.options import Options
from tactile_core.training.step_errors import mesh_columns, true_displacement
from tactile_core.translation.networks import COUNT_SCALE

from .across_networks import Across, MeshVae, SignalVae

SENSORS = "biotac", "digit"
KL = 0.005  # weight, of the divergence a number of the latent: the mildest reading of what is published
MESH_EPOCHS, MESH_BATCH, MESH_RATE, MESH_DECAY = 1, 32, 1e-3, 0.99
SIGNAL_EPOCHS, SIGNAL_BATCH, SIGNAL_RATE = 60, 64, 1e-4
MAP_EPOCHS, MAP_BATCH, S2MPN_RATE, M2MPN_RATE = 12, 256, 5e-4, 1e-3
Batches = Callable[[np.ndarray], tuple[Tensor, Tensor]]  # numbers of contacts -> input and target


def measure(pairs_file: Path, test_file: Path, seed: int = 0) -> list[Row]:
    """Train on one file, in two processes; rows of every step's error on the other, and of CPU time."""
    with concurrent.futures.ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as pool:
        meshes = list(pool.map(trained_mesh, [pairs_file] * 2, SENSORS, [seed] * 2))
    pairs = read_pairs(pairs_file)
    rows = split_presses(pairs.press, seed, pairs_file).train
    model, began = Across(sensors.biotac_surface(), sensors.digit_surface()), time.process_time()
    torch.manual_seed(seed)
    for vae, (state, _, _) in zip((model.MVB, model.MVD), meshes, strict=True):
        vae.load_state_dict({name: torch.from_numpy(values) for name, values in state.items()})
    train_signal(model.SVB, pairs, rows, seed)
    train_maps(model, pairs, rows, [scale for _, scale, _ in meshes], seed)
    seconds = time.process_time() - began + sum(took for _, _, took in meshes)
    said = f"{len(rows)} contacts, mesh networks {MESH_EPOCHS} pass"
    found = error_rows(model, read_pairs(test_file), [scale for _, scale, _ in meshes])
    return [*found, row("training_s", seconds, "s", of=f"{said}, CPU")]


def trained_mesh(pairs_file: Path, sensor: str, seed: int) -> tuple[dict[str, np.ndarray], float, float]:
    """MVB or MVD: its tensors, the rms of the training displacements, m, and the CPU seconds it took."""
    torch.set_num_threads(1)
    torch.manual_seed(seed)
    pairs, began = read_pairs(pairs_file), time.process_time()
    rows = split_presses(pairs.press, seed, pairs_file).train
    scale = float(
        np.sqrt(np.mean([np.square(true_displacement(pairs, sensor, rows[i::99])).mean() for i in range(99)]))
    )
    vae = MeshVae(sensors.sensor_surface(sensor))

    def both(some: np.ndarray) -> tuple[Tensor, Tensor]:
        x = torch.from_numpy(true_displacement(pairs, sensor, some) / np.float32(scale))
        return x, x

    optimiser = torch.optim.Adam(vae.parameters(), MESH_RATE)
    decay = torch.optim.lr_scheduler.ExponentialLR(optimiser, MESH_DECAY)
    for epoch in range(MESH_EPOCHS):
        run_epoch(lambda x, y: vae_loss(vae, x, y), optimiser, both, shuffled(rows, MESH_BATCH, seed, epoch))
        decay.step()
    state = {name: values.numpy() for name, values in vae.state_dict().items()}
    return state, scale, time.process_time() - began


def vae_loss(vae: MeshVae | SignalVae, x: Tensor, target: Tensor) -> Tensor:
    """Mean square error of a sample's reconstruction, and KL (Kingma and Welling 2014, appendix B)."""
    mean, logvar = vae.posterior(x)
    logvar = logvar.clamp(-12, 6)  # keeps exp() finite in the first steps
    latent = mean + torch.randn_like(mean) * (0.5 * logvar).exp()
    divergence = 0.5 * (mean**2 + logvar.exp() - 1 - logvar).mean()
    return (vae.decode(latent) - target).square().mean() + KL * divergence


def run_epoch(loss: Callable, optimiser: torch.optim.Optimizer, batches: Batches, parts: Iterator[np.ndarray]) -> None:
    """Train for one pass over the data."""
    for part in parts:
        optimiser.zero_grad()
        loss(*batches(part)).backward()
        optimiser.step()


def shuffled(rows: np.ndarray, size: int, seed: int, epoch: int) -> Iterator[np.ndarray]:
    """Yield all rows in batches, in an order of this epoch."""
    order = np.random.default_rng([seed, epoch]).permutation(rows)
    yield from (order[start : start + size] for start in range(0, len(order), size))


def compressed(pairs: Pairs, rows: np.ndarray, random: np.random.Generator) -> Tensor:
    """(B, 19): signals as our training reads them, without the flag of rectified ones."""
    read = measured(pairs.signal[rows], random, Options())[:, :-1]
    return torch.from_numpy(np.arcsinh(read / np.float32(COUNT_SCALE)))


def train_signal(vae: SignalVae, pairs: Pairs, rows: np.ndarray, seed: int) -> None:
    """Train SVB; each pass draws noise and gains of its own."""
    random, optimiser = np.random.default_rng([seed, 1]), torch.optim.Adam(vae.parameters(), SIGNAL_RATE)

    def both(some: np.ndarray) -> tuple[Tensor, Tensor]:
        x = compressed(pairs, some, random)
        return x, x

    for epoch in range(SIGNAL_EPOCHS):
        parts = shuffled(rows, SIGNAL_BATCH, seed, epoch)
        run_epoch(lambda x, y: vae_loss(vae, x, y), optimiser, both, parts)


def train_maps(model: Across, pairs: Pairs, rows: np.ndarray, scales: list[float], seed: int) -> None:
    """S2MPN and M2MPN, from latent to latent."""
    model.eval()
    random = np.random.default_rng([seed, 2])
    latents = [torch.zeros(len(pairs.press), 128) for _ in SENSORS]
    with torch.no_grad():
        for found, vae, sensor, scale in zip(latents, (model.MVB, model.MVD), SENSORS, scales, strict=True):
            for part in np.array_split(rows, max(1, len(rows) // 64)):
                found[part] = vae.posterior(
                    torch.from_numpy(true_displacement(pairs, sensor, part) / np.float32(scale))
                )[0]

    def from_signal(some: np.ndarray) -> tuple[Tensor, Tensor]:
        with torch.no_grad():
            return model.SVB.posterior(compressed(pairs, some, random))[0], latents[0][some]

    def from_mesh(some: np.ndarray) -> tuple[Tensor, Tensor]:
        return latents[0][some], latents[1][some]

    for net, batches, rate in ((model.S2MPN, from_signal, S2MPN_RATE), (model.M2MPN, from_mesh, M2MPN_RATE)):
        optimiser = torch.optim.Adam(net.train().parameters(), rate)
        for epoch in range(MAP_EPOCHS):
            parts = shuffled(rows, MAP_BATCH, seed, epoch)
            run_epoch(lambda x, y, net=net: nn.functional.mse_loss(net(x), y), optimiser, batches, parts)
    model.eval()


def error_rows(model: Across, pairs: Pairs, scales: list[float]) -> list[Row]:
    """Errors of every step on contacts, averaged as ours are: see `training.error_summary`."""
    change = torch.from_numpy(np.arcsinh(as_read(pairs.signal, SEED) / np.float32(COUNT_SCALE)))
    parts = []
    for start in range(0, len(pairs.press), 64):
        rows = np.arange(start, min(start + 64, len(pairs.press)))
        parts.append(error_columns(model, pairs, rows, change[rows], *scales))
    columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    found = metric_rows(columns, pairs, np.arange(len(pairs.press)), "seen indenters", {})
    return [each for each in found if each["name"].endswith("_rms_um")]


def error_columns(
    model: Across, pairs: Pairs, rows: np.ndarray, change: Tensor, skin_scale: float, gel_scale: float
) -> dict[str, np.ndarray]:
    """Compute the columns of `step_errors.translation_metrics` for these networks."""
    skin, gel = (true_displacement(pairs, sensor, rows) for sensor in SENSORS)
    with torch.no_grad():
        mesh = model.MVB.posterior(torch.from_numpy(skin / np.float32(skin_scale)))[0]
        own = model.MVD.posterior(torch.from_numpy(gel / np.float32(gel_scale)))[0]
        signal = model.S2MPN(model.SVB.posterior(change)[0])
        on_skin = {"MVB": model.MVB.decode(mesh), "S2MPN": model.MVB.decode(signal)}
        on_gel = {
            "MVD": model.MVD.decode(own), "M2MPN": model.MVD.decode(model.M2MPN(mesh)),
            "chain": model.MVD.decode(model.M2MPN(signal)),
        }  # fmt: skip
    found = mesh_columns("baseline_biotac", 0 * skin, skin, accuracy.lengths) | mesh_columns(
        "baseline_digit", 0 * gel, gel
    )
    for name, moved in on_skin.items():
        found |= mesh_columns(name, skin_scale * moved.numpy(), skin, accuracy.lengths)
    for name, moved in on_gel.items():
        found |= mesh_columns(name, gel_scale * moved.numpy(), gel)
    return found
