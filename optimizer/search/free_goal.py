"""Goals whose orientation is free in part: which samples are solved, and how the best of them are refined.

The configurations of such a goal form a manifold. Its samples are ordered by lower bound, and those of least bound are
solved. From the best of these, the goal configuration becomes a decision variable of the nonlinear program, restricted
to the tangent space of the goal manifold. Inverse kinematics projects the new goal onto the manifold, and the motion is
solved again with this goal fixed, until the energy no longer decreases.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from models.robot import Array
from optimizer.deadline import DeadlinePassed, watch
from optimizer.exceptions import JoulepathError
from optimizer.kinematics.inverse import SINGULAR, required_inverse_kinematics
from optimizer.kinematics.orientation_tolerance import nearest_orientation, tilt
from optimizer.kinematics.tcp import flange_pose, tcp_jacobian, tcp_pose
from optimizer.methods.duration_intervals import DurationInterval, duration_intervals
from optimizer.methods.free_spline import COARSE, FreeSpline
from optimizer.methods.method import SolveResult, SolveStatus
from optimizer.methods.sqp_method import Guess
from optimizer.nlp.coordinates import Coordinates, GoalConstraints
from optimizer.nlp.nonlinear_program import NonlinearProgram
from optimizer.nlp.sqp import solve
from optimizer.prepared_problem import PreparedProblem
from optimizer.problem.cone_oriented_pose import ConeOrientedPose
from optimizer.search.attempts import solver_of
from optimizer.search.candidates import Candidate, Reason, bound
from optimizer.search.ends import EndConfiguration, label_of
from optimizer.search.incumbent import Incumbent
from optimizer.solution import CandidateStatus
from optimizer.trajectories import bspline
from optimizer.trajectories.bspline import REST_POINTS
from optimizer.trajectories.spline import sample

# samples solved before any is refined: in all, and of one pair of branches
BATCH, ALIKE = 12, 2
# solved samples that are refined, each of a pair of branches of its own
MOST_REFINED = 4
# rounds of refinement, the trust region of a goal joint in one of them [rad], and the least one
ROUNDS, RADIUS, LEAST_RADIUS = 8, 0.6, 0.01
# relative decrease of the energy below which no further round follows
GAIN = 2e-4
REFINED_GOAL = "converged; goal orientation refined from a sampled orientation"
# instants at which a motion of another method is sampled
FIT_SAMPLES = 201
# configurations that differ by less are the same [rad]
SAME = 1e-6
# sides of the polygon that stands for a cone's circle
SIDES = 12


def activate_deferred(candidates: Sequence[Candidate]) -> bool:
    """Activate the deferred samples of least lower bound; false if there are none."""
    alike: Counter[tuple[str, str, int]] = Counter()
    opened = 0
    for candidate in sorted((e for e in candidates if e.deferred), key=lambda e: (e.lower_bound, e.shortest)):
        kind = (candidate.start.label, candidate.goal.label, candidate.goal.target)
        if candidate.status is not CandidateStatus.UNVISITED or alike[kind] == ALIKE:
            continue
        alike[kind] += 1
        candidate.deferred = False
        candidate.settle(CandidateStatus.UNVISITED, Reason.NOT_REACHED)
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
    """The candidate (of `among`, default all) between two configurations (nq,) [rad], else the nearest one.

    If it is missing only because q_goal is not among the samples of a free orientation, it is added to `candidates`.
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
    """The candidate with another goal configuration, with its bounds; None if that is infeasible."""
    label = label_of(prepared.problem.arm.robot, q_goal)
    goal = replace(candidate.goal, label=label, q=q_goal, choices=[[value] for value in q_goal.tolist()], fixed=True)
    fresh = Candidate(candidate.start, goal, candidate.q_start, q_goal)
    try:
        bound(prepared, [fresh])
    except JoulepathError:
        return None
    return fresh


def refine_goals(incumbent: Incumbent) -> list[Candidate]:
    """New candidates, found by refining the goal orientation of the best solved samples.

    One sample per pair of branches is refined, at most MOST_REFINED of them; only candidates of less energy than their
    sample are returned.
    """
    solved = [each for each in incumbent.candidates if each.energy is not None and each.goal.tolerance is not None]
    chosen: dict[tuple[str, str, int], Candidate] = {}
    for candidate in sorted(solved, key=lambda each: each.energy or 0.0):
        chosen.setdefault((candidate.start.label, candidate.goal.label, candidate.goal.target), candidate)
    samples = list(chosen.values())[:MOST_REFINED]
    refined = [(candidate, refine_goal(incumbent, candidate)) for candidate in samples]
    return [better for candidate, better in refined if better is not candidate]


