"""Whole chips have a mark: ``make test`` leaves them out, and ``make test-chips`` runs them."""

import os

from sim.garbage import collect_rarely


def pytest_configure(config):
    config.addinivalue_line("markers", "chip: compiles or simulates a whole chip or board, which takes minutes")
    # Most chips draw a few small pictures; to compile them faster takes longer than that.
    os.environ.setdefault("DYNRT_OPTIMISE", "-O1")
    collect_rarely()
