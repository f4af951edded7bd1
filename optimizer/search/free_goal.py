"""Refinement of the best samples of goals that infinitely many configurations reach.

The configurations of a goal of partly free orientation, or of a goal on a self-motion, form a
manifold. From the best solved samples, the goal configuration becomes a decision variable of the
nonlinear program, restricted to the tangent space of the goal manifold. Inverse kinematics projects
the new goal onto the manifold, and the motion is solved again with this goal fixed, until the
energy no longer decreases.
"""

from __future__ import annotations

from dataclasses import dataclass

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
from joulepath.optimizer.search.sampled_ends import nearest_configuration, refine_best, with_ends
from joulepath.optimizer.search.state import SearchState
from joulepath.optimizer.solve.methods.duration_intervals import interval_around
from joulepath.optimizer.solve.methods.guess import Guess
from joulepath.optimizer.solve.methods.solve_result import SolveReason, SolveResult, SolveStatus
from joulepath.optimizer.solve.methods.spline_spaces import SPLINE_SPACES
from joulepath.optimizer.solve.nlp.coordinates import Coordinates, GoalConstraints
from joulepath.optimizer.solve.nlp.nonlinear_program import NonlinearProgram
from joulepath.optimizer.solve.nlp.sqp import solve


@dataclass(frozen=True)
class GoalRefinementSettings:
    """Settings of the refinement of goals."""

    rounds: int = 8
    """Largest number of rounds."""
    radius: float = 0.6
    """First trust region of a goal joint [rad]."""
    least_radius: float = 0.01
    """Trust region below which the refinement ends [rad]."""
    shrinking: float = 4.0
    """Divisor of the trust region where the manifold bends too much."""
    gain: float = 2e-4
    """Relative decrease of the energy below which no further round follows."""
    progress: float = 5e-4
    """Relative decrease of the energy that a step to a proposal must promise."""
    least_gain: float = 1e-4
    """Relative decrease of the energy that is worth another solve."""
    kept_share: float = 0.1
    """Share of the promised decrease below which the manifold bends too much."""
    least_move: float = 1e-3
    """Displacement [rad] below which a goal has settled."""
    step_shares: tuple[float, ...] = (1.0, 0.9, 0.5)
    """Shares of the step to a proposed goal tried in turn."""
    fit_samples: int = 201
    """Number of instants at which a motion of another method is sampled."""
    cone_sides: int = 12
    """Number of sides of the polygon that stands for a cone's circle."""


GOALS = GoalRefinementSettings()
REFINED_GOAL = "converged; goal orientation refined from a sampled orientation"
REFINED = "converged; refined along the self-motion that holds the pose"


def refine_goals(state: SearchState) -> list[Candidate]:
    """New candidates, found by refining the goal orientation of the best solved samples.

    One sample per pair of branches is refined. Only candidates of less energy than their sample are
    returned.
    """
    solved = [
        each
        for each in state.candidates
        if each.energy is not None and each.goal.tolerance is not None
    ]
    return refine_best(
        solved,
        lambda each: (each.start.label, each.goal.label, each.goal.target),
        lambda each: refine_goal(state, each),
    )


def refine_goal(state: SearchState, candidate: Candidate) -> Candidate:
    """The candidate with its goal moved over the goal set while the energy decreases.

    It is the candidate itself if the energy never decreases.

    Args:
        state: state of the search.
        candidate: solved candidate whose goal is a sample.
    """
    best, radius = candidate, GOALS.radius
    for _ in range(GOALS.rounds):
        if state.deadline.passed or radius < GOALS.least_radius:
            break
        try:
            with watch(state.deadline):
                fresh, promised = _moved(state, best, radius)
        except DeadlinePassed:
            break
        before = best.energy or 0.0
        gain = 0.0 if fresh is None else before - (fresh.energy or 0.0)
        if fresh is not None and gain > 0:
            best = fresh
        if gain < GOALS.gain * abs(before) and before - promised < GOALS.gain * abs(before):
            break
        if gain < GOALS.kept_share * (before - promised):
            radius /= GOALS.shrinking
    return best


def _moved(
    state: SearchState, candidate: Candidate, radius: float
) -> tuple[Candidate | None, float]:
    """The candidate with its goal moved by at most `radius` [rad] in each joint, solved.

    Returns:
        The candidate, None if it has no motion; and the energy promised to first order [J], -inf if
        there is no motion to first order.
    """
    guess, promised = _proposal(state, candidate, radius)
    if guess is None:
        return None, -np.inf
    if promised > (1 - GOALS.least_gain) * (candidate.energy or 0.0):
        return None, promised
    if np.abs(guess.points[-1] - candidate.q_goal).max() < GOALS.least_move:
        return None, candidate.energy or 0.0
    for share in GOALS.step_shares:
        # the set may bend out of a limit that the proposed goal is on
        asked = candidate.q_goal + share * (guess.points[-1] - candidate.q_goal)
        found = _nearest_goal(state, candidate, asked)
        if found is not None:
            return _solved(state, candidate, *found, guess), promised
    return None, promised


