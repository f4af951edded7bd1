"""Names of the branches of an arm, and numbers for an arm whose branches have no names."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.problem.branches import Label, NumberedBranch

DECIMALS = 6
"""Decimals of the joint positions [rad] that order branches; coarser than rounding."""


class NamedBranches(Protocol):
    """Geometry of an arm that names its branches."""

    def label(self, q: Array) -> Label:
        """Branch of a configuration q (nq,) [rad]."""
        ...

    def singular_parts(self, q: Array) -> tuple[str, ...]:
        """Singular parts of the label at q (nq,) [rad]."""
        ...


def in_order(q: Array) -> Array:
    """Solutions (n, nq) [rad], sorted by joint positions, in the order of their numbers.

    Positions are rounded first, and -π counts as π: shared joint positions of two branches differ
    by rounding, and a half turn may have either sign.
    """
    keys = np.round(q, DECIMALS)
    keys[keys <= np.round(-np.pi, DECIMALS)] = np.round(np.pi, DECIMALS)
    return np.asarray(q[np.lexsort(keys.T[::-1])])


def numbered(q: Array, solutions: Array) -> NumberedBranch:
    """Number of q (nq,) [rad]: the index of the nearest of the solutions (n, nq) [rad] of its pose,
    from 1.
    """
    if not len(solutions):
        return NumberedBranch(1)
    return NumberedBranch(int(np.abs(wrapped(solutions - q)).max(axis=1).argmin()) + 1)
