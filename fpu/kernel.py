"""Software of a datapath, compiled from Python source that is generated from the graph."""

import hashlib
import importlib.util
import os
import sys
import tempfile
from pathlib import Path
from types import SimpleNamespace

__all__ = ["compile_kernel", "kernel_source"]


_EXPRESSIONS = {
    "register": "{}",
    "neg": "-{}",
    "abs": "abs({})",
    "is_zero": "{} == 0.0",
    "is_negative": "{} < 0.0",
    "sign": "copysign(1.0, {}) < 0.0",
    "is_finite": "abs({}) != inf",
    "is_at_most_one": "{} <= 1.0",
    "not": "not {}",
    "select": "{1} if {0} else {2}",
    "is_within": "abs({0}) < {1}",
    "is_at_most_one_plus": "{0} <= 1.0 or {0} - 1.0 < min({1}, 1.0)",
}
_RELATIONS = {"lt": "<", "eq": "==", "gt": ">"}


def _expression(node, names, guard_width):
    operands = [names[operand] for operand in node.operands if operand.op != "compare"]
    if node.op == "const":
        return repr(node.payload)
    if node.op in _RELATIONS:
        return f" {_RELATIONS[node.op]} ".join(names[operand] for operand in node.operands[0].operands)
    if node.op in ("and", "or"):
        return f" {node.op} ".join(operands)
    if node.op in _EXPRESSIONS:
        return _EXPRESSIONS[node.op].format(*operands)
    if node.op == "dot":
        addend = ["0.0"] if len(operands) == 6 else []
        operands = [str(-1 if guard_width is None else guard_width), *operands, *addend]
    return f"{node.op}(params, {', '.join(operands)})"


def kernel_source(datapath, *, cache):
    """Python source of a datapath's functions.

    ``kernel(params, *inputs)`` returns a tuple of the outputs; ``sweep(params, *inputs, *outputs)`` fills
    one-dimensional arrays of outputs from those of inputs. Both are compiled by numba, and kept if ``cache``.
    """
    nodes = datapath.nodes
    names = {node: f"in_{name}" for name, node in datapath.inputs.items()}
    inputs = list(names.values())
    emulations = {node.op: datapath.emulation(node.op) for node in nodes if datapath.emulation(node.op)}
    lines = ["from math import copysign, inf", "", "import numba", ""]
    lines += [f"from {function.__module__} import {function.__name__} as {op}"
              for op, function in sorted(emulations.items())]
    decorator = f"@numba.njit(error_model='numpy', nogil=True, cache={cache})"
    lines += ["", "", decorator, f"def kernel({', '.join(['params', *inputs])}):"]
    for index, node in enumerate(nodes):
        if node.op not in ("input", "compare"):
            names[node] = f"{node.op}_{index}"
            lines.append(f"    {names[node]} = {_expression(node, names, datapath.guard_width)}")
    outputs = [f"out_{name}" for name in datapath.output_names]
    results = "".join(f"{names[node]}, " for node in datapath.outputs.values())
    elements = ["params", *(f"{name}[index]" for name in inputs)]
    lines += [f"    return ({results})", "", "", decorator,
              f"def sweep({', '.join(['params', *inputs, *outputs])}):",
              f"    for index in range({outputs[0]}.size):",
              f"        {''.join(f'{output}[index], ' for output in outputs)}= kernel({', '.join(elements)})", ""]
    return "\n".join(lines)


def _cache_directory():
    return Path(os.environ.get("DYNRT_CACHE") or Path.home() / ".cache" / "dynrt")


def _load_kept(source):
    # The name tells versions of the emulation apart too, since numba looks at no other file than this one.
    digest = hashlib.sha256(source.encode())
    for path in sorted(Path(__file__).parent.glob("*.py")):
        digest.update(path.read_bytes())
    name = f"datapath_{digest.hexdigest()[:24]}"
    path = _cache_directory() / f"{name}.py"
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile("w", dir=path.parent, suffix=".tmp", delete=False) as file:
            file.write(source)
        os.replace(file.name, path)
    spec = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)
    # Compiled code that is kept refers to its module by name.
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


def compile_kernel(datapath):
    """Namespace with the functions ``kernel`` and ``sweep`` of :func:`kernel_source`.

    The compiled code is kept in the directory that the environment variable ``DYNRT_CACHE`` names, by default
    ``~/.cache/dynrt``; where that cannot be written it is compiled anew in each process.

    Raises
    ------
    ValueError
        If the datapath has no outputs.
    """
    if not datapath.output_names:
        raise ValueError("Datapath has no outputs")
    try:
        return _load_kept(kernel_source(datapath, cache=True))
    except OSError:
        functions = {}
        exec(kernel_source(datapath, cache=False), functions)
        return SimpleNamespace(kernel=functions["kernel"], sweep=functions["sweep"])
