"""Time that a search leaves for its end: certificate, samples and report of the answer."""

from __future__ import annotations

from dataclasses import dataclass

from joulepath.optimizer.motion.quadrature import QUADRATURE
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.result.solution import Solution


@dataclass(frozen=True)
class FinishingSettings:
    """Settings of the time for the end of a search, about 1.5 times the time of one core.

    They are measured by `python -m benchmarks.deadlines`.
    """

    least_share: float = 0.2
    """Share of the deadline kept for the end of a short motion, up to `least`."""
    least: float = 0.1
    """Time kept for the end of a short motion [s]."""
    most_share: float = 0.9
    """Greatest share of the deadline that is kept."""
    per_instant: float = 6e-6
    """Time per instant of the certificate's grid [s]."""
    per_constrained_instant: float = 6e-6
    """Additional time per instant with path constraints [s]."""
    per_sample: float = 12e-6
    """Time per sample of the answer, with its encoding [s]."""
    per_candidate: float = 40e-6
    """Time per candidate in the answer [s]."""


FINISHING = FinishingSettings()


def finishing_time(problem: Problem, duration: float, candidates: int) -> float:
    """Time before a problem's deadline at which its search ends [s]: `time_to_finish`, but for
    `most_share` of the deadline at most.
    """
    return min(
        time_to_finish(problem, duration, candidates), FINISHING.most_share * problem.deadline
    )


def time_to_finish(problem: Problem, duration: float, candidates: int) -> float:
    """Time to certify and report an answer [s].

    Args:
        problem: the problem.
        duration: duration of the answer [s].
        candidates: number of candidates in the answer.
    """
    arm = problem.arm
    constrained = (
        arm.tool_cone is not None or arm.tcp_speed is not None or arm.elbow_speed is not None
    )
    per_instant = FINISHING.per_instant + FINISHING.per_constrained_instant * constrained
    certificate = duration / QUADRATURE.grid_period * per_instant
    least = min(FINISHING.least_share * problem.deadline, FINISHING.least)
    return least + certificate + _report_time(problem, duration, candidates)


def report_time(problem: Problem, answer: Solution) -> float:
    """Time to encode an answer to a problem [s]."""
    return _report_time(problem, answer.duration, len(answer.candidates))


def _report_time(problem: Problem, duration: float, candidates: int) -> float:
    samples = duration / problem.sample_period
    return samples * FINISHING.per_sample + candidates * FINISHING.per_candidate
