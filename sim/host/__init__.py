"""The other end of the cable: what a host says to a chip, and a board that answers as the chip does."""

from .board import Board
from .driver import BoardReset, Driver, LinkError, NoAnswer, Refused
from .wire import Deframer, Frame

__all__ = ["Board", "BoardReset", "Deframer", "Driver", "Frame", "LinkError", "NoAnswer", "Refused"]
