"""Where compiled chips and models are kept."""

import os
from pathlib import Path

__all__ = ["cache_directory"]


def cache_directory():
    """The folder that ``DYNRT_CACHE`` names, or one in the user's cache."""
    base = os.environ.get("DYNRT_CACHE")
    if base:
        return Path(base)
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "dynrt"
