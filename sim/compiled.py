"""Compiled functions that are kept for as long as nothing they are made of changes."""

import hashlib
from pathlib import Path

import numba

from .cache import cache_directory

__all__ = ["compiler"]

_TOP = Path(__file__).parents[1]


def compiler(name, *folders):
    """A decorator like numba's ``njit`` that keeps code in the user's cache, named after the sources.

    Numba itself looks at a function's own file only, but functions of other files are inlined.

    Parameters
    ----------
    name : str
        Folder in the cache.
    folders : str
        Where the sources lie.
    """
    digest = hashlib.sha256()
    for folder in folders:
        for path in sorted((_TOP / folder).rglob("*.py")):
            digest.update(path.read_bytes())
    kept = cache_directory() / name / digest.hexdigest()[:20]

    def compiled(**options):
        def decorate(function):
            before = numba.config.CACHE_DIR
            try:
                kept.mkdir(parents=True, exist_ok=True)
            except OSError:
                return numba.njit(error_model="numpy", **options)(function)
            # Numba asks where to keep a function when it is decorated.
            numba.config.CACHE_DIR = str(kept)
            try:
                return numba.njit(error_model="numpy", cache=True, **options)(function)
            finally:
                numba.config.CACHE_DIR = before

        return decorate

    return compiled
