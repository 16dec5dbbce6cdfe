"""Datapaths: hardware, model, kernel and cost of the same graph agree."""

import json

import numba
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from fpu import Adder, Datapath, FloatFormat, Rounding, Subtractor, TableDivider
from fpu import depth as fpu_depth
from fpu.depth import cheapest_latency
from fpu.graph import Vector
from tests.bench import simulate
from tests.fpu import clocked

FMT = FloatFormat(4, 5)
UNARY = ["neg", "abs", "reciprocal", "sqrt", "reciprocal_sqrt"]
BINARY = ["add", "sub", "mul", "div", "min", "max"]
RELATIONS = ["lt", "le", "eq", "gt", "ge"]
TESTS = ["is_zero", "is_negative", "sign"]
LOGIC = ["logical_and", "logical_or"]


@st.composite
def datapaths(draw):
    """Random graphs with a few inputs, some of them late, and several outputs, some of them early."""
    latencies = draw(st.dictionaries(st.sampled_from([
        "add", "mul", "div", "cmp", "rec", "sqrt", "rsqrt", "dot", "select", "register",
        "power"]), st.integers(0, 7)))
    dp = Datapath(FMT, latencies=latencies, rounding=draw(st.sampled_from(Rounding)),
                  operators=draw(st.sampled_from([{}, {"div": TableDivider}])),
                  guard_width=draw(st.sampled_from([None, 2, 3, 5])))
    floats = [dp.input(f"x{index}", delay=draw(st.integers(0, 9))) for index in range(draw(st.integers(1, 3)))]
    floats += [*dp.vector("v"), dp.const(draw(st.sampled_from([0.0, -0.0, 1.0, -0.3, 100.0, float("inf")])))]
    flags = [dp.flag("f", delay=draw(st.integers(0, 9)))]
    powers = [dp.power(floats[0]), dp.const(draw(st.sampled_from([0.0, 0.125, 0.5, 2.0, float("inf")])))]
    for _ in range(draw(st.integers(1, 12))):
        def pick(nodes):
            return draw(st.sampled_from(nodes))
        kind = draw(st.sampled_from(["unary", "binary", "binary", "dot", "relation", "test", "logic", "not", "select",
                                     "register", "power", "within"]))
        if kind == "unary":
            floats.append(getattr(dp, pick(UNARY))(pick(floats)))
        elif kind == "binary":
            floats.append(getattr(dp, pick(BINARY))(pick(floats), pick(floats)))
        elif kind == "dot":
            vectors = [Vector(*(pick(floats) for _ in "xyz")) for _ in range(2)]
            floats.append(dp.dot(*vectors, *draw(st.sampled_from([(), (pick(floats),)]))))
        elif kind == "relation":
            flags.append(getattr(dp, pick(RELATIONS))(pick(floats), pick(floats)))
        elif kind == "test":
            flags.append(getattr(dp, pick(TESTS))(pick(floats)))
        elif kind == "logic":
            flags.append(getattr(dp, pick(LOGIC))(pick(flags), pick(flags), pick(flags)))
        elif kind == "power":
            powers.append(draw(st.sampled_from([
                dp.power(pick(floats)), *(getattr(dp, f"power_{name}")(pick(powers), pick(powers))
                                          for name in ("max", "mul", "div"))])))
        elif kind == "within":
            name = pick(["is_within", "is_at_most_one_plus"])
            flags.append(getattr(dp, name)(pick(floats), pick(powers)))
        elif kind == "register":
            nodes = pick([floats, flags])
            nodes.append(dp.register(pick(nodes)))
        elif kind == "not":
            flags.append(dp.logical_not(pick(flags)))
        else:
            nodes = pick([floats, flags])
            nodes.append(dp.select(pick(flags), pick(nodes), pick(nodes)))
    for index, node in enumerate([*floats[-3:], *powers[-2:], *flags[-2:]]):
        dp.output(f"y{index}", node, early=draw(st.booleans()))
    return dp


def random_inputs(dp, count):
    rng = np.random.default_rng(9)
    values = {}
    for name, node in dp.inputs.items():
        bits = rng.integers(0, 1 << FMT.width, count)
        values[name] = bits % 2 == 1 if node.is_flag else FMT.decode(bits)
    return values


