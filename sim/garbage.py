"""How often Python looks for garbage."""

import gc

__all__ = ["collect_rarely"]


def collect_rarely():
    """For a process that elaborates chips: that makes millions of objects, which all stay to its end."""
    gc.set_threshold(200_000, 20, 20)
