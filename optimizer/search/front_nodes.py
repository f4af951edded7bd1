"""Durations tried for a front of energy and duration, and the choice of the next one."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise

import numpy as np

from joulepath.optimizer.motion.spline import Spline
from joulepath.optimizer.result.solution import Solution


@dataclass(frozen=True)
class FrontNodeSettings:
    """Settings of the choice of durations."""

    same_duration: float = 2e-4
    """Relative distance up to which two durations count as one."""
    same_jump: float = 2e-3
    """Relative distance of the durations around a jump at which it is located well enough."""


NODES = FrontNodeSettings()


@dataclass(frozen=True)
class FrontNode:
    """A duration [s] tried, with its answer or the reason for none, and its objective [J] or
    inf.
    """

    duration: float
    answer: Solution | None
    energy: float = math.inf
    reason: str = ""

    @property
    def spline(self) -> Spline | None:
        """The motion; None if there is none."""
        return None if self.answer is None else self.answer.trajectory.spline


def next_interval(nodes: Sequence[FrontNode]) -> int | None:
    """Index of the node after which a further duration tells most about the front.

    Returns:
        The index; None if all nodes are near enough to their neighbours.
    """
    found = [node.energy for node in nodes if node.answer is not None]
    if not found:
        return None
    # least energy up to every duration, which dominated nodes and nodes without motion do not lower
    least = list(accumulate((min(node.energy, max(found)) for node in nodes), min))
    last = next(k for k, energy in enumerate(least) if energy == least[-1])
    rise = math.log(nodes[last].duration / nodes[0].duration)
    fall = least[0] - least[-1]
    longest, chosen = 0.0, None
    for k, (left, right) in enumerate(pairwise(nodes[: last + 1])):
        if not distinct(
            left.duration,
            right.duration,
            NODES.same_jump if switches(left, right) else NODES.same_duration,
        ):
            continue
        falls = least[k] - least[k + 1]
        if falls == 0 and not switches(left, right):
            continue  # one candidate with slower motions that need no less energy
        sides = math.log(right.duration / left.duration) / rise + falls / fall
        if sides > longest:
            longest, chosen = sides, k
    return chosen


def distinct(earlier: float, later: float, share: float = NODES.same_duration) -> bool:
    """Whether a duration exceeds another one by more than a relative distance."""
    return later > earlier * (1 + share)


def switches(left: FrontNode, right: FrontNode) -> bool:
    """Whether two nodes have motions of different candidates."""
    a, b = left.answer, right.answer
    if a is None or b is None:
        return False
    return not (np.array_equal(a.start.q, b.start.q) and np.array_equal(a.goal.q, b.goal.q))