def simulated(dp, inputs, count):
    dut = dp.component()
    got = {name: [] for name in dp.output_names}

    async def testbench(ctx):
        for now in range(count + dp.latency + 10):
            for name, node in dp.inputs.items():
                if 0 <= now - dp.arrival(node) < count:
                    ctx.set(getattr(dut, name), inputs[name][now - dp.arrival(node)].item())
            for name, values in got.items():
                if 0 <= now - dut.latency_of(name) < count:
                    values.append(ctx.get(getattr(dut, name)))
            await ctx.tick()

    simulate(clocked(dut), testbench, name="datapath")
    return got


def same(x, y):
    """Whether arrays are equal and so are the signs of their zeros."""
    x, y = np.asarray(x, np.float64), np.asarray(y, np.float64)
    return (x == y).all() and (np.signbit(x) == np.signbit(y)).all()


@settings(max_examples=20, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(datapaths())
def test_hardware_is_model_is_kernel(tmp_path_factory, dp):
    count = 20
    inputs = random_inputs(dp, count)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("DYNRT_CACHE", str(tmp_path_factory.getbasetemp() / "kernels"))
        model = dp.model(**inputs)
        kernel = dp.kernel()
    rows = [kernel(FMT.params, *(inputs[name][row] for name in dp.input_names)) for row in range(count)]
    hardware = simulated(dp, inputs, count)
    for column, name in enumerate(dp.output_names):
        assert same(model[name], hardware[name])
        assert same(model[name], [row[column] for row in rows])


def ray_plane():
    dp = Datapath(FloatFormat(7, 16), latencies={"add": 4, "mul": 3, "div": 14, "cmp": 1})
    origin, direction = dp.vector("origin"), dp.vector("direction")
    t = dp.neg(dp.div(origin.z, direction.z))
    dp.output("t", t)
    dp.output("u", dp.add(origin.x, dp.mul(t, direction.x)))
    dp.output("behind", dp.is_negative(t))
    return dp


def test_model():
    # All steps are exact.
    result = ray_plane().model(origin_x=np.array([1.0, 2.0, 3.0]), origin_y=0, origin_z=np.array([[4.0], [-4.0]]),
                               direction_x=0.5, direction_y=0, direction_z=-2.0)
    assert result["t"].tolist() == [[2.0] * 3, [-2.0] * 3]
    assert result["u"].tolist() == [[2.0, 3.0, 4.0], [0.0, 1.0, 2.0]]
    assert result["behind"].tolist() == [[False] * 3, [True] * 3]


def test_latency():
    dp = ray_plane()
    assert dp.latency == 14 + 3 + 4
    assert dp.component().latency == dp.latency
    assert dp.arrival(dp.outputs["t"]) == 14
    late = dp.input("late", delay=14)
    dp.output("sooner", dp.add(late, dp.outputs["t"]), early=True)
    assert dp.latency_of("sooner") == 18
    assert dp.latency_of("t") == 21


def test_cost():
    dp = Datapath(FMT)
    a, b, c = (dp.input(name) for name in "abc")
    assert dp.cost() == {"add": 0, "mul": 0, "div": 0, "cmp": 0}
    dp.output("p", dp.select(dp.le(a, b), dp.add(a, b), dp.sub(a, b)))
    dp.output("q", dp.logical_or(dp.lt(a, b), dp.gt(b, a), dp.eq(b, a), dp.is_zero(c)))
    dp.output("r", dp.abs(dp.neg(dp.mul(dp.add(a, b), c))))
    dp.div(a, c)
    assert dp.cost() == {"add": 2, "mul": 1, "div": 0, "cmp": 1}
    dp.output("s", dp.dot(Vector(a, b, c), Vector(c, a, b), dp.sqrt(a)))
    assert dp.cost() == {"add": 2, "mul": 1, "div": 0, "cmp": 1, "sqrt": 1, "dot": 1}


@pytest.fixture
def measured(tmp_path, monkeypatch):
    """A table of depths made up for the test."""
    rows = [["Adder", "7.16", latency, lut, ff, 0, 0, mhz] for latency, lut, ff, mhz in (
        (4, 300, 150, 90.0), (6, 310, 250, 130.0), (7, 300, 250, 140.0), (8, 320, 340, 180.0))]
    rows.append(["Adder", "5.8", 9, 200, 200, 0, 0, 190.0])
    columns = ["operator", "format", "latency", "lut", "ff", "dsp", "ebr", "fmax_worst_mhz"]
    path = tmp_path / "measured.json"
    path.write_text(json.dumps({"columns": columns, "rows": rows}))
    monkeypatch.setattr(fpu_depth, "_TABLE", path)
    fpu_depth._measured.cache_clear()
    yield
    fpu_depth._measured.cache_clear()


def test_cheapest_depth_for_a_clock(measured):
    fmt = FloatFormat(7, 16)
    assert [cheapest_latency(Adder, fmt, clock_mhz=clock) for clock in (80, 100, 135, 175)] == [4, 7, 7, 8]
    assert cheapest_latency(Subtractor, fmt, clock_mhz=100) == 7
    with pytest.raises(ValueError, match=r"^No depth of Adder in 7\.16 reaches 200 MHz; the highest clock is 180 MHz$"):
        cheapest_latency(Adder, fmt, clock_mhz=200)
    # Formats of which not all depths have been measured go by the delays.
    assert cheapest_latency(Adder, FloatFormat(5, 8), clock_mhz=185) == 9
    fast, slow = (cheapest_latency(Adder, FloatFormat(6, 9), clock_mhz=clock) for clock in (170, 60))
    assert slow < fast
    dp = Datapath(fmt, clock_mhz=135, latencies={"mul": 2})
    a, b = dp.input("a"), dp.input("b")
    dp.output("r", dp.add(dp.mul(a, b), b))
    assert dp.latency == 2 + 7


def test_measured_table_is_of_the_operators():
    """The table that is shipped names depths that exist, and some depth of each operator for the chip's clock."""
    table = json.loads(fpu_depth._TABLE.read_text())
    names = {row[0] for row in table["rows"]}
    assert {"Adder", "Multiplier", "Divider", "Comparator"} <= names
    dp = Datapath(FloatFormat(7, 16), clock_mhz=125)
    a, b = dp.input("a"), dp.input("b")
    dp.output("r", dp.select(dp.lt(a, b), dp.add(a, b), dp.mul(a, dp.div(a, b))))
    assert dp.latency > 0

def test_kernel_in_compiled_code():
    dp = ray_plane()
    kernel, params = dp.kernel(), dp.fmt.params

    @numba.njit
    def nearest(depths):
        best = np.inf
        for depth in depths:
            t, _, behind = kernel(params, 0.0, 0.0, depth, 0.0, 0.0, -1.0)
            if not behind:
                best = min(best, t)
        return best

    assert nearest(np.array([5.0, -1.0, 3.0])) == 3.0


def test_kept_in_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("DYNRT_CACHE", str(tmp_path))
    ray_plane().kernel()
    ray_plane().kernel()
    assert len(list(tmp_path.glob("*.py"))) == 1


def test_cache_not_writable(tmp_path, monkeypatch):
    blocked = tmp_path / "file"
    blocked.touch()
    monkeypatch.setenv("DYNRT_CACHE", str(blocked / "below"))
    assert ray_plane().kernel()(FloatFormat(7, 16).params, 0.0, 0.0, 3.0, 0.0, 0.0, -1.0)[0] == 3.0


def test_misuse():
    dp = Datapath(FMT)
    a, flag = dp.input("a"), dp.flag("f")
    with pytest.raises(TypeError, match="float"):
        dp.add(a, flag)
    with pytest.raises(TypeError, match="flag"):
        dp.logical_not(a)
    with pytest.raises(ValueError, match="already"):
        dp.output("a", a)
    with pytest.raises(ValueError, match="identifier"):
        dp.input("a b")
    with pytest.raises(ValueError, match="outputs"):
        dp.kernel()
    with pytest.raises(ValueError, match="not for cube"):
        Datapath(FMT, latencies={"cube": 3})
    with pytest.raises(ValueError, match="not for cube"):
        Datapath(FMT, operators={"cube": Adder})
    dp.output("r", a)
    with pytest.raises(ValueError, match="not members"):
        dp.model(a=0.1, f=False)
    with pytest.raises(TypeError, match="Inputs"):
        dp.model(a=1.0)
