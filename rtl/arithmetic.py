"""How a chip may compute what its datapaths say: rounding, sums of products, quotients."""

from dataclasses import dataclass

from fpu import Rounding, TableDivider

__all__ = ["ARITHMETICS", "NUMBERS", "Arithmetic"]


@dataclass(frozen=True, kw_only=True)
class Arithmetic:
    """A way of computing, for datapaths.

    Parameters
    ----------
    name : str
        What it is called on the command line and in results.
    rounding : :class:`~fpu.Rounding`
        How results are rounded.
    fused : bool
        Whether the transformation's sums of products are fused, and rounded once.
    guard_width : int or None
        Of those, see :class:`~fpu.DotProduct`.
    by_reciprocal : bool
        Whether a kd-step multiplies by the reciprocal of the direction instead of dividing by it.
    by_table : bool
        Whether quotients come from a table and multiplier blocks, bit for bit the same.
    """

    name: str
    rounding: Rounding = Rounding.NEAREST_EVEN
    fused: bool = False
    guard_width: int | None = None
    by_reciprocal: bool = False
    by_table: bool = False

    @property
    def parameters(self):
        """Keyword arguments of a :class:`~fpu.Datapath`."""
        return {"rounding": self.rounding, "guard_width": self.guard_width,
                "operators": {"div": TableDivider} if self.by_table else {}}


#: The choices of ``ChipConfig.arithmetic``; the first is the paper's, with IEEE 754's rounding.
ARITHMETICS = (
    Arithmetic(name="separate"),
    Arithmetic(name="fused", fused=True),
    Arithmetic(name="fused-narrow", fused=True, guard_width=6),
    Arithmetic(name="truncated", rounding=Rounding.TRUNCATE),
    Arithmetic(name="reciprocal", by_reciprocal=True),
    Arithmetic(name="table", by_table=True),
)
#: Their numbers, by name.
NUMBERS = {arithmetic.name: number for number, arithmetic in enumerate(ARITHMETICS)}
