"""Configurations that reach a target, with the full turns that the position limits leave open."""

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

    Two end configurations are equal only if they are the same object, so that they can be keys.
    """

    label: str
    """Name of the branch."""
    q: Array
    """Joint positions, shape (nq,) [rad]."""
    choices: list[list[float]]
    """For each joint, its position with every full turn within the limits [rad]."""
    fixed: bool
    """Whether the target gives the joint positions: then no other full turns are allowed."""
    target: int = 0
    """Index of the target that the configuration reaches."""
    tolerance: ConeOrientedPose | None = None
    """The target if its orientation is partly free; the configuration is a sample of it then."""
    self_motion: SelfMotion | None = None
    """The curve that holds the target's pose, of which the configuration is a sample."""

    @cached_property
    def sampled(self) -> bool:
        """Whether infinitely many configurations reach the target, and this is a sample."""
        return self.tolerance is not None or self.self_motion is not None


def joint_options(
    starts: list[float], goals: list[float], fixed: bool, windings: bool
) -> list[tuple[float, float]]:
    """Pairs of start and goal position of one joint, one pair for each displacement of interest.

    Displacements differ by full turns, whose number tells them apart. One beyond a full turn is
    left out unless it is the least one or an end is `fixed`: without the full turn the same
    branches are nearer.

    Args:
        starts: positions at the start that differ by full turns [rad].
        goals: positions at the goal that differ by full turns [rad].
        fixed: whether one of the ends gives joint positions, so that every pair is distinct.
        windings: whether other displacements than the least one are of interest.

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
