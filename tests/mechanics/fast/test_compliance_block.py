"""The compliance of the gaps: made again where a few normals have turned, it is the one made from the start."""

import numpy as np

from tactile_core.mechanics.fast.compliance import biotac_compliance
from tactile_core.mechanics.fast.compliance_block import ComplianceBlock


def test_turning_some_normals_is_the_same_as_starting_with_them():
    skin = biotac_compliance()
    block = ComplianceBlock(skin, np.arange(400, 440), skin.feet + np.arange(5))
    random = np.random.default_rng(0)
    before, after = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in random.normal(size=(2, block.k, 3)))
    at = np.array([0, 7, 39])
    mixed = before.copy()
    mixed[at] = after[at]
    whole = block.normal(mixed)
    # single precision of sums of nine terms
    np.testing.assert_allclose(block.turned(block.normal(before), mixed, at), whole, atol=1e-6 * np.abs(whole).max())
