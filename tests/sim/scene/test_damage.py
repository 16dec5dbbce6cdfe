"""Whatever is in a file, its reader gives a scene or says what is wrong, at once."""

import pytest

from .damage import FORMATS, try_damage


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("kind", FORMATS)
def test_damage_is_read_or_refused(tmp_path, kind):
    num_read, num_refused, _ = try_damage(kind, 150, tmp_path)
    assert num_read > 5
    # In scripts nothing is an error.
    assert num_refused > 5 or kind == "scripts"
