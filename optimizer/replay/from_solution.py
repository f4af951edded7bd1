"""Planned motions of solutions, with their baselines."""

from __future__ import annotations

from collections.abc import Sequence

from joulepath.models.robot import Array
from joulepath.optimizer.evaluate.sample_check import check_samples
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.replay.baseline_courses import ReportedBaseline, planned_baselines
from joulepath.optimizer.replay.planned import PlannedMotion, PlannedTorques
from joulepath.optimizer.replay.reference import course_of
from joulepath.optimizer.result.energy import Objective
from joulepath.optimizer.result.solution import Solution


def planned_motion(solution: Solution, arm: Arm, objective: Objective) -> PlannedMotion:
    """The planned motion of a solution.

    Args:
        solution: solution of a problem.
        arm: arm of the problem.
        objective: objective of the problem, to which the savings refer.

    Returns:
        The motion, with the baselines whose motions are known.

    Raises:
        NotCertified: the solution does not belong to the arm.
    """
    samples, energy = solution.trajectory, solution.energy
    torques = PlannedTorques(samples.q, samples.v, samples.a, samples.tau)
    check_samples(arm, samples.spline, samples.t, (samples.q, samples.v, samples.a, samples.tau))
    reported = [
        ReportedBaseline(each.name, each.duration, each.electrical, each.mechanical, each.saving)
        for each in solution.baselines
    ]
    goals: Sequence[Array] = [solution.goal.q, *(each.q_goal for each in solution.candidates)]
    return PlannedMotion(
        arm=arm,
        course=course_of(samples.spline),
        duration=solution.duration,
        electrical=energy.electrical.total - energy.electrical.dwell,
        mechanical=energy.mechanical.total,
        objective=objective,
        waiting=energy.electrical.dwell,
        compared=bool(reported),
        torques=torques,
        baselines=planned_baselines(arm, solution.start.q, goals, solution.duration, reported),
    )
