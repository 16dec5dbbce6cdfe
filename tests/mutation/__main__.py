"""Plants each fault in a copy of the tree and runs the tests of the operators on it."""

import importlib.metadata
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import click
from rich.console import Console
from rich.table import Table

from tools.errors import BadInput, Failure, written_whole

from .faults import FAULTS

ROOT = Path(__file__).parents[2]
_COPIED = ("fpu", "rtl", "sim", "boards", "tools", "tests", "pyproject.toml")
#: Files of tests, those first that find most in the shortest time.
TESTS = [f"tests/{name}.py" for name in (
    "fpu/test_pipeline", "fpu/test_chain", "formal/test_comparator", "formal/test_arithmetic", "fpu/test_format",
    "fpu/test_delay", "fpu/test_rom", "fpu/test_operations", "fpu/test_convert", "fpu/test_datapath",
    "formal/test_pipeline", "fpu/test_dot_product", "fpu/test_unary", "fpu/test_operators", "fpu/test_gates")]
#: Of some files of operators, the tests that are most about them, which go before all others.
NEAREST = {f"fpu/{file}.py": f"tests/fpu/{test}.py" for file, test in {
    "convert": "test_convert", "delay": "test_delay", "dot_product": "test_dot_product", "kernel": "test_datapath",
    "graph": "test_datapath", "circuit": "test_datapath", "rom": "test_rom", "table": "test_unary",
    "reciprocal": "test_unary", "reciprocal_square_root": "test_unary", "square_root": "test_unary",
    "root_recurrence": "test_unary", "rounding": "test_operations", "format": "test_format"}.items()}
_SECONDS = 1800


class Broken(Exception):
    """The tests could not be collected: what was planted is no fault of arithmetic."""


def run_tests(folder, nearest=None):
    """Name of the first test that fails in a copy of the tree, or None; ``nearest`` are run before the others."""
    tests = [nearest, *(test for test in TESTS if test != nearest)] if nearest else TESTS
    environment = {**os.environ, "PYTHONPATH": str(folder), "DYNRT_CACHE": str(folder / "cache")}
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-n0", "-p", "no:cacheprovider",
               "--basetemp", str(folder / "temporary"), *tests]
    try:
        result = subprocess.run(command, cwd=folder, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                stderr=subprocess.STDOUT, text=True, errors="replace", timeout=_SECONDS)
    except subprocess.TimeoutExpired:
        return f"more than {_SECONDS} s"
    failed = re.search(r"^(?:FAILED|ERROR) (\S+::\S+)", result.stdout, re.MULTILINE)
    if failed:
        return failed[1]
    if result.returncode:
        raise Broken(result.stdout[-3000:])
    return None


def copy_tree(source, target):
    """What the tests need of the tree, without what was compiled."""
    for name in _COPIED:
        if (source / name).is_dir():
            shutil.copytree(source / name, target / name, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(source / name, target / name)


def killed_by(fault, tree):
    """Name of the test that finds a fault in ``tree``, or None; no fault at all is to be found by none."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        copy_tree(tree, folder)
        if fault:
            path = folder / fault.file
            text = path.read_text()
            if text.count(fault.snippet) != 1:
                raise Broken(f"{fault.file} has {text.count(fault.snippet)} times: {fault.snippet!r}")
            path.write_text(text.replace(fault.snippet, fault.replacement))
        return run_tests(folder, nearest=NEAREST.get(fault.file) if fault else None)


def merged(path, found):
    """Rows of all faults that have been planted, now or in the results before, in the order of the list."""
    earlier = json.loads(path.read_text())["mutants"] if path.exists() else []
    known = {(row["file"], row["fault"]): row["killed_by"] for row in earlier}
    known |= {(fault.file, fault.what): test for fault, test in found.items()}
    places = [(fault.file, fault.what) for fault in FAULTS]
    return [{"file": file, "fault": what, "killed_by": known[file, what]}
            for file, what in places if (file, what) in known]


@click.command()
@click.option("--only", default="", help="Only faults whose file or description contains this; what the output has of "
              "others is kept")
@click.option("--jobs", default=2, show_default=True, type=click.IntRange(min=1), help="How many at a time")
@click.option("-o", "--output", type=click.Path(dir_okay=False, path_type=Path), help="Where the result goes as JSON")
def main(only, jobs, output):
    """Plant each fault in a copy of the tree, run the tests of the operators, and tell which find it."""
    faults = [fault for fault in FAULTS if only in fault.file or only in fault.what]
    if not faults:
        raise BadInput(f"'{only}' is in no fault's file or description; see tests/mutation/faults.py")
    console = Console()

    def attempt(fault):
        try:
            found = killed_by(fault, tree)
        except Broken as error:
            raise Failure(f"{fault.file}: {fault.what}: {error}" if fault else
                          f"the tests of the operators cannot be run: {error}") from error
        console.print(f"{fault.file}: {fault.what}: {found or 'SURVIVED'}" if fault else "no fault",
                      highlight=False, soft_wrap=True)
        return found

    with tempfile.TemporaryDirectory() as temporary, ThreadPoolExecutor(jobs) as pool:
        # All of the same tree, whatever happens to it meanwhile
        tree = Path(temporary)
        copy_tree(ROOT, tree)
        # The operators as they are first, lest a test that always fails find everything.
        unharmed, *found = pool.map(attempt, [None, *faults])
    if unharmed:
        raise Failure(f"{unharmed} fails without any fault")

    table = Table("File", "Fault", "Killed by")
    for fault, test in zip(faults, found, strict=True):
        table.add_row(fault.file, fault.what, test or "[bold red]survived[/]")
    console.print(table)
    num_killed = sum(test is not None for test in found)
    console.print(f"{num_killed} of {len(faults)} killed")
    if output:
        rows = merged(output, dict(zip(faults, found, strict=True)))
        score = sum(row["killed_by"] is not None for row in rows) / len(rows)
        result = {"score": score, "amaranth": importlib.metadata.version("amaranth"), "mutants": rows}
        with written_whole(output) as whole:
            whole.write_text(json.dumps(result, indent=1, ensure_ascii=False) + "\n")
    if num_killed < len(faults):
        raise SystemExit(1)


if __name__ == "__main__":
    main(prog_name="python -m tests.mutation")
