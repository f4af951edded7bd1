"""The rule that every answer keeps: it is never dearer than a feasible motion in hand.

What a search finds on its way stays in hand: motions of other candidates, coarser ones, the motions
that the answer is compared with, those that are known from before. The answer is the one of them
that needs least and that its certificate confirms in time.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Protocol, TypeVar

T_co = TypeVar("T_co", covariant=True)
T = TypeVar("T")


class InHand(Protocol[T_co]):
    """A motion, or a cycle of motions, that may be feasible."""

    @property
    def cost(self) -> float:
        """Its objective [J]."""
        ...

    def certified(self) -> T_co | None:
        """The answer that it makes; None if its certificate does not confirm it, or not in time."""
        ...


def least_certified(known: Iterable[InHand[T]]) -> T | None:
    """The answer of least objective that is certified; of equals the first, None if there is
    none."""
    for each in sorted(known, key=lambda each: each.cost):
        answer = each.certified()
        if answer is not None:
            return answer
    return None
