"""The pages show what was measured."""

from pathlib import Path

import pytest

from tests.rtl.video.page import PAGES, page_text
from tools.errors import BadInput

DOCS = Path(__file__).parents[3] / "docs"


@pytest.mark.parametrize("name", PAGES)
def test_their_tables_are_of_the_results(name):
    assert (DOCS / name).read_text() == page_text(DOCS, name)


def test_without_results(tmp_path):
    with pytest.raises(BadInput, match=r"dvi\.json: is not there; run python -m tests\.rtl\.video\.picture first"):
        page_text(tmp_path, "video.md")
