"""``python -m tools`` is ``dynrt``."""

from .cli import main

main(prog_name="dynrt")
