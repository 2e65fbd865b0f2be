"""Scenes are simulated with scipy; where the extra is not installed these tests say so."""

import pytest

pytest.importorskip("scipy", reason="extra [fem] is not installed")
