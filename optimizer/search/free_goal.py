"""Goals whose orientation is free in part: which samples of it are tried, and how the best are turned into better ones.

A goal of that kind is a continuum of arm configurations. A sample of it is ranked by the bounds, the most promising
are solved, and from the best of these the goal itself becomes an unknown of the programme, on the plane that touches
the continuum there. What that proposes is put back on the continuum by inverse kinematics and solved with its goal
held, until turning pays no more.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pinocchio as pin

from models.robot import Array
from optimizer.exceptions import JoulepathError
from optimizer.kinematics.inverse import SINGULAR, inverse_kinematics_for
from optimizer.kinematics.orientation_tolerance import nearest_orientation, tilt
from optimizer.methods import solver_for
from optimizer.methods.duration_intervals import Window, windows
from optimizer.methods.free_spline import COARSE, FreeSpline
from optimizer.methods.method import Attempt
from optimizer.methods.sqp_method import Guess
from optimizer.nlp.coordinates import Coordinates, Leeway
from optimizer.nlp.nonlinear_program import Programme
from optimizer.nlp.sqp import FEASIBILITY, solve
from optimizer.prepared_problem import Task
from optimizer.problem.cone_oriented_pose import LoosePose
from optimizer.search.candidates import UNVISITED, Entry, bound
from optimizer.search.ends import End
from optimizer.trajectories import bspline
from optimizer.trajectories.bspline import REST_POINTS
from optimizer.trajectories.spline import sample

# samples solved before any is improved: in all, and of one pair of branches
BATCH, ALIKE = 12, 2
# how many of the solved are improved, each of a pair of branches of its own
TOURS = 4
# turns of improvement, how far a joint of the goal may go in one [rad], and the least worth trying
ROUNDS, RADIUS, LEAST_RADIUS = 8, 0.6, 0.01
# a share of the energy that another turn must have gained to be followed by one more
GAIN = 2e-4
TURNED = "converged, from another orientation turned to where it costs least"
# instants at which a motion of another method is looked at
FIT_SAMPLES = 201
# configurations that differ by less are one [rad]
SAME = 1e-6
# sides of the polygon that stands for a cone's circle
SIDES = 12


def release(entries: Sequence[Entry]) -> bool:
    """Open the most promising samples that are held back; false when there are none."""
    alike: Counter[tuple[str, str, int]] = Counter()
    opened = 0
    for entry in sorted((e for e in entries if e.held_back), key=lambda e: (e.lower_bound, e.shortest)):
        kind = (entry.start.label, entry.goal.label, entry.goal.target)
        if entry.status != "unvisited" or alike[kind] == ALIKE:
            continue
        alike[kind] += 1
        entry.held_back, entry.reason = False, UNVISITED
        opened += 1
        if opened == BATCH:
            break
    return opened > 0


def between(
    task: Task, entries: list[Entry], q_start: Array, q_goal: Array, among: Sequence[Entry] | None = None
) -> Entry:
    """The entry (of `among`, default all) between two configurations (nq,), or else the nearest.

    Where it is missing only because q_goal is no sample of a free orientation, though allowed, it is added.
    """
    known = entries if among is None else among
    nearest = min(known, key=lambda e: _distance(e.q_start, q_start) + _distance(e.q_goal, q_goal))
    if _distance(nearest.q_start, q_start) + _distance(nearest.q_goal, q_goal) < SAME:
        return nearest
    kinds = {e.goal.target: e for e in known if e.goal.loose is not None and _distance(e.q_start, q_start) < SAME}
    for entry in kinds.values():
        on_it = settled(task, entry.goal, q_goal)
        if on_it is not None and _distance(on_it, q_goal) < SAME:
            fresh = _turned(task, entry, q_goal)
            if fresh is not None:
                entries.append(fresh)
                return fresh
    return nearest


def _distance(a: Array, b: Array) -> float:
    return float(np.abs(a - b).max())


def _turned(task: Task, entry: Entry, q_goal: Array) -> Entry | None:
    """The entry with another of its goal's configurations, bounded; None where the arm cannot be there."""
    label = str(inverse_kinematics_for(task.problem.arm.robot).label(q_goal))
    goal = replace(entry.goal, label=label, q=q_goal, choices=[[value] for value in q_goal.tolist()], fixed=True)
    fresh = Entry(entry.start, goal, entry.q_start, q_goal)
    try:
        bound(task, [fresh])
    except JoulepathError:
        return None
    return fresh


def tours(task: Task, entries: Sequence[Entry], count: Callable[[Attempt], Attempt], deadline: float) -> list[Entry]:
    """New entries, better than those they were turned from: the best solved samples, each of branches of its own."""
    chosen: dict[tuple[str, str, int], Entry] = {}
    for entry in sorted((e for e in entries if e.energy is not None), key=lambda e: e.energy or 0.0):
        if entry.goal.loose is not None:
            chosen.setdefault((entry.start.label, entry.goal.label, entry.goal.target), entry)
    turned = [(entry, tour(task, entry, count, deadline)) for entry in list(chosen.values())[:TOURS]]
    return [better for entry, better in turned if better is not entry]


