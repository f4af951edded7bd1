"""How far an energy may be above the least possible."""

from __future__ import annotations

from math import ceil


def optimality_gap(lower_bound: float, energy: float) -> float | None:
    """The largest share by which an energy may be above the least possible.

    It is energy / lower_bound - 1; None if the bound is not positive.
    """
    return energy / lower_bound - 1 if lower_bound > 0 else None


def gap_text(gap: float | None) -> str:
    """A gap in words, rounded up: `at most 5.8% above the least possible`."""
    if gap is None:
        return "no positive lower bound"
    # errors of rounding do not count
    return f"at most {ceil(round(1000 * gap, 6)) / 10:.1f}% above the least possible"
