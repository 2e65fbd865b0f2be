"""The fem room needs scipy; where the extra is not installed its tests say so."""

import pytest

pytest.importorskip("scipy", reason="extra [fem] is not installed")
