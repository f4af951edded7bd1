"""Motions to samples of a free orientation, with a joint turned the other way around.

A sample has the full turns of least displacement: the other way around, a joint meets more
friction. But where it has about half a turn to go, friction is nearly the same. Gravity is not, and
still less what an isolated bus burns of the energy of what is lowered: one way may need twice as
much as the other.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from joulepath.optimizer.kinematics.end_configuration import FULL_TURN
from joulepath.optimizer.motion.seven_segment import shortest_duration
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.search.candidates import Candidate, bound
from joulepath.optimizer.search.seeds import estimates_between
from joulepath.optimizer.solve.methods.sqp_method import above

# motions that are returned: those that are expected to need least, at most this ratio of the least
# of all
MOST, NEAR = 64, 1.15


def other_turns(
    prepared: PreparedProblem, samples: Sequence[Candidate], least: float
) -> list[Candidate]:
    """The samples with one joint turned the other way around, where they are expected to need
    little energy, if some other motion is expected to need `least` [J].

    What is expected is half-way from a lower bound to a rough estimate: see `seeds.expected`. The
    bound of a sample is taken to grow by what Coulomb friction takes of the joint's longer way.
    Starts that are given stand as they are.
    """
    if not prepared.problem.windings:
        return []
    limits = prepared.arm.active_limits
    coulomb = prepared.arm.friction_law.coulomb
    q_start, q_goal = (
        np.array([getattr(each, name) for each in samples]) for name in ("q_start", "q_goal")
    )
    way, given = q_goal - q_start, np.array([[each.start.fixed] for each in samples])
    turn = -FULL_TURN * np.sign(way)
    at_goal = (q_goal + turn >= limits.q_min) & (q_goal + turn <= limits.q_max)
    at_start = (q_start - turn >= limits.q_min) & (q_start - turn <= limits.q_max) & ~given
    bounds = np.array([[each.lower_bound] for each in samples]) + coulomb * (
        np.abs(way + turn) - np.abs(way)
    )
    most = above(least, NEAR)
    rows, joints = np.nonzero((at_goal | at_start) & (way != 0) & (bounds <= most))
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
        for k in np.argsort(energy, kind="stable")[:MOST].tolist()
        if energy[k] <= most
    ]
    if turned:
        bound(prepared, turned, [])
    return turned
