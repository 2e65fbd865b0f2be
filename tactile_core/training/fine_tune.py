"""Fine-tune S2MPN on a real sensor's recording that is labelled with places and forces.

Only S2MPN changes, or R2MPN for a rectified recording. A label fixes the place of the dent and the force, three numbers
of the contact's state. It says nothing of the dent's shape: the latent is held near its former value, on the
recording's own signals and on the typical simulated signals that ship with the weights."""

from __future__ import annotations

import copy
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from .. import accuracy, sensors
from ..accuracy import Row, row
from ..errors import TactileError
from ..files import provenance
from ..recordings import prepare, read
from ..recordings.flags import Flag
from ..recordings.force_file import MOST_FORCE
from ..sensors import unrolling
from ..simulation.pairs_file import Split, split_presses
from ..translation import networks, reference_signals
from ..translation.card import PLACE, STATE
from ..translation.contact_frame import ContactFrame
from ..translation.gel_place import on_gel, place_on
from ..translation.layers import COMPRESSED_LIMIT
from ..translation.networks import Networks
from ..translation.posterior import FORCE_SCALE
from ..translation.weights import CARD_NAME, card_bytes, read_bytes, sha256, to_safetensors, write_bytes
from .export_weights import versions
from .modules import ContactPosterior
from .stages import FORCE_FLOOR
from .train import Progress, deterministic, prepared_folder, quiet

# A place in millimetres reads as tens, in metres as hundredths: no fingertip is longer than half a metre.
METRES_BELOW = 0.5
OFF_SKIN = 4e-3  # m; a contact farther from the skin is in another frame or unit (assumed; dents are below 2 mm)
OFF_SHARE = 0.1  # of the contacts that may lie off the skin, as places of real robots do
WILD = 0.02  # of the forces that may be beyond any finger's, as a sensor's glitches are (assumed)
TOUCH = 0.05  # N: below, a frame is no contact (assumed; force sensors of robots are no better)
FEWEST = 200  # frames in contact (assumed)
BLOCKS = 20  # parts of a recording without pauses, which then stand for presses
BAD = Flag.SATURATED | Flag.DEAD_CHANNEL


@dataclass(frozen=True)
class LabelledRecording:
    """Frames in contact, F of them.
    change : (F, 19) float32 counts; rectified : true if they have lost their sign
    place : (F, 2) float32, row and column from the gel's middle in tens of cells; force : (F,) float32 N, magnitude
    split : of the frames, by press; dropped : sentences on what was left out"""

    change: np.ndarray
    rectified: bool
    place: np.ndarray
    force: np.ndarray
    split: Split
    dropped: tuple[str, ...]


def read_labelled(path: str | os.PathLike, frame: ContactFrame, seed: int) -> LabelledRecording:
    """Read a recording with contact places and forces (Narang et al.: contact_loc, force_vec) for the gel's frame.

    Places are assumed in SynTouch's frame of the electrodes (docs/sources.md), in m or mm by their size, and are
    unrolled onto the gel; of forces only the magnitude is used, whatever their frame. seed : of the split into presses
    Raises TactileError for no labels, places that are not on the skin, forces that are not N, or too few contacts."""
    recording = read(path)
    position, forces = recording.position, recording.force
    if position is None or forces is None:
        found = "no contact places" if position is None else "no forces"
        advice = "Give a file with electrode_vals/data, contact_loc/data and force_vec/data"
        raise TactileError(path, found, "a contact place and a force a frame", advice)
    signals = prepare(recording)
    force = np.linalg.norm(forces, axis=1)
    known = np.isfinite(position).all(1) & np.isfinite(force)
    whole = (signals.flags & np.uint16(BAD)) == 0
    touched = known & (force > TOUCH)
    used = np.flatnonzero(touched & whole)
    dropped = [f"{(~known).sum()} frames without a label"] if not known.all() else []
    if (touched & ~whole).any():
        dropped.append(f"{(touched & ~whole).sum()} frames with a saturated or dead electrode")
    place, off = _places(position[used], frame, path)
    if off.any():
        dropped.append(f"{off.sum()} contacts that are not on the pad")
    used, place = used[~off], place[~off]
    if len(used) < FEWEST:
        found = f"{len(used)} usable frames in contact ({', '.join(dropped) or f'force above {TOUCH} N'})"
        raise TactileError(path, found, f"at least {FEWEST}", "Give a longer recording")
    change = signals.typical[used].astype(np.float32)
    rectified = signals.kind == "rectified"
    if np.mean(force[used] > MOST_FORCE) > WILD:
        found = f"{force[used].min():g} to {force[used].max():g}, which cannot be a finger's force in newtons"
        raise TactileError(f"{os.fspath(path)}, force_vec", found, f"up to {MOST_FORCE:g} N", "Convert it to newtons")
    split = split_presses(_presses(used), seed, path)
    labels = place.astype(np.float32), force[used].astype(np.float32)
    return LabelledRecording(np.abs(change) if rectified else change, rectified, *labels, split, tuple(dropped))


