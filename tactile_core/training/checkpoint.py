"""Save and restore a training's state on disk, without pickle: one NPZ of arrays, with a JSON text among them."""

from __future__ import annotations

import io
import json
import os
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import torch
from torch import nn

from ..errors import TactileError
from ..files import outside
from ..translation.weights import write_bytes

TEXT = {"identity": dict, "stage": int, "epoch": int, "log": list}  # of the JSON text: a State but for its arrays
ADVICE = "Remove the file to start again, or train into another folder"


@dataclass
class State:
    """State of a training.
    identity : what must be equal to resume it: data, seed, options, versions
    stage, epoch : indices of the next to run; log : rows (stage, epoch, training loss, validation loss)
    arrays : weights as ``model/...``, the optimiser's moments as ``optimiser/...``"""

    identity: dict
    stage: int = 0
    epoch: int = 0
    log: list[list] = field(default_factory=list)
    arrays: dict[str, np.ndarray] = field(default_factory=dict)


def save(path: str | os.PathLike, state: State, model: nn.Module, optimiser: torch.optim.Optimizer | None) -> None:
    """Write the state to a file, with the weights of model and the moments of optimiser as they are now."""
    arrays = {f"model/{name}": tensor.cpu().numpy() for name, tensor in model.state_dict().items()}
    if optimiser is not None:
        for index, values in optimiser.state_dict()["state"].items():
            arrays |= {f"optimiser/{index}/{name}": tensor.cpu().numpy() for name, tensor in values.items()}
    text = {name: getattr(state, name) for name in TEXT}
    arrays["state"] = np.frombuffer(json.dumps(text).encode(), np.uint8)
    buffer = io.BytesIO()
    np.savez(buffer, **arrays)
    write_bytes(path, buffer.getvalue())


def read(path: str | os.PathLike, identity: dict) -> State:
    """Read the state in the file; return an initial one if there is no file. Raises TactileError for a damaged file or
    a training of another identity: data, seed, options, versions."""
    if not os.path.exists(path):
        return State(identity)
    try:
        with outside.open_file(path, "a checkpoint") as raw, np.load(raw, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        text = json.loads(arrays.pop("state").tobytes())
        state = State(**{name: _of_kind(text[name], kind) for name, kind in TEXT.items()}, arrays=arrays)
    except Exception as error:  # of zip files, arrays, JSON and its content: a dozen types on damaged bytes
        raise TactileError(path, f"cannot be read ({error})", "a checkpoint", ADVICE) from error
    for name, expected in identity.items():
        found = state.identity.get(name)
        if found != expected:
            if isinstance(found, dict) and isinstance(expected, dict):  # of forty options those that differ
                differ = [key for key in found | expected if found.get(key) != expected.get(key)]
                found, expected = ({key: each.get(key) for key in differ} for each in (found, expected))
            raise TactileError(path, f"{name} {found}", f"{name} {expected}", ADVICE)
    return state


def _of_kind(value: Any, kind: type) -> Any:
    if not isinstance(value, kind):
        raise ValueError(f"a {type(value).__name__} for a {kind.__name__}")
    return value


def restore(state: State, model: nn.Module, path: str | os.PathLike) -> None:
    """Put the saved weights into the model. Raises TactileError, which names path, if they do not fit."""
    saved = {name: array for name, array in state.arrays.items() if name.startswith("model/")}
    weights = {name.removeprefix("model/"): torch.from_numpy(array.copy()) for name, array in saved.items()}
    try:
        model.load_state_dict(weights)
    except RuntimeError as error:
        raise TactileError(path, "weights of other networks", "a checkpoint of this version", ADVICE) from error


def restore_optimiser(state: State, optimiser: torch.optim.Optimizer) -> None:
    """Put the saved moments into the optimiser; at the start of a stage there are none, and it stays as it is."""
    values: dict[int, dict[str, torch.Tensor]] = {}
    for name, array in state.arrays.items():
        kind, *rest = name.split("/")
        if kind == "optimiser":
            values.setdefault(int(rest[0]), {})[rest[1]] = torch.from_numpy(array.copy())
    if values:
        optimiser.load_state_dict({"state": values, "param_groups": optimiser.state_dict()["param_groups"]})
