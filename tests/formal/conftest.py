"""Proofs that take longer than half a minute are made only when they are asked for: ``pytest -m slow``."""

from pathlib import Path

import pytest

_HERE = Path(__file__).parent


def pytest_configure(config):
    config.addinivalue_line("markers", "proof: asks a solver; all of this folder")
    config.addinivalue_line("markers", "slow: a proof that takes minutes; left out unless chosen with -m")


def pytest_collection_modifyitems(config, items):
    for item in items:
        if _HERE in item.path.parents:
            item.add_marker(pytest.mark.proof)
    if config.option.markexpr:
        return
    for item in items:
        if item.get_closest_marker("slow"):
            item.add_marker(pytest.mark.skip(reason="slow; choose it with -m slow"))
