"""Branch and bound over boxes of joint positions: those of the least bounds are split until these
are enough.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, fields
from typing import Generic, Self, TypeVar

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.deadline import Deadline

# boxes split in a round, rounds, and rounds of a tight bound
SPLIT, ROUNDS, TIGHT_ROUNDS = 400, 80, 200
# after so many rounds, and unless the bound is to be tight, a bound within this share of what is
# enough will do
FEW, NEARLY = 24, 0.1


@dataclass(frozen=True)
class Boxes:
    """Boxes, or tuples of boxes: middles and half sides (b, …, nq) [rad], and the bound (b,) [J],
    inf for one without configurations."""

    centre: Array
    half: Array
    value: Array

    def __getitem__(self, chosen: Indices) -> Self:
        return type(self)(*(getattr(self, each.name)[chosen] for each in fields(self)))

    def joined(self, other: Self) -> Self:
        """These boxes, then the others."""
        return type(self)(
            *(
                np.concatenate([getattr(b, each.name) for b in (self, other)])
                for each in fields(self)
            )
        )


B = TypeVar("B", bound=Boxes)


class BoxSearch(ABC, Generic[B]):
    """What is split, and how."""

    @abstractmethod
    def first(self) -> B:
        """Boxes that cover every position of the joints."""

    @abstractmethod
    def halved(self, boxes: B) -> B:
        """Both halves of every box, with their bounds: none below that of the whole."""

    @abstractmethod
    def settled(self, half: Array) -> bool:
        """Whether a box of these half sides (…, nq) [rad] is not worth splitting."""

    def run(self, rounds: int, deadline: Deadline, enough: float, nearly: float) -> float:
        """The least bound [J] of any box after at most so many rounds of splitting, or once it is
        enough; after FEW rounds, once it is within the share `nearly` of that."""
        boxes = self.first()
        for n in range(rounds):
            boxes = boxes[np.flatnonzero(np.isfinite(boxes.value))]
            order = np.argsort(boxes.value, kind="stable")
            will_do = enough if n < FEW else enough - nearly * abs(enough)
            if not len(order) or boxes.value[order[0]] >= will_do or deadline.passed:
                break
            if self.settled(boxes.half[order[0]]):
                break
            boxes = boxes[order[SPLIT:]].joined(self.halved(boxes[order[:SPLIT]]))
        return float(boxes.value.min(initial=np.inf))
