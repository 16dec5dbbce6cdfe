"""Where the scenes that are not part of the repository lie."""

import os
from pathlib import Path

import pytest

_DEFAULT = Path(__file__).parents[2] / ".." / "shared" / "scenes"


@pytest.fixture
def scene_file():
    """Function from a name in the scenes' folder to its path; skips the test if the file is absent."""
    folder = Path(os.environ.get("DYNRT_SCENES", _DEFAULT))

    def find(name):
        if not (folder / name).exists():
            pytest.skip(f"{folder / name} is not there")
        return folder / name

    return find
