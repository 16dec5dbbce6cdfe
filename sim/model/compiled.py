"""Compiled functions that are kept for as long as nothing they are made of changes."""

import hashlib
from pathlib import Path

import numba

from ..cache import cache_directory

__all__ = ["compiled"]

_TOP = Path(__file__).parents[2]


def _digest():
    # Numba looks at a function's own file only, but these have the datapaths' kernels and the image's layout inlined.
    digest = hashlib.sha256()
    for folder in ("fpu", "rtl", "sim/model", "sim/scene"):
        for path in sorted((_TOP / folder).glob("*.py")):
            digest.update(path.read_bytes())
    return digest.hexdigest()[:20]


_FOLDER = cache_directory() / "model" / _digest()


def compiled(**options):
    """Decorator: numba's ``njit``, kept in the user's cache under a name that changes with the sources."""
    def decorate(function):
        before = numba.config.CACHE_DIR
        try:
            _FOLDER.mkdir(parents=True, exist_ok=True)
        except OSError:
            return numba.njit(error_model="numpy", **options)(function)
        # Numba asks where to keep a function when it is decorated.
        numba.config.CACHE_DIR = str(_FOLDER)
        try:
            return numba.njit(error_model="numpy", cache=True, **options)(function)
        finally:
            numba.config.CACHE_DIR = before

    return decorate
