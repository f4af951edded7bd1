"""Sampled ends of a candidate, moved within their targets to a shorter least duration."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.kinematics.angles import nearest_turn
from joulepath.optimizer.kinematics.end_configuration import EndConfiguration
from joulepath.optimizer.motion.seven_segment import shortest_duration
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.sampled_ends import nearest_configuration, with_ends


@dataclass(frozen=True)
class EndSearchSettings:
    """Settings of the random search for ends of shorter duration."""

    trials: int = 120
    """Number of random steps from the best ends so far; the last steps are about 1e-3 rad."""
    first_step: float = 0.3
    """Standard deviation of the first steps [rad]: about the distance of neighbouring samples."""
    longer: float = 1.5
    """Factor on the step after a success."""
    shorter: float = 0.9
    """Factor on the step after a failure; both factors together keep one step in five helpful."""
    worth: float = 1e-3
    """Relative decrease of the duration that is worth another candidate."""


END_SEARCH = EndSearchSettings()


def with_shorter_duration(
    prepared: PreparedProblem,
    candidate: Candidate,
    settings: EndSearchSettings = END_SEARCH,
) -> Candidate | None:
    """A candidate for the same targets with a shorter proven least duration; None if none is found.

    Raises:
        DeadlinePassed: the watched deadline passed.
    """
    limits, rng = prepared.arm.active_limits, np.random.default_rng(0)
    q_start, q_goal, least, step = (
        candidate.q_start,
        candidate.q_goal,
        candidate.shortest,
        settings.first_step,
    )
    for _ in range(settings.trials):
        checkpoint()
        ends = [
            _moved(prepared, end, q, step * rng.normal(size=len(q)))
            for end, q in ((candidate.start, q_start), (candidate.goal, q_goal))
        ]
        step *= settings.shorter
        if ends[0] is None or ends[1] is None:
            continue
        duration = float(shortest_duration(ends[1] - ends[0], limits))
        if duration < least:
            (q_start, q_goal), least = (ends[0], ends[1]), duration
            step *= settings.longer / settings.shorter
    if least > candidate.shortest * (1 - settings.worth):
        return None
    return with_ends(prepared, candidate, q_start, q_goal)


def _moved(prepared: PreparedProblem, end: EndConfiguration, q: Array, by: Array) -> Array | None:
    """The nearest configuration (nq,) [rad] of a sampled end's target to q + by, in the same turn.

    It is q itself for an end that is no sample, None if the target is not reached nearby.
    """
    if not end.sampled:
        return q
    found = nearest_configuration(prepared, end, q + by)
    return None if found is None else nearest_turn(found, q)
