"""Goals that infinitely many configurations reach: how the best samples are refined.

The configurations of a goal whose orientation is free in part, or that is held on a self-motion,
form a manifold. From the best solved samples, the goal configuration becomes a decision variable of
the nonlinear program, restricted to the tangent space of the goal manifold. Inverse kinematics
projects the new goal onto the manifold, and the motion is solved again with this goal fixed, until
the energy no longer decreases.
"""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.deadline import DeadlinePassed, watch
from joulepath.optimizer.kinematics.end_configuration import EndConfiguration
from joulepath.optimizer.kinematics.orientation_tolerance import tilt
from joulepath.optimizer.kinematics.tcp import tcp_jacobian, tcp_pose
from joulepath.optimizer.motion import bspline
from joulepath.optimizer.motion.bspline import REST_POINTS
from joulepath.optimizer.motion.spline import sample
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.cone_oriented_pose import ConeOrientedPose
from joulepath.optimizer.search.attempts import settled, solver_of
from joulepath.optimizer.search.candidates import Candidate
from joulepath.optimizer.search.incumbent import Incumbent
from joulepath.optimizer.search.sampled_ends import nearest_configuration, refine_best, with_ends
from joulepath.optimizer.solve.methods.duration_intervals import (
    DurationInterval,
    duration_intervals,
)
from joulepath.optimizer.solve.methods.guess import Guess
from joulepath.optimizer.solve.methods.solve_result import SolveReason, SolveResult, SolveStatus
from joulepath.optimizer.solve.methods.spline_spaces import SPLINE_SPACES
from joulepath.optimizer.solve.nlp.coordinates import Coordinates, GoalConstraints
from joulepath.optimizer.solve.nlp.nonlinear_program import NonlinearProgram
from joulepath.optimizer.solve.nlp.sqp import solve

# rounds of refinement, the trust region of a goal joint in one of them [rad], and the least one
ROUNDS, RADIUS, LEAST_RADIUS = 8, 0.6, 0.01
# relative decrease of the energy below which no further round follows, and that a step to a
# proposal must promise: the motion to it is solved again
GAIN, PROGRESS = 2e-4, 5e-4
# relative decrease of the energy that is worth another solve, and share of the promised decrease
# below which the manifold bends too much within the trust region
LEAST_GAIN, KEPT = 1e-4, 0.1
# a goal that moves by less is where it should be [rad]
LEAST_MOVE = 1e-3
# shares of the way to a proposed goal that are tried
SHARES = (1.0, 0.9, 0.5)
REFINED_GOAL = "converged; goal orientation refined from a sampled orientation"
REFINED = "converged; refined along the self-motion that holds the pose"
# instants at which a motion of another method is sampled
FIT_SAMPLES = 201
# sides of the polygon that stands for a cone's circle
SIDES = 12


def refine_goals(incumbent: Incumbent) -> list[Candidate]:
    """New candidates, found by refining the goal orientation of the best solved samples.

    One sample per pair of branches is refined, at most MOST_REFINED of them; only candidates of
    less energy than their sample are returned.
    """
    solved = [
        each
        for each in incumbent.candidates
        if each.energy is not None and each.goal.tolerance is not None
    ]
    return refine_best(
        solved,
        lambda each: (each.start.label, each.goal.label, each.goal.target),
        lambda each: refine_goal(incumbent, each),
    )


def refine_goal(incumbent: Incumbent, candidate: Candidate, rounds: int = ROUNDS) -> Candidate:
    """The candidate with its goal moved over the goal set while the energy decreases; itself if it
    never does.

    The candidate must be solved, and its goal a sample.
    """
    best, radius = candidate, RADIUS
    for _ in range(rounds):
        if incumbent.deadline.passed or radius < LEAST_RADIUS:
            break
        try:
            with watch(incumbent.deadline):
                fresh, promised = _moved(incumbent, best, radius)
        except DeadlinePassed:
            break
        before = best.energy or 0.0
        gain = 0.0 if fresh is None else before - (fresh.energy or 0.0)
        if fresh is not None and gain > 0:
            best = fresh
        if gain < GAIN * abs(before) and before - promised < GAIN * abs(before):
            break
        if gain < KEPT * (before - promised):
            radius /= 4
    return best


def _moved(
    incumbent: Incumbent, candidate: Candidate, radius: float
) -> tuple[Candidate | None, float]:
    """The candidate with its goal moved by at most `radius` [rad] in each joint, solved, None if it
    has no motion; and the energy [J] that was promised to first order, -inf if the first order has
    no motion either."""
    guess, promised = _proposal(incumbent, candidate, radius)
    if guess is None:
        return None, -np.inf
    if promised > (1 - LEAST_GAIN) * (candidate.energy or 0.0):
        return None, promised
    if np.abs(guess.points[-1] - candidate.q_goal).max() < LEAST_MOVE:
        return None, candidate.energy or 0.0
    for share in SHARES:
        # where the set bends, its configuration next to the proposed one may be outside of a limit
        # that this one is on
        asked = candidate.q_goal + share * (guess.points[-1] - candidate.q_goal)
        found = _nearest_goal(incumbent, candidate, asked)
        if found is not None:
            return _solved(incumbent, candidate, *found, guess), promised
    return None, promised


