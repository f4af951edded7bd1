"""Configurations at a target, with all full turns within the position limits."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.self_motion import SelfMotion
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose

FULL_TURN = 2 * np.pi
EQUAL_DISPLACEMENT = 1e-9
"""Displacements of a joint that differ by less are one [rad]: rounding."""


@dataclass(frozen=True, eq=False)
class EndConfiguration:
    """One branch of the arm at the start or the goal of a motion.

    Equality is identity, so end configurations can be keys of a dictionary.
    """

    label: str
    """Name of the branch."""
    q: Array
    """Joint positions, shape (nq,) [rad]."""
    choices: list[list[float]]
    """Positions of each joint with all full turns within the limits [rad]."""
    fixed: bool
    """Whether the target gives joint positions, so that the number of full turns is fixed."""
    target: int = 0
    """Index of the target."""
    tolerance: ConeOrientedPose | None = None
    """The target if its orientation is partly free; the configuration is then one sample."""
    self_motion: SelfMotion | None = None
    """Self-motion at the target's pose; the configuration is then one sample of the curve."""

    @cached_property
    def sampled(self) -> bool:
        """Whether the target has infinitely many configurations, and this is a sample."""
        return self.tolerance is not None or self.self_motion is not None


def joint_options(
    starts: list[float], goals: list[float], fixed: bool, windings: bool
) -> list[tuple[float, float]]:
    """Pairs of start and goal position of one joint, one pair per displacement of interest.

    Displacements differ by full turns. A displacement beyond a full turn is left out unless it is
    the least one or an end is `fixed`, because one full turn less connects the same branches.

    Args:
        starts: positions at the start, equal up to full turns [rad].
        goals: positions at the goal, equal up to full turns [rad].
        fixed: whether an end gives joint positions; every pair is then kept.
        windings: whether displacements beyond the least one are of interest.

    Returns:
        Pairs (start, goal) [rad], the least displacement first.
    """
    both = sorted(
        product(starts, goals),
        key=lambda pair: (abs(pair[1] - pair[0]), abs(pair[0]) + abs(pair[1])),
    )
    if not windings:
        return both[:1]
    if fixed:
        return both
    least = both[0][1] - both[0][0]
    kept = {0: both[0]}
    for s, g in both:
        if abs(g - s) < FULL_TURN + EQUAL_DISPLACEMENT:
            kept.setdefault(round((g - s - least) / FULL_TURN), (s, g))
    return list(kept.values())
