"""The posture at the last stop of an open cycle: nothing comes after it, so that the last move alone chooses it.

A redundant arm reaches a stop in infinitely many postures, of which a cycle knows some. Along the last move the posture
slides as in `optimize`.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace

from joulepath.optimizer.cycle.cycle_baselines import compared_again
from joulepath.optimizer.cycle.cycle_solution import CycleSolution
from joulepath.optimizer.cycle.move_problem import LEAST_TIME
from joulepath.optimizer.deadline import Clock, Deadline
from joulepath.optimizer.exceptions import JoulepathError
from joulepath.optimizer.problem.cycle import Cycle
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.search.run import Run
from joulepath.optimizer.search.sliding import FIXED


def with_last_posture(asked: Cycle, found: CycleSolution, end: Deadline, clock: Clock) -> CycleSolution:
    """The cycle with a better last move, if its stop is a pose that leaves the posture free and there is one."""
    last = found.moves[-1]
    stop = next((each for each in asked.stops if each.name == last.planned.goal), None)
    if stop is None or not isinstance(stop.target, Pose) or not _ends_freely(asked, found) or end.left < LEAST_TIME:
        return found
    problem = Problem(
        arm=last.planned.arm,
        start=last.solution.start.q,
        goal=stop.target,
        method=asked.method,
        branch=stop.branch,
        windings=asked.windings,
        sample_period=asked.sample_period,
        deadline=end.left,
    )
    with suppress(JoulepathError):
        better = Run(problem, [last.solution.trajectory.spline], clock).solution()
        if better.energy.electrical.total < last.solution.energy.electrical.total:
            kept = replace(better, start=last.solution.start)
            moves = [*found.moves[:-1], replace(last, solution=kept, sensitivity=better.sensitivity)]
            found = replace(found, moves=moves)
            baselines = [compared_again(asked, each, found.needed) for each in found.baselines]
            bound = min(found.lower_bound, found.needed.of(asked.objective))
            return replace(found, status="feasible", baselines=baselines, lower_bound=bound)
    return found


def _ends_freely(asked: Cycle, found: CycleSolution) -> bool:
    """Whether the posture at the end changes the energy of the last move alone."""
    last, planned = found.moves[-1], found.moves[-1].planned
    plain = asked.objective == "electrical" and asked.any_time and asked.arm.bus.mode != "storage"
    rests = planned.dwell > 0 or last.wait > 0 or planned.arm_after is not planned.arm
    straight = planned.tool_path is None and not planned.through
    return plain and straight and not rests and not asked.closed and asked.arm.robot.nq > FIXED
