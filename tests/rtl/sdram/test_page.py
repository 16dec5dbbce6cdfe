"""The page shows what was measured."""

from pathlib import Path

import pytest

from tests.rtl.sdram.page import page_text
from tools.errors import BadInput

DOCS = Path(__file__).parents[3] / "docs"


def test_its_tables_are_of_the_results():
    assert (DOCS / "memory.md").read_text() == page_text(DOCS)
    assert "Not measured" not in page_text(DOCS)


def test_without_results(tmp_path):
    with pytest.raises(BadInput, match=r"sdram\.json: is not there; run python -m tests\.rtl\.sdram\.soak first"):
        page_text(tmp_path)
