"""Fine-tuning of S2MPN on a real sensor's recording that says where and how hard it was touched.

Only S2MPN changes, or R2MPN where the recording is rectified. A label fixes the place of the dent and the force, three
numbers of the contact's state; it says nothing of the dent's shape, for which the latent is held near what it was, on
the recording's own signals and on the typical simulated signals that ship with the weights.
"""

from __future__ import annotations

import copy
import hashlib
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from .. import accuracy
from ..accuracy import Row, row
from ..files import outside
from ..translation import networks, reference_signals
from ..translation.gel_place import on_gel
from ..translation.layers import COMPRESSED_LIMIT
from ..translation.network_sizes import NETS, PLACE, STATE
from ..translation.networks import Networks
from ..translation.posterior import FORCE_SCALE
from ..translation.weights import CARD_NAME, card_bytes, read_bytes, sha256, to_safetensors, write_bytes
from .export_weights import versions
from .labelled_recording import LabelledRecording, read_labelled
from .modules import ContactPosterior
from .stages import FORCE_FLOOR
from .train import deterministic, prepared_folder

EPOCHS, BATCH, RATE = 30, 64, 2e-4  # a few passes at a low rate: the start is a trained network (assumed)
HOLD = 0.3  # weight of the shape being held, against place and force, each about 1 at first (assumed)
PLACE_FLOOR = 0.05  # half a cell of the lattice: a smaller miss of the place counts squared (assumed)

Progress = Callable[[float, str], None]


def fine_tune(
    path: str | os.PathLike,
    out_folder: str | os.PathLike,
    weights_folder: str | os.PathLike | None = None,
    seed: int = 0,
    progress: Progress | None = None,
    overwrite: bool = False,
) -> list[Row]:
    """Write weights whose S2MPN was fine-tuned on the recording; returns the rows before and after on kept presses.

    out_folder/weights is what ``tactile convert --weights`` takes; its card says what the fine-tuning was made of.
    Raises TactileError: a recording without labels or with too few contacts, weights that cannot be read, a folder
    that holds weights already.
    """
    before = networks.load(weights_folder)
    source = Path(networks.WEIGHTS_FOLDER if weights_folder is None else weights_folder)
    data = read_labelled(path, before.frames["MVD"], seed)
    typical = reference_signals.read(source).typical.astype(np.float32)
    with prepared_folder(Path(out_folder), overwrite):
        net = "R2MPN" if data.rectified else "S2MPN"
        with deterministic():
            state = _train(before, net, data, typical, seed, progress or (lambda share, text: None))
        after = Networks(before.tensors | {net: state}, before.card)
        rows = [*_rows(before, data, "before"), *_rows(after, data, "after")]
        note = {
            "network": net,
            "recording": os.path.basename(path),
            "recording_sha256": _file_sha256(path),
            "weights_sha256": before.sha256,
            "contacts": {name: len(rows) for name, rows in vars(data.split).items()},
            "dropped": list(data.dropped),
            "seed": seed,
            "versions": versions(torch.device("cpu")),
            "errors": rows,
        }
        _write(Path(out_folder) / "weights", source, before.card, net, state, note)
    return rows


