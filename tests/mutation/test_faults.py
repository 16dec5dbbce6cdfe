"""The list of faults is about the operators as they are."""

from collections import Counter
from pathlib import Path

import pytest

from tests.mutation.faults import FAULTS

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: f"{fault.file}: {fault.what}")
def test_the_text_is_there_once(fault):
    assert (ROOT / fault.file).read_text().count(fault.snippet) == 1
    assert fault.snippet != fault.replacement


def test_no_fault_is_planted_twice():
    assert Counter((fault.file, fault.snippet, fault.replacement) for fault in FAULTS).most_common(1)[0][1] == 1
    assert len(FAULTS) >= 40