def _places(position: np.ndarray, frame: ContactFrame, path: str | os.PathLike) -> tuple[np.ndarray, np.ndarray]:
    """Return contacts' places (F, 2) on the gel's lattice, in tens of cells from its middle, and a mask (F,) of those
    off the pad. position : (F, 3), in SynTouch's frame, m or mm; path : of the file, for errors"""
    if not len(position):
        return np.zeros((0, 2)), np.zeros(0, bool)
    metres = position if np.median(accuracy.lengths(position)) < METRES_BELOW else 1e-3 * position
    rest, unrolled = sensors.biotac_surface().rest, unrolling.unrolled_nodes()
    points = sensors.from_maker(metres, sensors.SOURCE)
    nearest, gap = np.empty(len(points), int), np.empty(len(points))
    for start in range(0, len(points), FEWEST):  # bounds the table of distances
        part = slice(start, start + FEWEST)
        far = np.linalg.norm(points[part, None] - rest, axis=-1)
        nearest[part], gap[part] = far.argmin(1), far.min(1)
    off = gap > OFF_SKIN
    if off.mean() > OFF_SHARE:
        raise TactileError(
            f"{os.fspath(path)}, contact places", f"{off.mean():.0%} lie more than {OFF_SKIN * 1e3:g} mm off the skin",
            "places in SynTouch's frame (x to the tip, z <= 0 on the pad), m or mm", "Turn them into that frame",
        )  # fmt: skip
    on_gel = unrolled[nearest]
    off |= np.isnan(on_gel[:, 0])  # the finger's back rolls onto no gel
    place = np.zeros_like(on_gel)
    place[~off] = place_on(frame, on_gel[~off])
    return place, off


def _presses(used: np.ndarray) -> np.ndarray:
    """Return the press (F,) int, from 0, of each frame: runs of contact or, if these are too few, equal parts.
    used : (F,) int, rising indices into the recording of the frames that are kept"""
    runs = np.cumsum(np.diff(used, prepend=used[0]) > 1)
    return runs if runs[-1] + 1 >= BLOCKS else np.arange(len(used)) * BLOCKS // len(used)


EPOCHS, BATCH, RATE = 30, 64, 2e-4  # a few passes at a low rate: the start is a trained network (assumed)
HOLD = 0.3  # weight of the shape being held, against place and force, each about 1 at first (assumed)
PLACE_FLOOR = 0.05  # half a cell of the lattice: smaller errors of the place count squared (assumed)


