"""The command that tries millions of pairs, with few of them."""

import json

import pytest
from click.testing import CliRunner

from fpu import Comparator, FloatFormat
from tests.fpu import integers, pairs
from tests.fpu.verilated import Bank

# Its bank is compiled once.
pytestmark = pytest.mark.xdist_group("pairs")


@pytest.fixture(scope="module")
def bank(tmp_path_factory):
    return Bank([Comparator(FloatFormat(3, 2))], tmp_path_factory.mktemp("comparator"))


@pytest.fixture
def run(tmp_path, monkeypatch, bank):
    monkeypatch.setattr(pairs, "all_operators", lambda fmt: [])
    monkeypatch.setattr(pairs, "Bank", lambda operators, folder, optimise: bank)
    output = tmp_path / "result.json"
    return output, lambda: CliRunner().invoke(
        pairs.main, ["--format", "3.2", "--pairs", "2001", "--seed", "4", "-o", str(output)])


def test_no_mismatch(run):
    output, command = run
    result = command()
    assert result.exit_code == 0
    assert result.output == "operator Comparator, latency 2, pairs 2001, mismatches 0\n"
    kept = json.loads(output.read_text())
    assert kept["operators"] == [{"operator": "Comparator", "latency": 2, "pairs": 2001, "mismatches": 0}]
    assert (kept["format"], kept["seed"]) == ("3.2", 4)


def test_mismatches_are_shown(run, monkeypatch):
    def wrong(a, b, *fmt):
        return integers.order(b, a, *fmt)

    output, command = run
    monkeypatch.setitem(pairs.EXACT, Comparator, wrong)
    result = command()
    assert result.exit_code == 1
    assert " instead of 0x4\n" in result.output
    assert result.output.count("instead of") == 8
    assert not output.exists()
