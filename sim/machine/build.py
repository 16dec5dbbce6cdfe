"""A chip compiled for the simulator, once for each configuration, and kept."""

import importlib.metadata
from pathlib import Path

from amaranth.back.verilog import YosysError

from rtl.dynrtc import DynRTC
from rtl.memory_ports import memory_ports
from rtl.observation import UNITS

from ..cache import cache_directory
from .library import BuildError, digest_of, kept_library, optimisation
from .verilog import component_verilog

__all__ = ["BuildError", "bench_defines", "chip_library"]

_PACKAGES = ("fpu", "rtl")
_HERE = Path(__file__).parent
_BENCH = _HERE / "bench.cpp"
_TRACES = {"": 0, "vcd": 1, "fst": 2}


def bench_defines(config):
    """What the benches of chips are told by the preprocessor."""
    return {"BENCH_UNITS": len(UNITS), "BENCH_PIPELINES": config.num_pipelines,
            "BENCH_TEXTURES": int("textures" in memory_ports(config))}


def _key(config, trace):
    files = [path for package in _PACKAGES for path in sorted((_HERE.parents[1] / package).rglob("*.py"))]
    return digest_of(config, trace, optimisation(trace), importlib.metadata.version("amaranth"),
                     [path.read_bytes() for path in (*files, _HERE / "build.py", _HERE / "verilog.py")], bench=_BENCH)


def _verilog(config):
    try:
        return component_verilog(DynRTC(config), name="dynrtc")
    except ValueError as error:
        raise BuildError(f"such a chip cannot be built: {error}") from error
    except YosysError as error:
        raise BuildError(f"yosys failed: {error}") from error


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
    return kept_library(cache_directory() / "chips" / _key(config, trace), lambda: _verilog(config), name="dynrtc",
                        bench=_BENCH, defines={**bench_defines(config), "BENCH_TRACE": _TRACES[trace]},
                        optimise=optimisation(trace), trace=trace, progress=progress)