def fine_tune(
    path: str | os.PathLike,
    out_folder: str | os.PathLike,
    weights_folder: str | os.PathLike | None = None,
    seed: int = 0,
    progress: Progress | None = None,
    overwrite: bool = False,
) -> list[Row]:
    """Write weights with S2MPN fine-tuned on the recording; return rows of held-out presses' errors, before and after.

    out_folder/weights is for ``tactile convert --weights``; its card says what the fine-tuning was made of.
    weights_folder : the weights to begin with, None for those that ship; progress : takes the share done, a text
    seed : number that seeds the split and the order of training; overwrite : true replaces weights in out_folder
    Raises TactileError for a recording without labels or with too few contacts, unreadable weights, and a folder that
    holds weights already, unless `overwrite`."""
    before = networks.load(weights_folder)
    source = Path(networks.WEIGHTS_FOLDER if weights_folder is None else weights_folder)
    data, digest = read_labelled(path, before.frames["MVD"], seed), provenance.sha256(path)
    typical = reference_signals.read(source).typical.astype(np.float32)
    with prepared_folder(Path(out_folder), overwrite):
        net = "R2MPN" if data.rectified else "S2MPN"
        with deterministic():
            state = _train(before, net, data, typical, seed, progress or quiet)
        after = Networks(before.tensors | {net: state}, before.card)
        rows = [*_rows(before, data, "before"), *_rows(after, data, "after")]
        note = {
            "network": net,
            "recording": os.path.basename(path),
            "recording_sha256": digest,
            "weights_sha256": before.sha256,
            "contacts": {name: len(rows) for name, rows in vars(data.split).items()},
            "dropped": list(data.dropped),
            "seed": seed,
            "versions": versions(torch.device("cpu")),
            "errors": rows,
        }
        _write(Path(out_folder) / "weights", source, before.card, net, state, note)
    return rows


def _train(
    nets: Networks, net: str, data: LabelledRecording, typical: np.ndarray, seed: int, progress: Progress
) -> dict[str, np.ndarray]:
    """Return `net`'s tensors, rounded as they are written, after the epoch that is best on the validation presses.
    typical : (P, 19) counts, signals of simulated contacts, whose states and latents are to stay as they were"""
    sizes = nets.sizes[net]
    module = ContactPosterior(*(sizes[name] for name in ("inputs", "outputs", "width", "blocks", "components")))
    module.load_state_dict({name: torch.from_numpy(array.copy()) for name, array in nets.tensors[net].items()})
    latent = torch.from_numpy(nets.encode_signal(data.change, data.rectified))
    rehearsed = torch.from_numpy(nets.encode_signal(np.abs(typical) if data.rectified else typical, data.rectified))
    place, force = torch.from_numpy(data.place), torch.from_numpy(data.force)
    with torch.no_grad():
        held, kept = _state_and_latent(module, latent)[:, STATE:], _state_and_latent(module, rehearsed)
        spread = kept.std(0).clamp(min=1e-3)

    def loss(rows: Tensor) -> Tensor:
        """Return the errors of place and force plus the change of the shape, over frames rows (B,)."""
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
    """Map latent_signal (B, K) to the likeliest contact's state and latent_biotac, joined to (B, STATE + L)."""
    state = module.contact(latent_signal)
    return torch.cat([state, module.given(latent_signal, state)], -1)


def _rows(nets: Networks, data: LabelledRecording, when: str) -> list[Row]:
    """Return rows of the median errors of place and force on held-out presses; the baseline always answers with the
    training presses' median. when : word in the rows' set, "before" or "after" the fine-tuning"""
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
    """Write the weights folder: the source's files but for the tuned network's own, and last the card with a note.
    card : the source's; state : the tuned network's tensors; note : entry "fine_tuned" of the new card"""
    for name in [*(f"{net}.safetensors" for net in card["nets"] if net != tuned), reference_signals.FILE]:
        write_bytes(folder / name, read_bytes(source / name))
    data = to_safetensors(state)
    write_bytes(folder / f"{tuned}.safetensors", data)
    entry = card["nets"][tuned] | {"sha256": sha256(data)}
    card = card | {"nets": card["nets"] | {tuned: entry}, "fine_tuned": note}
    write_bytes(folder / CARD_NAME, card_bytes(card))
    networks.load(folder)  # what was written can be read
