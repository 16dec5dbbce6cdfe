"""What takes long has a mark: ``make test`` leaves it out, ``make test-chips`` and ``make proofs`` run it."""

import gc
import os
from pathlib import Path

import pytest

_PROOFS = Path(__file__).parent / "formal"


def pytest_configure(config):
    config.addinivalue_line("markers", "chip: compiles or simulates a whole chip or board, which takes minutes")
    config.addinivalue_line("markers", "proof: asks a solver")
    # Most chips draw a few small pictures; to compile them faster takes longer than that.
    os.environ.setdefault("DYNRT_OPTIMISE", "-O1")
    # As the command ``dynrt`` does.
    gc.set_threshold(200_000, 20, 20)


def pytest_collection_modifyitems(items):
    for item in items:
        if _PROOFS in item.path.parents:
            item.add_marker(pytest.mark.proof)
