"""Files of results: JSON under docs/results, read to be added to and written whole."""

import json

from .errors import BadInput, written_whole

__all__ = ["earlier_results", "json_text", "write_texts"]


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
