"""The shipped networks in torch give what they give in numpy."""

import numpy as np
import pytest

pytest.importorskip("torch", reason="needs torch")

from benchmarks.competitors.torch_chain import TorchChain

from tactile_core.translation import networks

TOLERANCE = 1e-5  # as tests/training/test_trained_parity.py has it


def test_same_displacements():
    nets, random = networks.load(), np.random.default_rng(0)
    change = (random.standard_normal((64, 19)) * np.logspace(0, 2.5, 64)[:, None]).astype(np.float32)
    biotac, digit = nets.likely_latents(nets.encode_signal(change))
    for found, expected in zip(
        TorchChain(nets)(change), (nets.decode_biotac(biotac), nets.decode_digit(digit)), strict=True
    ):
        assert np.abs(found - expected).max() <= TOLERANCE * np.abs(expected).max()
