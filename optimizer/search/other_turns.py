"""Motions to samples of a free orientation with a joint turned the other way around.

A sample has the full turns of least displacement; the other way around, a joint has more friction
to overcome. But if a joint has about half a turn to go, friction is nearly the same both ways.
Gravity is not, and still less the regenerated power that an isolated bus burns: one way may need
twice as much energy as the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from joulepath.optimizer.kinematics.end_configuration import FULL_TURN
from joulepath.optimizer.motion.seven_segment import shortest_duration
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.search.candidates import Candidate, bound
from joulepath.optimizer.search.seeds import estimates_between
from joulepath.optimizer.solve.methods.method import above


@dataclass(frozen=True)
class OtherTurnSettings:
    """Settings of the choice of motions with a joint turned the other way around."""

    most: int = 64
    """Largest number of motions, in order of their expected energies."""
    energy_ratio: float = 1.15
    """Largest ratio of the expected energy to the least expected energy."""


OTHER_TURNS = OtherTurnSettings()


def other_turns(
    prepared: PreparedProblem, samples: Sequence[Candidate], least: float
) -> list[Candidate]:
    """Samples with one joint turned the other way around and little expected energy.

    The expected energy is the mean of a lower bound and a rough estimate, as in `seeds.expected`.
    The bound is the sample's plus the Coulomb loss of the joint's longer displacement. Starts that
    are given have no other turns.

    Args:
        prepared: problem of the motions.
        samples: samples.
        least: least expected energy of other motions [J].
    """
    if not prepared.problem.windings:
        return []
    limits = prepared.arm.active_limits
    coulomb = prepared.arm.friction_law.coulomb
    q_start, q_goal = (
        np.array([getattr(each, name) for each in samples]) for name in ("q_start", "q_goal")
    )
    displacement = q_goal - q_start
    given = np.array([[each.start.fixed] for each in samples])
    turn = -FULL_TURN * np.sign(displacement)
    at_goal = (q_goal + turn >= limits.q_min) & (q_goal + turn <= limits.q_max)
    at_start = (q_start - turn >= limits.q_min) & (q_start - turn <= limits.q_max) & ~given
    longer = np.abs(displacement + turn) - np.abs(displacement)
    bounds = np.array([[each.lower_bound] for each in samples]) + coulomb * longer
    most = above(least, OTHER_TURNS.energy_ratio)
    rows, joints = np.nonzero((at_goal | at_start) & (displacement != 0) & (bounds <= most))
    if not len(rows):
        return []
    each, by_goal, turn = np.arange(len(rows)), at_goal[rows, joints], turn[rows, joints]
    q_start, q_goal = q_start[rows], q_goal[rows]
    q_goal[each, joints] += np.where(by_goal, turn, 0.0)
    q_start[each, joints] -= np.where(by_goal, 0.0, turn)
    shortest = np.asarray(shortest_duration(q_goal - q_start, limits))
    energy = (
        estimates_between(prepared, q_start, q_goal, shortest, rough=True) + bounds[rows, joints]
    ) / 2
    turned = [
        Candidate(samples[rows[k]].start, samples[rows[k]].goal, q_start[k], q_goal[k])
        for k in np.argsort(energy, kind="stable")[: OTHER_TURNS.most].tolist()
        if energy[k] <= most
    ]
    if turned:
        bound(prepared, turned, [])
    return turned
