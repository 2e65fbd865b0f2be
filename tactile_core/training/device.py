"""Choose the device for training: a GPU when torch sees one, else the processor."""

from __future__ import annotations

import os

import torch

from ..errors import TactileError
from .options import DEVICES

# What cuBLAS asks for before it repeats itself to the bit: NVIDIA, cuBLAS Library, "Results reproducibility".
_REPEATABLE = ("CUBLAS_WORKSPACE_CONFIG", ":4096:8")


def device_of(name: str) -> torch.device:
    """Return one of DEVICES. Raises TactileError for another name, and for a GPU that torch does not see."""
    if name not in DEVICES:
        raise TactileError("device", repr(name), ", ".join(DEVICES))
    there = torch.cuda.is_available()
    if name == "cuda" and not there:
        found = f"torch {torch.__version__} sees none"
        raise TactileError("device cuda", found, "a GPU", "Install torch for it, or leave the device to auto")
    if name == "cpu" or not there:
        return torch.device("cpu")
    os.environ.setdefault(*_REPEATABLE)
    return torch.device("cuda")


def label(device: torch.device) -> str:
    """Return the device's name, for a card: numbers depend on it."""
    return torch.cuda.get_device_name(device) if device.type == "cuda" else device.type
