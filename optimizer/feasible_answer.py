"""Choice of the answer among feasible motions: no answer needs more than a certified motion known.

The candidates are motions found during a search: of other candidates, of coarser solves, of
baselines, or known from before. The answer is the motion of least objective that its certificate
confirms in time.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol, TypeVar

T_co = TypeVar("T_co", covariant=True)
T = TypeVar("T")


class FeasibleAnswer(Protocol[T_co]):
    """A motion, or a cycle of motions, that may be feasible."""

    @property
    def cost(self) -> float:
        """Objective [J]."""
        ...

    def certified(self) -> T_co | None:
        """The certified answer; None if its certificate fails, or the time is up."""
        ...


def least_certified(known: Iterable[FeasibleAnswer[T]]) -> T | None:
    """The certified answer of least objective, the first of equals; None if there is none."""
    for each in sorted(known, key=lambda each: each.cost):
        answer = each.certified()
        if answer is not None:
            return answer
    return None