def _file_sha256(path: str | os.PathLike) -> str:
    with outside.open_file(path) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _train(
    nets: Networks, net: str, data: LabelledRecording, typical: np.ndarray, seed: int, progress: Progress
) -> dict[str, np.ndarray]:
    """The network's tensors, rounded as they are written, at the epoch that was best on the validation presses."""
    sizes = nets.sizes[net]
    module = ContactPosterior(*(sizes[name] for name in ("inputs", "outputs", "width", "blocks", "components")))
    module.load_state_dict({name: torch.from_numpy(array.copy()) for name, array in nets.tensors[net].items()})
    latent = torch.from_numpy(nets.encode_signal(data.change, data.rectified))
    rehearsed = torch.from_numpy(nets.encode_signal(np.abs(typical) if data.rectified else typical, data.rectified))
    place, force = torch.from_numpy(data.place), torch.from_numpy(data.force)
    with torch.no_grad():
        held, kept = module(latent), _state_and_latent(module, rehearsed)
        spread = kept.std(0).clamp(min=1e-3)

    def loss(rows: Tensor) -> Tensor:
        state = module.contact(latent[rows])
        found = module.given(latent[rows], state)
        miss = (state[:, :PLACE] - place[rows]).square().sum(-1).add(PLACE_FLOOR**2).sqrt().mean()
        load = FORCE_SCALE * torch.sinh(state[:, PLACE].clamp(0.0, COMPRESSED_LIMIT))
        share = ((load - force[rows]).abs() / (force[rows] + FORCE_FLOOR)).mean()
        shape = ((found - held[rows]) / spread[STATE:])[:, PLACE:].square().mean()
        return miss + share + HOLD * shape

    optimiser = torch.optim.AdamW(module.parameters(), lr=RATE, weight_decay=0.0)
    train, validation = torch.from_numpy(data.split.train), torch.from_numpy(data.split.validation)
    best, state = float("inf"), copy.deepcopy(module.state_dict())
    for epoch in range(EPOCHS + 1):
        with torch.no_grad():
            level = float(loss(validation))
        if level < best:
            best, state = level, copy.deepcopy(module.state_dict())
        progress(epoch / EPOCHS, f"epoch {epoch}/{EPOCHS}: validation {level:.4f}")
        generator = torch.Generator().manual_seed(int(np.random.default_rng([seed, epoch]).integers(2**62)))
        for rows in train[torch.randperm(len(train), generator=generator)].split(BATCH):
            again = torch.randint(len(rehearsed), (len(rows),), generator=generator)
            rehearsal = ((_state_and_latent(module, rehearsed[again]) - kept[again]) / spread).square().mean()
            optimiser.zero_grad()
            (loss(rows) + HOLD * rehearsal).backward()
            optimiser.step()
    return {name: tensor.numpy().astype(np.float16) for name, tensor in state.items()}


def _state_and_latent(module: ContactPosterior, latent_signal: Tensor) -> Tensor:
    """Map latent_signal (B, K) to the most plausible contact's state and latent_biotac, (B, STATE + L)."""
    state = module.contact(latent_signal)
    return torch.cat([state, module.given(latent_signal, state)], -1)


def _rows(nets: Networks, data: LabelledRecording, when: str) -> list[Row]:
    """Median miss of place and force on the presses kept for it; baseline: always the training's median."""
    test, train = data.split.test, data.split.train
    frame = nets.frames["MVD"]
    latent = nets.encode_signal(data.change[test], data.rectified)
    state = nets.contact(latent, data.rectified)
    true, middle = on_gel(frame, data.place[test]), np.median(data.place[train], 0, keepdims=True)
    miss, baseline = (accuracy.lengths(on_gel(frame, each) - true) for each in (state[:, :PLACE], middle))
    estimated = nets.force_in(state, nets.given(latent, state, data.rectified))
    load, usual = accuracy.lengths(estimated), np.median(data.force[train])
    share, nothing = (100 * np.abs(each - data.force[test]) / data.force[test] for each in (load, usual))
    of = f"kept presses, {when}"
    return [
        row("real_position_mm", 1e3 * float(np.median(miss)), "mm", baseline=1e3 * float(np.median(baseline)), of=of),
        row("real_force_percent", float(np.median(share)), "%", baseline=float(np.median(nothing)), of=of),
    ]


def _write(folder: Path, source: Path, card: dict, tuned: str, state: dict[str, np.ndarray], note: dict) -> None:
    """Write the weights folder: all files of the source but the tuned one, and the card with a note of it, last."""
    for name in [*(f"{net}.safetensors" for net in NETS if net != tuned), reference_signals.FILE]:
        write_bytes(folder / name, read_bytes(source / name))
    data = to_safetensors(state)
    write_bytes(folder / f"{tuned}.safetensors", data)
    entry = card["nets"][tuned] | {"sha256": sha256(data)}
    card = card | {"nets": card["nets"] | {tuned: entry}, "fine_tuned": note}
    write_bytes(folder / CARD_NAME, card_bytes(card))
    networks.load(folder)  # what was written can be read
