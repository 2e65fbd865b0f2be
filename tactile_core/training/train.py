"""Train from a pairs file to a weights folder: data, model, stages, export, report.

The same pairs, seed, options, device and machine give the same bytes, interrupted or not: every epoch draws its order,
its noise and its posterior samples from generators seeded with (seed, stage, epoch), on one thread."""

from __future__ import annotations

import logging
import math
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path

import numpy as np
import torch

from ..accuracy import lengths
from ..errors import TactileError
from ..files import atomic
from ..sensors import sensor_surface
from ..simulation.pairs_file import Pairs, Split, read_pairs, split_presses
from ..translation.card import SURFACES
from ..translation.contact_frame import ContactFrame, frame_of
from . import checkpoint
from .data import Contacts
from .error_report import draw_losses, write_log
from .export_weights import export, versions
from .modules import take_step
from .options import Options, device_of
from .stages import STAGES, Model, Stage
from .step_errors import Bodies, our_bodies
from .two_contacts import Presses, train_parts

log = logging.getLogger(__name__)
Progress = Callable[[float, str], None]
CHECKPOINT = "checkpoint.npz"  # in the training's folder, until all else is written
NETS_SHARE = 0.8  # of a training's time, before what tells two contacts apart is trained
VALIDATION_SEED = 2**31  # stands in the place of the epoch; no training has as many


def train(
    pairs_path: str | os.PathLike,
    out_folder: str | os.PathLike,
    seed: int = 0,
    options: Options | None = None,
    progress: Progress | None = None,
    bodies: Bodies | None = None,
    frame: Callable[[str, int], ContactFrame] = frame_of,
    overwrite: bool = False,
    device: str = "cpu",
) -> dict:
    """Train all networks of a translation; return the card.

    Writes out_folder/weights/<net>.safetensors and card.json (for `networks.load`), log.csv, loss.png; meanwhile
    checkpoint.npz, from which the next call with the same arguments continues.
    seed : of all that is drawn; options : sizes and lengths, None for the defaults; overwrite : true replaces weights
    progress : called with the share done (0..1) and a line of text
    bodies : the surfaces of the pairs; None: those of this version's sensors
    frame : function from a sensor and half a window's cells to the frame that moves over its surface
    device : auto, cpu or cuda; contacts stay in the host's memory, networks and batches go there
    Raises TactileError if the pairs, the folder, the device or a checkpoint in the folder cannot be used."""
    options, out, where = options or Options(), Path(out_folder), device_of(device)
    pairs = read_pairs(pairs_path)
    split = without(split_presses(pairs.press, seed, pairs_path), pairs, options, pairs_path)
    if bodies is None:
        check_surfaces(pairs, pairs_path)
        bodies = our_bodies(*pairs.pair)
    with prepared_folder(out, overwrite), deterministic():
        generator = torch.Generator().manual_seed(seed)
        frames = {
            role: frame(sensor, getattr(options, f"half_{role}"))
            for role, sensor in zip(SURFACES, pairs.pair, strict=True)
        }
        contacts = Contacts(pairs, split, options, frames, generator, where)
        model = Model(options, contacts, generator).to(where)
        say = progress or quiet
        history = run_stages(model, contacts, seed, out / CHECKPOINT, lambda share, text: say(NETS_SHARE * share, text))
        presses = Presses(pairs.signal, pairs.place[:, :2], lengths(pairs.force))
        parts = train_parts(
            presses, split, options, contacts.rest, pairs.pair[0], seed,
            lambda share, text: say(NETS_SHARE + (1 - NETS_SHARE) * share, text),
        )  # fmt: skip
        card = export(model, contacts, parts, bodies, seed, out / "weights")
        write_log(out / "log.csv", history)
        draw_losses(out / "loss.png", history)
        (out / CHECKPOINT).unlink()
    return card


def quiet(share: float, text: str) -> None:
    """Write progress to the log: the share done (0 to 1) and a line of text. It is the default callback."""
    log.info("%3.0f %% %s", 100 * share, text)