def _nearest_goal(
    incumbent: Incumbent, candidate: Candidate, q: Array
) -> tuple[EndConfiguration, Array] | None:
    """The configuration (nq,) of the candidate's goal that is nearest to q (nq,), with its end;
    None if none is within the limits.

    Where two curves of a redundant arm meet, it may be on the other one.
    """
    ends = {id(candidate.goal.self_motion): candidate.goal}
    if candidate.goal.self_motion is not None:
        for each in incumbent.candidates:
            if each.goal.self_motion is not None and each.goal.target == candidate.goal.target:
                ends.setdefault(id(each.goal.self_motion), each.goal)
    near = [(end, nearest_configuration(incumbent.prepared, end, q)) for end in ends.values()]
    held = [(end, at) for end, at in near if at is not None]
    return min(held, key=lambda each: float(np.abs(each[1] - q).max()), default=None)


def _solved(
    incumbent: Incumbent, candidate: Candidate, end: EndConfiguration, q_goal: Array, guess: Guess
) -> Candidate | None:
    """The candidate with another goal (nq,) [rad] of this end, solved; None if it has no motion."""
    prepared = incumbent.prepared
    to_end = Candidate(candidate.start, end, candidate.q_start, candidate.q_goal)
    fresh = with_ends(prepared, to_end, candidate.q_start, q_goal)
    if fresh is None:
        return None
    solver = solver_of(incumbent, fresh, _interval_of(prepared, q_goal, guess.duration))
    guess.points[-REST_POINTS:] = q_goal
    # a method without free control points takes the goal of the guess alone
    result = incumbent.add_effort(
        solver.solve_control_points(guess.space, guess.points, guess.duration)
        if solver.free_control_points
        else solver.solve()
    )
    return settled(
        incumbent, fresh, result, REFINED_GOAL if candidate.goal.self_motion is None else REFINED
    )


def _proposal(
    incumbent: Incumbent, candidate: Candidate, radius: float
) -> tuple[Guess | None, float]:
    """The motion of least energy to any goal in the tangent space of the goal set, at most `radius`
    [rad] away, and its energy [J]; inf without a motion."""
    prepared, spline = incumbent.prepared, candidate.spline
    space = bspline.uniform(SPLINE_SPACES.coarse_points)
    if incumbent.method.free_control_points and spline.degree == space.degree:
        space, points = bspline.Basis.of(spline.knots / spline.duration), spline.control_points
    else:
        at = np.linspace(0.0, 1.0, FIT_SAMPLES)
        points = space.fit(sample(spline, at * spline.duration)[0], at)
    coordinates = Coordinates.joints(
        candidate.q_start, candidate.q_goal, prepared.problem.arm.active_limits
    )
    interval = _interval_of(prepared, candidate.q_goal, spline.duration)
    pose = candidate.goal.tolerance
    if pose is None:
        allowed = held_pose(prepared, candidate.q_goal, radius)
    else:
        allowed = goal_constraints(prepared, pose, candidate.q_goal, radius)
    program = NonlinearProgram(
        prepared.kernel,
        space,
        interval.p,
        coordinates,
        interval.t_min,
        interval.t_max,
        interval.constant,
        allowed,
        goal_holding=interval.goal_holding,
    )
    free = np.concatenate([points[space.free], candidate.q_goal[None]])
    result = solve(program, free, spline.duration, None, incumbent.deadline, PROGRESS)
    incumbent.add_effort(
        SolveResult(SolveStatus.FAILED, SolveReason.GOAL_PROPOSAL, result.iterations, 1)
    )
    if not result.feasible:
        return None, np.inf
    return Guess(space, program.points(result.free), result.duration), result.cost


def _interval_of(prepared: PreparedProblem, q_goal: Array, duration: float) -> DurationInterval:
    """The interval of durations that holds `duration` [s], else the nearest."""
    return min(
        duration_intervals(prepared, q_goal),
        key=lambda each: max(each.t_min - duration, duration - each.t_max, 0.0),
    )


def held_pose(prepared: PreparedProblem, q_goal: Array, radius: float) -> GoalConstraints:
    """To first order, how the goal (nq,) may change while the TCP keeps its pose: along the
    self-motion.
    """
    return GoalConstraints(
        tcp_jacobian(prepared.problem.arm, q_goal), np.zeros(6), np.zeros(6), radius
    )


def goal_constraints(
    prepared: PreparedProblem, pose: ConeOrientedPose, q_goal: Array, radius: float
) -> GoalConstraints:
    """To first order, how the goal (nq,) may change: the TCP keeps its place, and its axis stays
    within the cone.
    """
    arm = prepared.problem.arm
    R, jacobian = tcp_pose(arm, q_goal)[:3, :3], tcp_jacobian(arm, q_goal)
    rows, lower, upper = [jacobian[:3]], [np.zeros(3)], [np.zeros(3)]
    if pose.half_angle < np.pi:
        tilted, pointing = tilt(pose, R), R @ pose.axis
        angle = float(np.linalg.norm(tilted))
        # at a right angle to the axis: the way it is tilted, and the other
        first = tilted / angle if angle > 1e-9 else np.linalg.svd(pointing[None])[2][1]
        second = np.cross(pointing, first)
        if pose.half_angle == 0:
            normals, upper_bound = np.stack([first, second]), np.array([-angle, 0.0])
        else:
            turn = 2 * np.pi * np.arange(SIDES) / SIDES
            normals = np.cos(turn)[:, None] * first + np.sin(turn)[:, None] * second
            upper_bound = np.maximum(pose.half_angle - angle * np.cos(turn), 0.0)
        rows.append(normals @ jacobian[3:])
        lower.append(upper_bound if pose.half_angle == 0 else np.full(SIDES, -1e30))
        upper.append(upper_bound)
    return GoalConstraints(
        np.concatenate(rows), np.concatenate(lower), np.concatenate(upper), radius
    )
