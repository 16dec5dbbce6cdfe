"""How far a picture is from the golden one."""

import math
from dataclasses import dataclass

import numpy as np

__all__ = ["Comparison", "compare", "psnr"]


@dataclass(frozen=True)
class Comparison:
    """Differences between hits and golden's hits on the same rays.

    Parameters
    ----------
    num_pixels : int
    num_wrong : int
        Pixels that show another triangle, or one instead of none, or none instead of one.
    num_ambiguous : int
        Wrong pixels where float64 too has two surfaces at one distance, within the tolerance.
    num_cracks : int
        Pixels where a surface was expected and none, or one farther off by more than the tolerance, was
        found.
    max_t_error, mean_t_error : float
        Relative error of t where both show the same triangle; 0 if there is no such pixel.
    """

    num_pixels: int
    num_wrong: int
    num_ambiguous: int
    num_cracks: int
    max_t_error: float
    mean_t_error: float


def compare(golden, other, *, runner_up=None, t_tolerance=1e-3):
    """Compare hits with golden's.

    Parameters
    ----------
    golden, other : Hits
        Of the same rays; only ``instance_id, prim_id, t`` of ``other`` are used.
    runner_up : Hits, optional
        Golden's hits of the same rays with their closest triangles excluded: the second surfaces, against
        which ambiguity is judged. Without it, golden's distance is compared with the other's.
    t_tolerance : float
        Relative to golden's t.

    Returns
    -------
    Comparison
    """
    wrong = (golden.instance_id != other.instance_id) | (golden.prim_id != other.prim_id)
    golden_hit, other_hit = golden.prim_id >= 0, other.prim_id >= 0
    with np.errstate(invalid="ignore"):
        second_t = other.t if runner_up is None else runner_up.t
        ambiguous = wrong & golden_hit & other_hit & (np.abs(second_t - golden.t) <= t_tolerance * golden.t)
        error = np.where(golden_hit & ~wrong, np.abs(other.t - golden.t) / golden.t, 0.0)
    cracks = golden_hit & (~other_hit | (other.t > golden.t * (1 + t_tolerance)))
    num_right = np.count_nonzero(golden_hit & ~wrong)
    return Comparison(wrong.size, int(wrong.sum()), int(ambiguous.sum()), int(cracks.sum()),
                      float(error.max(initial=0.0)), float(error.sum() / num_right) if num_right else 0.0)


def psnr(a, b):
    """Peak signal-to-noise ratio of two 8-bit pictures, 10·log₁₀(255² / mean square difference) in dB; inf if equal."""
    a, b = np.asarray(a), np.asarray(b)
    if a.shape != b.shape or a.dtype != np.uint8 or b.dtype != np.uint8:
        raise ValueError(f"pictures must be uint8 of one shape, not {a.dtype}{a.shape} and {b.dtype}{b.shape}")
    square = np.mean((a.astype(np.float64) - b) ** 2)
    return 10 * math.log10(255 ** 2 / square) if square else math.inf
