"""Imports run one way only, and the chip needs neither numpy nor files."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
#: Each may import what stands before it.
LAYERS = ("fpu", "rtl", "sim", "boards", "tools")
NOT_IN_RTL = {"numpy", "numba", "os", "io", "pathlib", "shutil", "tempfile"}


def imports(tree, package):
    """Names of the modules that a module of ``package``, a tuple of names, imports."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            if not node.level:
                yield node.module
                continue
            base = package[:len(package) - node.level + 1]
            if not base:
                # The folder above the packages, from which one of them may be meant.
                yield from (node.module,) if node.module else (alias.name for alias in node.names)
            else:
                yield ".".join((*base, *([node.module] if node.module else [])))


def violations(source, package):
    """What a module of ``package`` does that its layer must not."""
    tree = ast.parse(source)
    layer = package[0]
    allowed = LAYERS[:LAYERS.index(layer) + 1]
    roots = {name.split(".")[0] for name in imports(tree, package)}
    found = [f"imports {name}" for name in roots & {*LAYERS, "tests"} if name not in allowed]
    if layer == "rtl":
        found += [f"imports {name}" for name in roots & NOT_IN_RTL]
        found += ["opens files" for node in ast.walk(tree)
                  if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "open"]
    return sorted(found)


def modules():
    return [path for layer in LAYERS for path in sorted((ROOT / layer).rglob("*.py"))]


@pytest.mark.parametrize("path", modules(), ids=lambda path: str(path.relative_to(ROOT)))
def test_module(path):
    assert violations(path.read_text(), path.relative_to(ROOT).parts[:-1]) == []


def test_there_are_modules():
    assert {path.relative_to(ROOT).parts[0] for path in modules()} == {*LAYERS}


@pytest.mark.parametrize(("package", "source", "found"), [
    (("fpu",), "from rtl.queue import Queue", ["imports rtl"]),
    (("fpu",), "def f():\n    import sim.model", ["imports sim"]),
    (("rtl",), "from sim import scene\nimport fpu", ["imports sim"]),
    (("sim", "model"), "from tools.render import x", ["imports tools"]),
    (("sim", "model"), "from ..scene import x\nfrom .packet import y\nimport rtl.cache", []),
    (("sim", "model"), "from ...tools import x", ["imports tools"]),
    (("sim",), "from .. import boards", ["imports boards"]),
    (("boards",), "from tests.bench import simulate", ["imports tests"]),
    (("rtl",), "import numpy as np\nfrom pathlib import Path", ["imports numpy", "imports pathlib"]),
    (("rtl",), "import os.path", ["imports os"]),
    (("rtl",), "text = open('a').read()", ["opens files"]),
    (("sim",), "import numpy, os\nopen('a')", []),
    (("tools",), "import fpu, rtl, sim, boards", []),
])
def test_it_would_be_caught(package, source, found):
    assert violations(source, package) == found
