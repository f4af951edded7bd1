"""Which candidates there are, in which order they are solved, and which bound rules the others out."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import product

import numpy as np

from models.robot import Array
from optimizer.arm import Pose
from optimizer.bounds import lower_bounds
from optimizer.candidate import Attempt
from optimizer.end_checks import raise_if_none_is_left, rulings
from optimizer.exceptions import (
    InvalidProblem,
    NoReachableTarget,
    OutsideLimits,
    SingularPose,
    UnreachablePose,
)
from optimizer.inverse_kinematics import inverse_kinematics_for, turns
from optimizer.motion import Task
from optimizer.orientation import LoosePose
from optimizer.solution import Candidate, CandidateStatus, UnreachableTarget
from optimizer.targets import AnyOf, Single

FULL_TURN = 2 * np.pi
# orientations tried of a pose that leaves it free, and of each of several at least
SAMPLES, LEAST_SAMPLES = 96, 12
# 64 poses from a given start make 16384, two poses 2048; each is named in the answer with some 400 bytes
MOST_PAIRS = 32768
# two relative windings that differ by less are the same [rad]
SAME_TRAVEL = 1e-9
# share of the tool's cone that a goal of free orientation may use: on the edge nothing would be left for the motion
INSIDE = 0.999
UNVISITED = "not reached before the deadline"
HELD_BACK = "other orientations promise more"
PRUNED = "its lower bound is not below the best energy found"


@dataclass(frozen=True)
class End:
    """One branch at an end of the motion: its label, and for every joint the positions that the limits allow [rad].

    `target` is the index, among the end's targets, of the one that it reaches; `loose` that target, where its
    orientation is free in part and this is but a sample of it.
    """

    label: str
    q: Array
    choices: list[list[float]]
    fixed: bool
    target: int = 0
    loose: LoosePose | None = None


@dataclass
class Entry:
    """A start and goal pair and what is known of it; `energy` is exact, in the objective [J].

    What is `held_back` is not explored: there are others like it that promise more.
    """

    start: End
    goal: End
    q_start: Array
    q_goal: Array
    lower_bound: float = 0.0
    shortest: float = 0.0
    status: CandidateStatus = "unvisited"
    reason: str = UNVISITED
    energy: float | None = None
    attempt: Attempt | None = field(default=None, repr=False)
    holdable: bool = True
    held_back: bool = False

    @property
    def duration(self) -> float:
        """Length of the motion found [s]; NaN where none is."""
        return self.attempt.spline.duration if self.attempt and self.attempt.spline else np.nan

    def report(self) -> Candidate:
        """The candidate as it is answered."""
        return Candidate(
            start=self.start.label,
            goal=self.goal.label,
            q_start=self.q_start,
            q_goal=self.q_goal,
            status=self.status,
            reason=self.reason,
            lower_bound=self.lower_bound,
            energy=self.energy,
            duration=None if self.energy is None else self.duration,
            start_target=self.start.target,
            goal_target=self.goal.target,
        )


def ends(task: Task, name: str) -> tuple[list[End], list[UnreachableTarget]]:
    """The branches at `start` or `goal` that the problem allows, none of them singular; and, of several targets, those
    that have none.

    Raises NoReachableTarget when all of several have none, and of a single pose UnreachablePose or SingularPose;
    UnreachablePose also when the branch asked for does not reach the pose.
    """
    target = getattr(task.problem, name)
    if not isinstance(target, AnyOf):
        return _ends_of(task, name, target, 0, SAMPLES), []
    loose = sum(isinstance(member, LoosePose) for member in target.targets)
    reached: list[End] = []
    unreachable: list[UnreachableTarget] = []
    for index, member in enumerate(target.targets):
        try:
            reached += _ends_of(task, name, member, index, max(SAMPLES // max(loose, 1), LEAST_SAMPLES))
        except (UnreachablePose, SingularPose, OutsideLimits) as error:
            unreachable.append(UnreachableTarget(name, index, str(error)))
    if not reached:
        raise NoReachableTarget(name, unreachable)
    return reached, unreachable


def _ends_of(task: Task, name: str, target: Single, index: int, samples: int) -> list[End]:
    problem = task.problem
    kinematics, limits = inverse_kinematics_for(problem.robot), problem.active_limits
    if isinstance(target, LoosePose):
        return _ends_of_samples(task, name, target, index, samples)
    if not isinstance(target, Pose):
        problem.check_inside(name, target)
        return [End(str(kinematics.label(target)), target, [[value] for value in target.tolist()], True, index)]
    solutions = kinematics.solve(target.T, problem.T_flange_tcp, limits, windings=False, target=name)
    solutions = [s for s in solutions if problem.allows(s.label)]
    if not solutions:
        raise UnreachablePose(
            name, None, f"The branch asked for does not reach the {name} pose: leave `branch` out to try them all."
        )
    return [End(str(s.label), s.q, turns(s.q, limits.q_min, limits.q_max), False, index) for s in solutions]


def _ends_of_samples(task: Task, name: str, pose: LoosePose, index: int, samples: int) -> list[End]:
    """The branches of orientations spread over those that the pose, and the tool's cone, allow."""
    pose = _within_cone(task, pose)
    found: list[End] = []
    errors: list[UnreachablePose | SingularPose] = []
    tried = samples if pose.freedom > 1 else max(samples // 4, LEAST_SAMPLES)
    for R in pose.sample(tried):
        try:
            found += [replace(end, loose=pose) for end in _ends_of(task, name, pose.pose(R), index, samples)]
        except (UnreachablePose, SingularPose) as error:
            errors.append(error)
    if found:
        return found
    unreachable = [error for error in errors if isinstance(error, UnreachablePose)]
    if len(unreachable) < tried:
        raise next(error for error in errors if isinstance(error, SingularPose))
    distances = [error.distance for error in unreachable if error.distance is not None]
    raise UnreachablePose(
        name,
        min(distances, default=None),
        f"The {name} is out of reach in each of the {tried} orientations tried: move it closer to where the arm can "
        "go, widen limits.position or leave `branch` out.",
    )


def _within_cone(task: Task, pose: LoosePose) -> LoosePose:
    """The pose with no more freedom than the tool's cone leaves, where both are about the same axes: few orientations
    of a free pose would be in a narrow cone."""
    cone = task.problem.tool_cone
    if cone is None:
        return pose
    free = pose.half_angle == np.pi
    if not free and not (np.allclose(pose.axis, cone.axis) and np.allclose(pose.direction, cone.direction)):
        return pose
    return LoosePose(pose.position, cone.axis, cone.direction, min(pose.half_angle, INSIDE * cone.half_angle))


def pairs(task: Task, starts: Sequence[End], goals: Sequence[End]) -> list[Entry]:
    """Every pair of branches with every winding that makes a motion of its own.

    Dynamics does not know full turns: where both ends are poses, pairs of the same relative travel are one candidate,
    and those that turn a joint by more than a full turn are left out, since the same pair of branches without that turn
    travels less in that joint and no further in the others, under a bound that is never higher.
    Without `windings`, and to samples of a free orientation, the one of least travel.

    Raises InvalidProblem when several targets make too many.
    """
    result: list[Entry] = []
    for start in starts:
        for goal in goals:
            windings = task.problem.windings and goal.loose is None
            options = [
                _joint_options(s, g, start.fixed or goal.fixed, windings)
                for s, g in zip(start.choices, goal.choices, strict=True)
            ]
            if len(result) + math.prod(map(len, options)) > MOST_PAIRS:
                raise InvalidProblem(
                    "goal" if isinstance(task.problem.goal, AnyOf) else "start",
                    f"These targets make more than {MOST_PAIRS} pairs of arm configurations: give fewer of them, a "
                    "`branch`, or `windings` false.",
                )
            for combination in product(*options):
                both = np.array(combination)
                result.append(Entry(start, goal, both[:, 0], both[:, 1], held_back=goal.loose is not None))
                if goal.loose is not None:
                    result[-1].reason = HELD_BACK
    return result


def _joint_options(starts: list[float], goals: list[float], fixed: bool, windings: bool) -> list[tuple[float, float]]:
    """(start, goal) of one joint for each relative travel, least travel first."""
    both = sorted(product(starts, goals), key=lambda pair: (abs(pair[1] - pair[0]), abs(pair[0]) + abs(pair[1])))
    if not windings:
        return both[:1]
    if fixed:
        return both
    kept: list[tuple[float, float]] = []
    for s, g in both:
        fresh = all(abs((g - s) - (other[1] - other[0])) > SAME_TRAVEL for other in kept)
        if fresh and (not kept or abs(g - s) < FULL_TURN + SAME_TRAVEL):
            kept.append((s, g))
    return kept


def bound(task: Task, entries: Sequence[Entry]) -> None:
    """Rule out the pairs at whose ends the arm cannot be, and give every entry its lower bound and least duration.

    Raises InvalidProblem, StartInCollision, GoalInCollision or TorqueInfeasible when no pair is left.
    """
    sides = {
        name: list({id(end): end for end in (getattr(entry, name) for entry in entries)}.values())
        for name in ("start", "goal")
    }
    ruled = {name: rulings(task, np.array([end.q for end in ends])) for name, ends in sides.items()}
    ruled_out = {id(end): ruling for name in sides for end, ruling in zip(sides[name], ruled[name], strict=True)}
    potential = {id(end): task.potential(end.q) for ends in sides.values() for end in ends}
    travel = np.array([entry.q_goal - entry.q_start for entry in entries])
    climb = np.array([potential[id(entry.goal)] - potential[id(entry.start)] for entry in entries])
    hold = task.holding_power(np.array([entry.q_goal for entry in entries])) if task.problem.cycle else None
    bounds, shortest = lower_bounds(task, travel, climb, hold)
    for entry, value, least in zip(entries, bounds.tolist(), shortest.tolist(), strict=True):
        entry.lower_bound, entry.shortest = value, least
        for name in ("start", "goal"):
            ruling = ruled_out[id(getattr(entry, name))]
            if ruling is not None:
                entry.status, entry.reason = "infeasible", f"at the {name}, {ruling.reason}"
                entry.lower_bound, entry.holdable = np.inf, False
                break
        if entry.holdable and not np.isfinite(value):
            entry.status, entry.reason = "infeasible", f"takes at least {least:.4f} s"
    for name, ends in sides.items():
        raise_if_none_is_left(name, [(end.label, end.target, end.q) for end in ends], ruled[name])


def explore(
    task: Task,
    entries: Sequence[Entry],
    attempt: Callable[[Entry], Attempt],
    deadline: float,
    clock: Callable[[], float] = time.perf_counter,
    most_solved: int | None = None,
) -> Entry | None:
    """Solve candidates in order of bound until no bound is below the best found; returns the best, None if none.

    With `most_solved`, candidates beyond so many solved ones are left unless a bound rules them out.
    """
    best = min((e for e in entries if e.energy is not None), key=lambda e: e.energy or 0.0, default=None)
    for entry in sorted(entries, key=lambda e: (e.lower_bound, e.shortest)):
        if entry.status != "unvisited" or entry.held_back:
            continue
        if best is not None and best.energy is not None and entry.lower_bound >= best.energy:
            entry.status, entry.reason = "pruned", PRUNED
            continue
        if most_solved is not None and sum(e.status == "solved" for e in entries) >= most_solved:
            entry.reason = f"the method solves no more than {most_solved} candidates"
            continue
        if clock() > deadline:
            break
        entry.attempt = outcome = attempt(entry)
        if outcome.status == "out of time":
            break
        entry.status, entry.reason = outcome.status, outcome.reason
        if outcome.spline is not None:
            entry.energy = task.objective_of(task.energy(outcome.spline))
            if best is None or best.energy is None or entry.energy < best.energy:
                best = entry
    return best