def without(split: Split, pairs: Pairs, options: Options, path: str | os.PathLike) -> Split:
    """Return the split without the contacts that ``options.without`` (indenters) and ``without_below_x`` leave out.
    path : of the pairs, for errors. Raises TactileError for an unknown indenter, or a part that is left empty."""
    names = pairs.indenter_names
    for name in options.without:
        if name not in names:
            raise TactileError(f"{os.fspath(path)}, indenters", f"no {name!r}", ", ".join(names))
    apart = np.isin(pairs.indenter, [names.index(name) for name in options.without])
    if options.without_below_x is not None:
        apart |= pairs.place[:, 0] < options.without_below_x
    parts = {name: rows[~apart[rows]] for name, rows in vars(split).items()}
    for name, rows in parts.items():
        if not len(rows):
            raise TactileError(path, f"nothing is left for {name}", "contacts to train on", "Keep less apart")
    return Split(**parts)


def check_surfaces(pairs: Pairs, path: str | os.PathLike) -> None:
    """Raise TactileError if the pairs were made on other surfaces than this version's."""
    for role, sensor in zip(SURFACES, pairs.pair, strict=True):
        surface, key = sensor_surface(sensor), f"{sensor}_nodes_sha256"
        found = pairs.attributes[key]
        if found != surface.sha256 or len(surface.rest) != getattr(pairs, f"displacement_{role}").shape[1]:
            advice = "Make the pairs again with this version"
            raise TactileError(f"{os.fspath(path)}, {key}", found, surface.sha256, advice)


@contextmanager
def prepared_folder(out: Path, overwrite: bool) -> Iterator[None]:
    """Make the folder `out`, for one training at a time; after an error a new folder that is empty is removed.

    Raises TactileError if it cannot be made, is being written, or already holds weights, unless `overwrite`.
    (Weights beside a checkpoint are of a training that was killed after it wrote them, and can be continued.)"""
    new = [folder for folder in (out / "weights", out) if not folder.exists()]
    try:
        (out / "weights").mkdir(parents=True, exist_ok=True)
    except OSError as error:
        advice = "Choose another folder"
        raise TactileError(out, f"cannot be made ({error.strerror})", "a writable folder", advice) from error
    with atomic.locked(Path(os.path.abspath(out))):
        try:
            if (out / "weights" / "card.json").exists() and not (out / CHECKPOINT).exists() and not overwrite:
                raise TactileError(out, "already holds weights", "a new folder", "Choose another folder, or overwrite")
            yield
        except BaseException:  # Ctrl-C, too; raised again
            for folder in new:
                with suppress(OSError):  # it holds a checkpoint
                    folder.rmdir()
            raise


@contextmanager
def deterministic() -> Iterator[None]:
    """Use one thread and deterministic algorithms inside the block."""
    threads, strict = torch.get_num_threads(), torch.are_deterministic_algorithms_enabled()
    torch.set_num_threads(1)
    torch.use_deterministic_algorithms(True)
    try:
        yield
    finally:
        torch.set_num_threads(threads)
        torch.use_deterministic_algorithms(strict)


def run_stages(model: Model, contacts: Contacts, seed: int, path: Path, progress: Progress) -> list[list]:
    """Run the stages that are left; return the log's rows (stage, epoch, training loss, validation loss).
    path : the checkpoint, read at first and written now and then; progress : takes the share done, a text"""
    identity = {
        "pairs": contacts.pairs.sha256,
        "seed": seed,
        "options": contacts.options.settings(),
        "versions": versions(contacts.device),
    }
    state = checkpoint.read(path, identity)
    if state.arrays:
        checkpoint.restore(state, model, path)
        log.info("going on at stage %d, epoch %d from %s", state.stage, state.epoch, path)
    while state.stage < len(STAGES):
        run_stage(STAGES[state.stage], model, contacts, seed, state, path, progress)
        state.stage, state.epoch, state.arrays = state.stage + 1, 0, {}
        checkpoint.save(path, state, model, None)
    return state.log


