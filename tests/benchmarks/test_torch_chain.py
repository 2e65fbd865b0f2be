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
    latent = nets.s2m(nets.encode_signal(change))
    for found, expected in zip(
        TorchChain(nets)(change), (nets.decode_biotac(latent), nets.decode_digit(nets.m2m(latent))), strict=True
    ):
        assert np.abs(found - expected).max() <= TOLERANCE * np.abs(expected).max()
