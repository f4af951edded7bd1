"""Goals whose orientation is free in part: which samples of it are tried, and how the best are turned into better ones.

A goal of that kind is a continuum of arm configurations. A sample of it is ranked by the bounds, the most promising
are solved, and from the best of these the goal itself becomes an unknown of the program, on the plane that touches
the continuum there. What that proposes is put back on the continuum by inverse kinematics and solved with its goal
held, until turning pays no more.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pinocchio as pin

from models.robot import Array
from optimizer.deadline import Deadline
from optimizer.exceptions import JoulepathError
from optimizer.kinematics.inverse import SINGULAR, inverse_kinematics_for
from optimizer.kinematics.orientation_tolerance import nearest_orientation, tilt
from optimizer.methods import solver_for
from optimizer.methods.duration_intervals import DurationInterval, duration_intervals
from optimizer.methods.free_spline import COARSE, FreeSpline
from optimizer.methods.method import SolveResult, SolveStatus
from optimizer.methods.sqp_method import Guess
from optimizer.nlp.coordinates import Coordinates, GoalConstraints
from optimizer.nlp.nonlinear_program import NonlinearProgram
from optimizer.nlp.sqp import solve
from optimizer.prepared_problem import PreparedProblem
from optimizer.problem.cone_oriented_pose import ConeOrientedPose
from optimizer.search.candidates import UNVISITED, Candidate, bound
from optimizer.search.ends import EndConfiguration
from optimizer.trajectories import bspline
from optimizer.trajectories.bspline import REST_POINTS
from optimizer.trajectories.spline import sample

# samples solved before any is improved: in all, and of one pair of branches
BATCH, ALIKE = 12, 2
# how many of the solved are improved, each of a pair of branches of its own
MOST_REFINED = 4
# turns of improvement, how far a joint of the goal may go in one [rad], and the least worth trying
ROUNDS, RADIUS, LEAST_RADIUS = 8, 0.6, 0.01
# a share of the energy that another turn must have gained to be followed by one more
GAIN = 2e-4
REFINED_GOAL = "converged; goal orientation refined from a sampled orientation"
# instants at which a motion of another method is looked at
FIT_SAMPLES = 201
# configurations that differ by less are one [rad]
SAME = 1e-6
# sides of the polygon that stands for a cone's circle
SIDES = 12


def activate_deferred(candidates: Sequence[Candidate]) -> bool:
    """Open the most promising samples that are held back; false when there are none."""
    alike: Counter[tuple[str, str, int]] = Counter()
    opened = 0
    for candidate in sorted((e for e in candidates if e.deferred), key=lambda e: (e.lower_bound, e.shortest)):
        kind = (candidate.start.label, candidate.goal.label, candidate.goal.target)
        if candidate.status != "unvisited" or alike[kind] == ALIKE:
            continue
        alike[kind] += 1
        candidate.deferred, candidate.reason = False, UNVISITED
        opened += 1
        if opened == BATCH:
            break
    return opened > 0


def between(
    prepared: PreparedProblem,
    candidates: list[Candidate],
    q_start: Array,
    q_goal: Array,
    among: Sequence[Candidate] | None = None,
) -> Candidate:
    """The candidate (of `among`, default all) between two configurations (nq,), or else the nearest.

    Where it is missing only because q_goal is no sample of a free orientation, though allowed, it is added.
    """
    known = candidates if among is None else among
    nearest = min(known, key=lambda e: _distance(e.q_start, q_start) + _distance(e.q_goal, q_goal))
    if _distance(nearest.q_start, q_start) + _distance(nearest.q_goal, q_goal) < SAME:
        return nearest
    kinds = {e.goal.target: e for e in known if e.goal.tolerance is not None and _distance(e.q_start, q_start) < SAME}
    for candidate in kinds.values():
        on_it = project_to_goal(prepared, candidate.goal, q_goal)
        if on_it is not None and _distance(on_it, q_goal) < SAME:
            fresh = _with_goal(prepared, candidate, q_goal)
            if fresh is not None:
                candidates.append(fresh)
                return fresh
    return nearest


def _distance(a: Array, b: Array) -> float:
    return float(np.abs(a - b).max())


def _with_goal(prepared: PreparedProblem, candidate: Candidate, q_goal: Array) -> Candidate | None:
    """The candidate with another of its goal's configurations, bounded; None where the arm cannot be there."""
    label = str(inverse_kinematics_for(prepared.problem.arm.robot).label(q_goal))
    goal = replace(candidate.goal, label=label, q=q_goal, choices=[[value] for value in q_goal.tolist()], fixed=True)
    fresh = Candidate(candidate.start, goal, candidate.q_start, q_goal)
    try:
        bound(prepared, [fresh])
    except JoulepathError:
        return None
    return fresh


