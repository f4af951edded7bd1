"""The time that a search leaves for the end: certificate, samples and report of the answer."""

from __future__ import annotations

from joulepath.optimizer.motion.quadrature import QUADRATURE
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.result.solution import Solution

# share of the deadline kept for the end of a short motion, at most [s]; and the share that is kept
# at most
RESERVE_SHARE, RESERVE, MOST_SHARE = 0.2, 0.1, 0.9
# time [s] per instant of the certificate's grid, and per instant for the path constraints; per
# sample of the answer, its digits included; per candidate listed. Some 1.5 times what a core takes;
# `python -m benchmarks.deadlines` shows it
CERTIFIED, CONSTRAINED, SAMPLED, LISTED = 6e-6, 6e-6, 12e-6, 40e-6


def reserve(problem: Problem, duration: float, candidates: int) -> float:
    """Time [s] before the problem's deadline at which a search ends whose answer lasts `duration`
    [s].
    """
    arm = problem.arm
    constrained = (
        arm.tool_cone is not None or arm.tcp_speed is not None or arm.elbow_speed is not None
    )
    certificate = duration / QUADRATURE.grid_period * (CERTIFIED + CONSTRAINED * constrained)
    least = min(RESERVE_SHARE * problem.deadline, RESERVE)
    needed = least + certificate + _report(problem, duration, candidates)
    return min(needed, MOST_SHARE * problem.deadline)


def report_time(problem: Problem, answer: Solution) -> float:
    """Time [s] that it takes to encode an answer to a problem."""
    return _report(problem, answer.duration, len(answer.candidates))


def _report(problem: Problem, duration: float, candidates: int) -> float:
    return duration / problem.sample_period * SAMPLED + candidates * LISTED