def tour(task: Task, entry: Entry, count: Callable[[Attempt], Attempt], deadline: float) -> Entry:
    """The entry with its goal turned for as long as that pays; the entry itself where it does not pay.

    `count` is told of every attempt. The entry must be solved, its goal's orientation free in part.
    """
    best, radius = entry, RADIUS
    for _ in range(ROUNDS):
        if time.perf_counter() > deadline or radius < LEAST_RADIUS:
            break
        guess = _proposal(task, best, radius, count, deadline)
        q_goal = None if guess is None else settled(task, best.goal, guess.points[-1])
        fresh = None if guess is None or q_goal is None else _solved(task, best, q_goal, guess, count, deadline)
        if fresh is None or (fresh.energy or 0.0) >= (best.energy or 0.0):
            radius /= 4
            continue
        gain = (best.energy or 0.0) - (fresh.energy or 0.0)
        best = fresh
        if gain < GAIN * abs(best.energy or 0.0):
            break
    return best


def _solved(
    task: Task, entry: Entry, q_goal: Array, guess: Guess, count: Callable[[Attempt], Attempt], deadline: float
) -> Entry | None:
    """The entry with another goal, solved; None where it has no motion."""
    fresh = _turned(task, entry, q_goal)
    if fresh is None:
        return None
    solver = solver_for(task, entry.q_start, q_goal, deadline, _window(task, q_goal, guess.duration))
    guess.points[-REST_POINTS:] = q_goal
    # the guess is a motion of the free spline's own kind, for other methods just a goal
    outcome = count(solver.improve(guess) if type(solver) is FreeSpline else solver.solve())
    if outcome.spline is None:
        return None
    fresh.attempt, fresh.status, fresh.reason = outcome, "solved", TURNED
    fresh.energy = task.objective_of(task.energy(outcome.spline))
    return fresh


def _proposal(
    task: Task, entry: Entry, radius: float, count: Callable[[Attempt], Attempt], deadline: float
) -> Guess | None:
    """The motion of least energy to any goal on the plane that touches the continuum at the entry's goal."""
    assert entry.goal.loose is not None and entry.attempt is not None and entry.attempt.spline is not None
    spline, problem = entry.attempt.spline, task.problem
    space = bspline.uniform(COARSE)
    if spline.degree == space.degree and len(spline.control_points) == COARSE:
        points = spline.control_points
    else:
        at = np.linspace(0.0, 1.0, FIT_SAMPLES)
        points = space.fit(sample(spline, at * spline.duration)[0], at)
    coordinates = Coordinates.joints(entry.q_start, entry.q_goal, problem.arm.active_limits)
    window = _window(task, entry.q_goal, spline.duration)
    allowed = leeway(task, entry.goal.loose, entry.q_goal, radius)
    programme = Programme(
        task.kernel, space, window.p, coordinates, window.t_min, window.t_max, window.constant, allowed
    )
    free = np.concatenate([points[space.free], entry.q_goal[None]])
    result = solve(programme, free, spline.duration, None, deadline)
    count(Attempt("failed", "a proposal", result.iterations, 1))
    if result.violation > FEASIBILITY:
        return None
    return Guess(space, programme.points(result.free), result.duration)


def _window(task: Task, q_goal: Array, duration: float) -> Window:
    """Of the windows of durations, the one that a motion of that duration [s] is in, or else the nearest."""
    return min(windows(task, q_goal), key=lambda w: max(w.t_min - duration, duration - w.t_max, 0.0))


def leeway(task: Task, pose: LoosePose, q_goal: Array, radius: float) -> Leeway:
    """To first order, how the goal (nq,) may change: the TCP keeps its place, and its axis stays within the cone."""
    R, jacobian = _tcp(task, q_goal)
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
    return Leeway(np.concatenate(rows), np.concatenate(lower), np.concatenate(upper), radius)


def settled(task: Task, goal: End, q: Array) -> Array | None:
    """The configuration (nq,) nearest to q (nq,) that has the TCP in place and an orientation allowed, if any."""
    pose, problem = goal.loose, task.problem
    assert pose is not None
    R, _ = _tcp(task, q)
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


def _tcp(task: Task, q: Array) -> tuple[Array, Array]:
    """Orientation (3, 3) of the TCP and its Jacobian (6, nq), linear part first, in base axes."""
    model, problem = task.model, task.problem
    data, flange = model.createData(), model.getFrameId("flange")
    jacobian = pin.computeFrameJacobian(model, data, q, flange, pin.LOCAL_WORLD_ALIGNED)
    R_flange = pin.updateFramePlacement(model, data, flange).rotation
    arm = R_flange @ problem.arm.T_flange_tcp[:3, 3]
    linear = jacobian[:3] + np.cross(jacobian[3:], arm, axis=0)
    return np.asarray(R_flange @ problem.arm.T_flange_tcp[:3, :3]), np.concatenate([linear, jacobian[3:]])
