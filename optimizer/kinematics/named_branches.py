"""What names the branches of an arm, and numbers for those of an arm that has no names."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.problem.branches import Label, NumberedBranch

# digits of joint positions [rad] that order branches
DIGITS = 6


class NamedBranches(Protocol):
    """The geometry of an arm, as far as it names branches."""

    def label(self, q: Array) -> Label:
        """The branch of a configuration q (nq,) [rad]."""
        ...

    def singular_parts(self, q: Array) -> tuple[str, ...]:
        """The parts of the label that are singular at q (nq,) [rad]."""
        ...


def in_order(q: Array) -> Array:
    """Solutions (n, nq) [rad] in the order of their numbers.

    Joints of branches that share them differ by rounding, and half a turn may have either sign:
    neither counts.
    """
    keys = np.round(q, DIGITS)
    keys[keys <= np.round(-np.pi, DIGITS)] = np.round(np.pi, DIGITS)
    return np.asarray(q[np.lexsort(keys.T[::-1])])


def numbered(q: Array, solutions: Array) -> NumberedBranch:
    """The number of q (nq,) [rad] among the solutions (n, nq) [rad] of its pose, by the nearest of
    them.
    """
    if not len(solutions):
        return NumberedBranch(1)
    return NumberedBranch(int(np.abs(wrapped(solutions - q)).max(axis=1).argmin()) + 1)