def refine_goals(
    prepared: PreparedProblem,
    candidates: Sequence[Candidate],
    count: Callable[[SolveResult], SolveResult],
    deadline: Deadline,
) -> list[Candidate]:
    """New candidates, better than those they were turned from: the best solved samples, each of branches of its own."""
    chosen: dict[tuple[str, str, int], Candidate] = {}
    for candidate in sorted((e for e in candidates if e.energy is not None), key=lambda e: e.energy or 0.0):
        if candidate.goal.tolerance is not None:
            chosen.setdefault((candidate.start.label, candidate.goal.label, candidate.goal.target), candidate)
    turned = [
        (candidate, refine_goal(prepared, candidate, count, deadline))
        for candidate in list(chosen.values())[:MOST_REFINED]
    ]
    return [better for candidate, better in turned if better is not candidate]


def refine_goal(
    prepared: PreparedProblem, candidate: Candidate, count: Callable[[SolveResult], SolveResult], deadline: Deadline
) -> Candidate:
    """The candidate with its goal turned for as long as that pays; the candidate itself where it does not pay.

    `count` is told of every attempt. The candidate must be solved, its goal's orientation free in part.
    """
    best, radius = candidate, RADIUS
    for _ in range(ROUNDS):
        if deadline.passed or radius < LEAST_RADIUS:
            break
        guess = _proposal(prepared, best, radius, count, deadline)
        q_goal = None if guess is None else project_to_goal(prepared, best.goal, guess.points[-1])
        fresh = None if guess is None or q_goal is None else _solved(prepared, best, q_goal, guess, count, deadline)
        if fresh is None or (fresh.energy or 0.0) >= (best.energy or 0.0):
            radius /= 4
            continue
        gain = (best.energy or 0.0) - (fresh.energy or 0.0)
        best = fresh
        if gain < GAIN * abs(best.energy or 0.0):
            break
    return best


def _solved(
    prepared: PreparedProblem,
    candidate: Candidate,
    q_goal: Array,
    guess: Guess,
    count: Callable[[SolveResult], SolveResult],
    deadline: Deadline,
) -> Candidate | None:
    """The candidate with another goal, solved; None where it has no motion."""
    fresh = _with_goal(prepared, candidate, q_goal)
    if fresh is None:
        return None
    solver = solver_for(prepared, candidate.q_start, q_goal, deadline, _window(prepared, q_goal, guess.duration))
    guess.points[-REST_POINTS:] = q_goal
    # the guess is a motion of the free spline's own kind, for other methods just a goal
    outcome = count(solver.improve(guess) if type(solver) is FreeSpline else solver.solve())
    if outcome.spline is None:
        return None
    fresh.attempt, fresh.status, fresh.reason = outcome, "solved", REFINED_GOAL
    fresh.energy = prepared.objective_of(prepared.energy(outcome.spline))
    return fresh


def _proposal(
    prepared: PreparedProblem,
    candidate: Candidate,
    radius: float,
    count: Callable[[SolveResult], SolveResult],
    deadline: Deadline,
) -> Guess | None:
    """The motion of least energy to any goal on the plane that touches the continuum at the candidate's goal."""
    assert (
        candidate.goal.tolerance is not None and candidate.attempt is not None and candidate.attempt.spline is not None
    )
    spline, problem = candidate.attempt.spline, prepared.problem
    space = bspline.uniform(COARSE)
    if spline.degree == space.degree and len(spline.control_points) == COARSE:
        points = spline.control_points
    else:
        at = np.linspace(0.0, 1.0, FIT_SAMPLES)
        points = space.fit(sample(spline, at * spline.duration)[0], at)
    coordinates = Coordinates.joints(candidate.q_start, candidate.q_goal, problem.arm.active_limits)
    interval = _window(prepared, candidate.q_goal, spline.duration)
    allowed = goal_constraints(prepared, candidate.goal.tolerance, candidate.q_goal, radius)
    program = NonlinearProgram(
        prepared.kernel, space, interval.p, coordinates, interval.t_min, interval.t_max, interval.constant, allowed
    )
    free = np.concatenate([points[space.free], candidate.q_goal[None]])
    result = solve(program, free, spline.duration, None, deadline)
    count(SolveResult(SolveStatus.FAILED, "a proposal", result.iterations, 1))
    if not result.feasible:
        return None
    return Guess(space, program.points(result.free), result.duration)


