"""Files of results: JSON under docs/results, read to be added to and written whole."""

import hashlib
import json
from pathlib import Path

from .errors import BadInput, written_whole

__all__ = ["code_version", "earlier_results", "json_text", "write_texts"]

_ROOT = Path(__file__).parents[1]


def code_version(*patterns, what=()):
    """Of the code that a result depends on, files by pattern below the top, and of ``what`` else does.

    Rows of another version are measured anew.
    """
    code = hashlib.sha256(repr(what).encode())
    for pattern in patterns:
        for path in sorted(_ROOT.glob(pattern)):
            code.update(path.read_bytes())
    return code.hexdigest()[:16]


def earlier_results(path):
    """What an earlier run has written, {} if there was none.

    Raises
    ------
    BadInput
        If it is not JSON.
    """
    if not path.exists():
        return {}
    try:
        return json.loads(path.read_text())
    except ValueError as error:
        raise BadInput(f"{path}: is not JSON ({error}); remove it to measure anew") from error


def json_text(results):
    """Results as they are kept where each need not be a line."""
    return json.dumps(results, indent=1) + "\n"


def write_texts(texts):
    """Write each text, by its path, whole."""
    for path, text in texts.items():
        with written_whole(path) as whole:
            whole.write_text(text)