def _nearest_goal(
    state: SearchState, candidate: Candidate, q: Array
) -> tuple[EndConfiguration, Array] | None:
    """The nearest configuration (nq,) of a candidate's goal to q (nq,), with its end.

    None if it is outside of the limits. Where two curves of a redundant arm meet, it may be on the
    other curve.
    """
    ends = {candidate.goal.self_motion: candidate.goal}
    if candidate.goal.self_motion is not None:
        for each in state.candidates:
            if each.goal.self_motion is not None and each.goal.target == candidate.goal.target:
                ends.setdefault(each.goal.self_motion, each.goal)
    near = [(end, nearest_configuration(state.prepared, end, q)) for end in ends.values()]
    held = [(end, at) for end, at in near if at is not None]
    return min(held, key=lambda each: float(np.abs(each[1] - q).max()), default=None)


def _solved(
    state: SearchState, candidate: Candidate, end: EndConfiguration, q_goal: Array, guess: Guess
) -> Candidate | None:
    """The candidate with another goal (nq,) [rad], solved; None if it has no motion."""
    prepared = state.prepared
    to_end = Candidate(candidate.start, end, candidate.q_start, candidate.q_goal)
    fresh = with_ends(prepared, to_end, candidate.q_start, q_goal)
    if fresh is None:
        return None
    solver = solver_of(state, fresh, interval_around(prepared, q_goal, guess.duration))
    guess.points[-REST_POINTS:] = q_goal
    # a method without free control points takes the goal of the guess alone
    result = state.add_effort(
        solver.solve_control_points(guess.space, guess.points, guess.duration)
        if solver.free_control_points
        else solver.solve()
    )
    return settled(
        state, fresh, result, REFINED_GOAL if candidate.goal.self_motion is None else REFINED
    )


def _proposal(
    state: SearchState, candidate: Candidate, radius: float
) -> tuple[Guess | None, float]:
    """The motion of least energy to any goal in the tangent space of the goal set.

    The goal is at most `radius` [rad] away in each joint.

    Returns:
        The motion, None without one, and its energy [J], inf without a motion.
    """
    prepared, spline = state.prepared, candidate.spline
    space = bspline.uniform(SPLINE_SPACES.coarse_points)
    if state.method.free_control_points and spline.degree == space.degree:
        space, points = bspline.Basis.of(spline.knots / spline.duration), spline.control_points
    else:
        at = np.linspace(0.0, 1.0, GOALS.fit_samples)
        points = space.fit(sample(spline, at * spline.duration)[0], at)
    coordinates = Coordinates.joints(
        candidate.q_start, candidate.q_goal, prepared.problem.arm.active_limits
    )
    interval = interval_around(prepared, candidate.q_goal, spline.duration)
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
    result = solve(program, free, spline.duration, None, state.deadline, GOALS.progress)
    state.add_effort(
        SolveResult(SolveStatus.FAILED, SolveReason.GOAL_PROPOSAL, result.iterations, 1)
    )
    if not result.feasible:
        return None, np.inf
    return Guess(space, program.points(result.free), result.duration), result.cost


def held_pose(prepared: PreparedProblem, q_goal: Array, radius: float) -> GoalConstraints:
    """Allowed changes of a goal (nq,) to first order if the TCP keeps its pose: along the
    self-motion.
    """
    return GoalConstraints(
        tcp_jacobian(prepared.problem.arm, q_goal), np.zeros(6), np.zeros(6), radius
    )


def goal_constraints(
    prepared: PreparedProblem, pose: ConeOrientedPose, q_goal: Array, radius: float
) -> GoalConstraints:
    """Allowed changes of a goal (nq,) to first order if the pose leaves its orientation partly
    free.

    The TCP keeps its position, and its axis stays within the cone.
    """
    arm = prepared.problem.arm
    R, jacobian = tcp_pose(arm, q_goal)[:3, :3], tcp_jacobian(arm, q_goal)
    rows, lower, upper = [jacobian[:3]], [np.zeros(3)], [np.zeros(3)]
    if pose.half_angle < np.pi:
        tilted, pointing = tilt(pose, R), R @ pose.axis
        angle = float(np.linalg.norm(tilted))
        # two directions across the axis, the first in which it is tilted
        first = tilted / angle if angle > 1e-9 else np.linalg.svd(pointing[None])[2][1]
        second = np.cross(pointing, first)
        if pose.half_angle == 0:
            normals, upper_bound = np.stack([first, second]), np.array([-angle, 0.0])
        else:
            turn = 2 * np.pi * np.arange(GOALS.cone_sides) / GOALS.cone_sides
            normals = np.cos(turn)[:, None] * first + np.sin(turn)[:, None] * second
            upper_bound = np.maximum(pose.half_angle - angle * np.cos(turn), 0.0)
        rows.append(normals @ jacobian[3:])
        lower.append(upper_bound if pose.half_angle == 0 else np.full(GOALS.cone_sides, -1e30))
        upper.append(upper_bound)
    return GoalConstraints(
        np.concatenate(rows), np.concatenate(lower), np.concatenate(upper), radius
    )