def refine_goal(incumbent: Incumbent, candidate: Candidate) -> Candidate:
    """The candidate with its goal moved over the goal set while the energy decreases; itself if it never does.

    The candidate must be solved, and its goal's orientation free in part.
    """
    best, radius = candidate, RADIUS
    for _ in range(ROUNDS):
        if incumbent.deadline.passed or radius < LEAST_RADIUS:
            break
        try:
            with watch(incumbent.deadline):
                fresh = _moved(incumbent, best, radius)
        except DeadlinePassed:
            break
        if fresh is None or (fresh.energy or 0.0) >= (best.energy or 0.0):
            radius /= 4
            continue
        gain = (best.energy or 0.0) - (fresh.energy or 0.0)
        best = fresh
        if gain < GAIN * abs(best.energy or 0.0):
            break
    return best


def _moved(incumbent: Incumbent, candidate: Candidate, radius: float) -> Candidate | None:
    """The candidate with its goal moved by at most `radius` [rad] in each joint, solved; None if it has no motion."""
    guess = _proposal(incumbent, candidate, radius)
    q_goal = None if guess is None else project_to_goal(incumbent.prepared, candidate.goal, guess.points[-1])
    return None if guess is None or q_goal is None else _solved(incumbent, candidate, q_goal, guess)


def _solved(incumbent: Incumbent, candidate: Candidate, q_goal: Array, guess: Guess) -> Candidate | None:
    """The candidate with another goal (nq,) [rad], solved; None if it has no motion."""
    prepared = incumbent.prepared
    fresh = _with_goal(prepared, candidate, q_goal)
    if fresh is None:
        return None
    solver = solver_of(incumbent, fresh, _interval_of(prepared, q_goal, guess.duration))
    guess.points[-REST_POINTS:] = q_goal
    # the guess is a motion of the free spline's own kind; other methods only take its goal
    result = incumbent.add_effort(solver.improve(guess) if type(solver) is FreeSpline else solver.solve())
    if result.spline is None:
        return None
    fresh.attempt = result
    fresh.settle(CandidateStatus.SOLVED, Reason.METHOD, REFINED_GOAL)
    fresh.energy = prepared.objective_of(prepared.energy(result.spline))
    return fresh


def _proposal(incumbent: Incumbent, candidate: Candidate, radius: float) -> Guess | None:
    """The motion of least energy to any goal in the tangent space of the goal set, at most `radius` [rad] away."""
    assert candidate.goal.tolerance is not None
    prepared, spline = incumbent.prepared, candidate.spline
    space = bspline.uniform(COARSE)
    if spline.degree == space.degree and len(spline.control_points) == COARSE:
        points = spline.control_points
    else:
        at = np.linspace(0.0, 1.0, FIT_SAMPLES)
        points = space.fit(sample(spline, at * spline.duration)[0], at)
    coordinates = Coordinates.joints(candidate.q_start, candidate.q_goal, prepared.problem.arm.active_limits)
    interval = _interval_of(prepared, candidate.q_goal, spline.duration)
    allowed = goal_constraints(prepared, candidate.goal.tolerance, candidate.q_goal, radius)
    program = NonlinearProgram(
        prepared.kernel, space, interval.p, coordinates, interval.t_min, interval.t_max, interval.constant, allowed
    )
    free = np.concatenate([points[space.free], candidate.q_goal[None]])
    result = solve(program, free, spline.duration, None, incumbent.deadline)
    incumbent.add_effort(SolveResult(SolveStatus.FAILED, "a proposal", result.iterations, 1))
    if not result.feasible:
        return None
    return Guess(space, program.points(result.free), result.duration)


def _interval_of(prepared: PreparedProblem, q_goal: Array, duration: float) -> DurationInterval:
    """The interval of durations that holds `duration` [s], else the nearest."""
    return min(
        duration_intervals(prepared, q_goal), key=lambda each: max(each.t_min - duration, duration - each.t_max, 0.0)
    )


def goal_constraints(
    prepared: PreparedProblem, pose: ConeOrientedPose, q_goal: Array, radius: float
) -> GoalConstraints:
    """To first order, how the goal (nq,) may change: the TCP keeps its place, and its axis stays within the cone."""
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
    return GoalConstraints(np.concatenate(rows), np.concatenate(lower), np.concatenate(upper), radius)


def project_to_goal(prepared: PreparedProblem, goal: EndConfiguration, q: Array) -> Array | None:
    """The configuration (nq,) nearest to q (nq,) that has the TCP in place and an orientation allowed, if any."""
    pose, problem = goal.tolerance, prepared.problem
    assert pose is not None
    arm, limits = problem.arm, problem.arm.active_limits
    T_base_tcp = pose.with_orientation(nearest_orientation(pose, tcp_pose(arm, q)[:3, :3])).T
    kinematics = required_inverse_kinematics(arm.robot, "goal")
    found = []
    for branch in kinematics.branches(flange_pose(T_base_tcp, arm.T_flange_tcp)):
        if branch.smallest_singular_value < SINGULAR:
            continue
        near = branch.q + 2 * np.pi * np.round((q - branch.q) / (2 * np.pi))
        if problem.allows(branch.label) and ((near >= limits.q_min) & (near <= limits.q_max)).all():
            found.append(near)
    return min(found, key=lambda near: float(np.abs(near - q).max()), default=None)
