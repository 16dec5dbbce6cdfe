"""Floating-point arithmetic: formats, pipelined operators, their bit-exact emulation, and datapaths made of them."""

from .adder import Adder, Subtractor
from .choice import Maximum, Minimum
from .comparator import Comparator
from .convert import FloatToInt, IntToFloat
from .datapath import Datapath
from .delay import Delay
from .divider import Divider
from .dot_product import DotProduct
from .format import FloatFormat
from .graph import Vector
from .multiplier import Multiplier
from .reciprocal import Reciprocal, TableDivider
from .reciprocal_square_root import ReciprocalSquareRoot
from .root_recurrence import DigitReciprocalSquareRoot, reciprocal_square_root_for
from .rounding import Rounding
from .square_root import SquareRoot

__all__ = [
    "Adder", "Comparator", "Datapath", "Delay", "DigitReciprocalSquareRoot", "Divider", "DotProduct", "FloatFormat",
    "FloatToInt", "IntToFloat", "Maximum", "Minimum", "Multiplier", "Reciprocal", "ReciprocalSquareRoot", "Rounding",
    "SquareRoot", "Subtractor", "TableDivider", "Vector", "reciprocal_square_root_for",
]
