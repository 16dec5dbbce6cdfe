"""``dynrt units`` as typed."""

from pathlib import Path

from click.testing import CliRunner

from tools.cli import main

PAGE = "# Boards\n\n<!-- begin: alone -->\n<!-- end: alone -->\n"


def run(*arguments, folder):
    (folder / "results").mkdir()
    (folder / "board.md").write_text(PAGE)
    return CliRunner().invoke(main, ["units", "--docs", str(folder), *map(str, arguments)])


def test_no_such_unit(tmp_path):
    result = run("--chip", "num_threads=2", "bus", folder=tmp_path)
    assert result.exit_code == 2
    assert result.output.startswith("Error: bus: no such unit; there are nodes_cache, lists_cache, ")
    assert "queue" not in result.output
    assert (tmp_path / "board.md").read_text() == PAGE
    assert not list((tmp_path / "results").iterdir())


def test_no_place_for_the_table(tmp_path):
    (tmp_path / "board.md").write_text("# Boards\n")
    result = CliRunner().invoke(main, ["units", "--docs", str(tmp_path)])
    assert result.exit_code == 2
    assert result.output == (f"Error: {Path(tmp_path) / 'board.md'}: must have the lines '<!-- begin: alone -->' and "
                             "'<!-- end: alone -->' once, for the table between them\n")