def run_stage(
    stage: Stage, model: Model, contacts: Contacts, seed: int, state: checkpoint.State, path: Path, progress: Progress
) -> None:
    """Train a stage's networks from state to its last epoch, saved to path; progress : takes the share done, a text"""
    options = contacts.options
    groups = [
        {"params": list(model.get_submodule(net).parameters()), "weight_decay": options.decay(net)}
        for net in stage.nets
    ]
    optimiser = torch.optim.AdamW(groups, lr=options.rate, fused=True)
    checkpoint.restore_optimiser(state, optimiser)
    lengths, saved = [options.epochs(each.name) for each in STAGES], time.monotonic()
    epochs = lengths[state.stage]
    while state.epoch < epochs:
        steps = epoch_losses(stage, model, contacts, seed, state.stage, state.epoch)
        training = train_epoch(steps, optimiser, state.epoch, epochs, options.rate)
        validation = validate(stage, model, contacts, seed, state.stage)
        state.log.append([stage.name, state.epoch, training, validation])
        state.epoch += 1
        text = f"{stage.name} {state.epoch}/{epochs}: loss {training:.4f}, validation {validation:.4f}"
        progress((sum(lengths[: state.stage]) + state.epoch) / sum(lengths), text)
        if time.monotonic() - saved >= options.checkpoint_seconds and state.epoch < epochs:
            checkpoint.save(path, state, model, optimiser)
            saved = time.monotonic()


def epoch_losses(
    stage: Stage, model: Model, contacts: Contacts, seed: int, index: int, epoch: int
) -> list[Callable[[], torch.Tensor]]:
    """Return a function for each step of pass ``epoch``, from 0; called in order, each returns its batch's loss.
    index : number of the stage; with seed and epoch it seeds what is drawn"""
    options = contacts.options
    rng = np.random.default_rng([seed, index, epoch])
    generator = torch.Generator().manual_seed(int(rng.integers(2**62)))
    rows = contacts.drawn(rng)
    signal = contacts.read(rows, rng, options.rectified, options.unit)

    def loss(step: int) -> torch.Tensor:
        """Compute the loss of one batch."""
        part = slice(step * options.batch, (step + 1) * options.batch)
        batch = contacts.batch(rows[part], signal[part])
        return stage.loss(model, contacts, batch, options, generator)

    return [partial(loss, step) for step in range(math.ceil(len(rows) / options.batch))]


def train_epoch(
    losses: list[Callable[[], torch.Tensor]], optimiser: torch.optim.Optimizer, epoch: int, epochs: int, rate: float
) -> float:
    """Train for pass ``epoch`` of ``epochs`` over the data; return the mean loss. Raises TactileError unless it is
    finite. losses : of `epoch_losses`; rate : of learning, at its highest"""
    total = 0.0
    for step, loss in enumerate(losses):
        total += take_step(optimiser, loss, (epoch * len(losses) + step + 1) / (epochs * len(losses)), rate)
    if not math.isfinite(total):
        raise TactileError("training", "the loss is not finite", "a falling loss", "Check the pairs, or lower the rate")
    return total / len(losses)


def validate(stage: Stage, model: Model, contacts: Contacts, seed: int, index: int) -> float:
    """Return stage ``index``'s mean loss on validation presses, for the log; equal noise makes epochs comparable."""
    rng = np.random.default_rng([seed, index, VALIDATION_SEED])
    generator = torch.Generator().manual_seed(seed)
    rows = contacts.with_silence(contacts.split.validation)
    signal, size = contacts.read(rows, rng), 256
    total = 0.0
    with torch.no_grad():
        for start in range(0, len(rows), size):
            batch = contacts.batch(rows[start : start + size], signal[start : start + size])
            total += float(stage.loss(model, contacts, batch, contacts.options, generator)) * len(batch.rows)
    return total / len(rows)
