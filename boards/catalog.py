"""The boards that there are."""

from .icepi_zero import ICEPI_ZERO
from .ulx3s import ULX3S_25F, ULX3S_45F, ULX3S_85F

__all__ = ["BOARDS"]

#: By name
BOARDS = {board.name: board for board in (ULX3S_85F, ULX3S_45F, ULX3S_25F, ICEPI_ZERO)}
