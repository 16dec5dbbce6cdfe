"""The chip's configuration: what it refuses and how it says so."""

import pytest
from amaranth.hdl import Fragment

from fpu import FloatFormat
from rtl.config import ChipConfig
from rtl.dynrtc import DynRTC


def test_the_paper_s_prototype():
    config = ChipConfig()
    assert str(config.fmt) == "7.16"
    assert config.num_threads == 64
    # Two levels, 64 states together.
    assert 2 * config.stack_depth == 64
    nodes = config.node_lines * config.node_line_items * 8
    lists = config.list_lines * config.list_line_items * 4
    matrices = config.matrix_lines * 12 * config.fmt.width // 8
    assert (nodes, lists, matrices) == (4096, 2048, 4608)


@pytest.mark.parametrize(("name", "value", "says"), [
    ("num_threads", 0, "num_threads is 0; it must be from 1 to 64"),
    ("num_threads", 65, "num_threads is 65; it must be from 1 to 64"),
    ("stack_depth", 65, "stack_depth is 65; it must be from 1 to 64"),
    ("mailbox_entries", -1, "mailbox_entries is -1; it must be from 0 to 16"),
    ("index_width", 25, "index_width is 25; it must be from 8 to 24"),
    ("coord_width", 3, "coord_width is 3; it must be from 4 to 14"),
    ("num_fetches", 0, "num_fetches is 0; it must be from 1 to 16"),
    ("node_lines", 1, "node_lines is 1; it must be from 2 to 65536"),
    ("node_lines", 48, "node_lines is 48; it must be a power of two"),
    ("list_line_items", 3, "list_line_items is 3; it must be a power of two"),
    ("add_latency", -1, "add_latency is -1; it must be from 0 to 32"),
    ("edge_tolerance", 65, "edge_tolerance is 65; it must be from 0 to 64"),
    ("edge_tolerance", 6, "edge_tolerance is 6; it must be a power of two, or 0"),
])
def test_what_is_refused(name, value, says):
    with pytest.raises(ValueError) as error:
        ChipConfig(**{name: value})
    assert str(error.value) == says


def test_fused_sums_have_no_tolerance():
    with pytest.raises(ValueError) as error:
        ChipConfig(edge_tolerance=4, arithmetic=1)
    assert str(error.value) == ("edge_tolerance is 4, but arithmetic is 1 ('fused'), which does not show its products; "
                                "it must be 0")


def test_it_is_frozen():
    with pytest.raises(AttributeError):
        ChipConfig().num_threads = 3


def test_latencies():
    config = ChipConfig(add_latency=5, mul_latency=4, div_latency=9, cmp_latency=2)
    assert config.latencies == {"add": 5, "mul": 4, "div": 9, "cmp": 2}


@pytest.mark.parametrize("extreme", [
    dict(num_threads=1, stack_depth=1, mailbox_entries=0, num_fetches=1),
    dict(num_threads=3, mailbox_entries=1, node_line_items=1, list_line_items=2, node_lines=2, list_lines=2,
         matrix_lines=2),
    dict(add_latency=0, mul_latency=0, div_latency=2, cmp_latency=0),
    dict(index_width=8, coord_width=4, node_lines=2, list_lines=2, matrix_lines=2),
])
def test_extremes_can_be_built(extreme):
    Fragment.get(DynRTC(ChipConfig(fmt=FloatFormat(4, 4), **extreme)), None)
