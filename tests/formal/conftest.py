"""Proofs that take longer than half a minute are made only when they are asked for: ``pytest -m slow``."""

import re

import pytest


def pytest_configure(config):
    config.addinivalue_line("markers", "slow: a proof that takes minutes; left out unless chosen with -m")


def pytest_collection_modifyitems(config, items):
    if re.search(r"(?<!not )\bslow\b", config.option.markexpr):
        return
    for item in items:
        if item.get_closest_marker("slow"):
            item.add_marker(pytest.mark.skip(reason="slow; choose it with -m slow"))