def _window(prepared: PreparedProblem, q_goal: Array, duration: float) -> DurationInterval:
    """Of the duration_intervals of durations, the one that a motion of that duration [s] is in, or else the nearest."""
    return min(duration_intervals(prepared, q_goal), key=lambda w: max(w.t_min - duration, duration - w.t_max, 0.0))


def goal_constraints(
    prepared: PreparedProblem, pose: ConeOrientedPose, q_goal: Array, radius: float
) -> GoalConstraints:
    """To first order, how the goal (nq,) may change: the TCP keeps its place, and its axis stays within the cone."""
    R, jacobian = _tcp(prepared, q_goal)
    rows, lower, upper = [jacobian[:3]], [np.zeros(3)], [np.zeros(3)]
    if pose.half_angle < np.pi:
        tilted, pointing = tilt(pose, R), R @ pose.axis
        angle = float(np.linalg.norm(tilted))
        # at a right angle to the axis: the way it is tilted, and the other
        first = tilted / angle if angle > 1e-9 else np.linalg.svd(pointing[None])[2][1]
        second = np.cross(pointing, first)
        if pose.half_angle == 0:
            normals, room = np.stack([first, second]), np.array([-angle, 0.0])
        else:
            turn = 2 * np.pi * np.arange(SIDES) / SIDES
            normals = np.cos(turn)[:, None] * first + np.sin(turn)[:, None] * second
            room = np.maximum(pose.half_angle - angle * np.cos(turn), 0.0)
        rows.append(normals @ jacobian[3:])
        lower.append(room if pose.half_angle == 0 else np.full(SIDES, -1e30))
        upper.append(room)
    return GoalConstraints(np.concatenate(rows), np.concatenate(lower), np.concatenate(upper), radius)


def project_to_goal(prepared: PreparedProblem, goal: EndConfiguration, q: Array) -> Array | None:
    """The configuration (nq,) nearest to q (nq,) that has the TCP in place and an orientation allowed, if any."""
    pose, problem = goal.tolerance, prepared.problem
    assert pose is not None
    R, _ = _tcp(prepared, q)
    kinematics, limits = inverse_kinematics_for(problem.arm.robot), problem.arm.active_limits
    T_base_flange = pose.with_orientation(nearest_orientation(pose, R)).T @ np.linalg.inv(problem.arm.T_flange_tcp)
    found = []
    for branch in kinematics.branches(T_base_flange):
        if branch.smallest_singular_value < SINGULAR:
            continue
        near = branch.q + 2 * np.pi * np.round((q - branch.q) / (2 * np.pi))
        if problem.allows(branch.label) and ((near >= limits.q_min) & (near <= limits.q_max)).all():
            found.append(near)
    return min(found, key=lambda near: float(np.abs(near - q).max()), default=None)


def _tcp(prepared: PreparedProblem, q: Array) -> tuple[Array, Array]:
    """Orientation (3, 3) of the TCP and its Jacobian (6, nq), linear part first, in base axes."""
    model, problem = prepared.model, prepared.problem
    data, flange = model.createData(), model.getFrameId("flange")
    jacobian = pin.computeFrameJacobian(model, data, q, flange, pin.LOCAL_WORLD_ALIGNED)
    R_flange = pin.updateFramePlacement(model, data, flange).rotation
    arm = R_flange @ problem.arm.T_flange_tcp[:3, 3]
    linear = jacobian[:3] + np.cross(jacobian[3:], arm, axis=0)
    return np.asarray(R_flange @ problem.arm.T_flange_tcp[:3, :3]), np.concatenate([linear, jacobian[3:]])
