"""Where the real feeders and OpenDSS's phasors of them lie, if they do."""

from __future__ import annotations

from pathlib import Path

import pytest

__all__ = ["FEEDERS", "needs_feeders"]

FEEDERS = Path(__file__).resolve().parents[3] / "shared" / "feeders"

needs_feeders = pytest.mark.skipif(
    not FEEDERS.is_dir(), reason="needs ../shared/feeders beside the checkout"
)
