"""One start and goal pair: what solves it, and the way from a first guess to a motion that holds every limit.

The methods themselves are in `optimizer.methods`, a file each.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import ClassVar, Literal

import numpy as np
from scipy.interpolate import BSpline

from models.robot import Array, Limits
from optimizer import verify
from optimizer.bounds import LONGEST_DURATION
from optimizer.bspline import Basis
from optimizer.collision import Indices
from optimizer.keep_away import CLEARANCE, RESERVE, SCALE
from optimizer.motion import Task, fine_samples, peak_rates, sample, slowed, spline_of, stretch
from optimizer.nlp import Coordinates, Programme
from optimizer.path_limits import PathLimits
from optimizer.solution import BaselineName, Clearance, Spline
from optimizer.solve import FEASIBILITY, solve
from optimizer.windows import Window, windows

# the solver works within limits tightened by this share, so that its own tolerance does not break the real ones
MARGIN = 2 * FEASIBILITY
# times that limits are tightened where the motion breaks them between the nodes, and by how much beyond the excess
REPAIRS = 8
REPAIR_MARGIN = 2e-4
# torque is tightened by this multiple of its excess: the peak that is held down between two nodes comes up beside them
TORQUE_REPAIR = 1.5
# a motion is slowed by at most this factor in place of another solve
MOST_STRETCH = 1 + 5e-4
# first durations tried, in multiples of the shortest that the guess allows
STRETCHES = (1.02, 1.15, 1.3, 1.5, 1.8, 2.3, 3.0, 4.5)
# points per knot span at which torque is checked between the nodes
TORQUE_POINTS = 4
# samples at which limits along the path are looked at, and the multiple of an excess by which they are tightened
PATH_SAMPLES, PATH_REPAIR = 401, 1.5
# samples of a motion that another is fitted to
FIT_SAMPLES = 201
DEARER = "its best motion hits something, and even so spends no less than the best found"


@dataclass(frozen=True)
class Attempt:
    """What came of a candidate: the spline if it is solved, and what was spent on it.

    `iterations` are the method's own: of the SQP, generations, or energies evaluated. `hit` is what the best motion
    found runs into, where it does. It is pruned where it is dearer than a motion known even before it keeps clear.
    """

    status: Literal["solved", "infeasible", "failed", "pruned", "out of time"]
    reason: str
    iterations: int = 0
    solves: int = 0
    spline: Spline | None = None
    stationarity: float | None = None
    hit: Clearance | None = None


@dataclass(frozen=True)
class Guess:
    """Where to begin: a spline space, all control points (n, r) in the candidate's coordinates, a duration [s]."""

    space: Basis
    points: Array
    duration: float


class Solver(ABC):
    """Solves one candidate, from q_start to q_goal (nq,), by one method, before `deadline`.

    `window` says which durations are allowed and what is minimised; None: the problem's first.
    """

    # the baselines that are first guesses of a motion of this kind, and those that are motions of this kind
    learns: ClassVar[tuple[BaselineName, ...]] = ()
    adopts: ClassVar[tuple[BaselineName, ...]] = ()
    # how many candidates are solved before the rest is left
    most_solved: ClassVar[int | None] = None
    # whether it ends where nothing nearby is better
    converges: ClassVar[bool] = True
    # what a motion already found spends [J], in the objective: it is not worth the while to keep dearer ones clear
    best_known: float = np.inf

    def __init__(
        self, task: Task, q_start: Array, q_goal: Array, deadline: float, window: Window | None = None
    ) -> None:
        self.task, self.deadline = task, deadline
        self.q_start, self.q_goal = q_start, q_goal
        self.window = windows(task, q_goal)[0] if window is None else window
        self.t_min, self.t_max = self.window.t_min, self.window.t_max

    @abstractmethod
    def solve(self) -> Attempt:
        """The method, from the ground up."""

    @staticmethod
    def may_refine(found: Spline) -> bool:
        """Whether `learn` may make more of what `solve` found."""
        return False

    def learn(self, q: Array, t: Array, fine: bool) -> Attempt:
        """An attempt from samples q (k, nq) at times t (k,) of a motion; `fine` where a first one fell short."""
        return Attempt("failed", "the method takes no motion for a guess")

    def torque_peaks(self, spline: Spline) -> Array:
        """Greatest absolute motor torques (nq,) at the nodes of a motion and at the certificate's own instants."""
        # where a joint turns back, friction changes sign within a millisecond
        between, replayed = fine_samples(spline, TORQUE_POINTS)[1:], sample(spline, verify.grid(spline.duration))
        q, v, a = (np.concatenate(both) for both in zip(between, replayed, strict=True))
        tau = self.task.torques(q, v, a) + self.task.friction.torque(v)
        return np.asarray(np.abs(tau).max(axis=0))


class Programmed(Solver):
    """A method whose motions live in a linear space and are optimised by the SQP."""

    def __init__(
        self, task: Task, q_start: Array, q_goal: Array, deadline: float, window: Window | None = None
    ) -> None:
        super().__init__(task, q_start, q_goal, deadline, window)
        self.coordinates = self._coordinates(task.problem.active_limits.scaled(1 - MARGIN))

    def improve(self, guess: Guess, guarded: bool = False, deadline: float = np.inf) -> Attempt:
        """Optimise from a guess, tightening the limits where the motion breaks them between the nodes.

        With `guarded`, for a guess that hits nothing, it keeps clear from the first step on. `deadline` is one earlier
        than the candidate's.
        """
        window, kernel, deadline = self.window, self.task.kernel, min(deadline, self.deadline)
        programme = Programme(kernel, guess.space, window.p, self.coordinates, self.t_min, self.t_max, window.constant)
        pairs: Indices = np.zeros(0, dtype=np.intp)
        if guarded:
            guessed = spline_of(guess.space, self.coordinates.to_joints(guess.points), 1.0)
            pairs = self.task.near(guessed)
        path = self.task.guarded(pairs) if guarded else self.task.path
        programme = replace(programme, path=path, room=_rooms(path))
        limits = self.task.problem.active_limits.scaled(1 - MARGIN)
        free = guess.points[guess.space.free]
        duration = self._first_duration(programme, free, guess.duration)
        iterations, multiplier, hit = 0, None, None
        for solves in range(1, REPAIRS + 1):
            result = solve(programme, free, duration, multiplier, deadline)
            iterations += result.iterations
            if result.status == "out of time":
                return Attempt("out of time", "the deadline passed", iterations, solves)
            if result.violation > FEASIBILITY:
                reason = f"found no motion of {guess.space.n} control points that holds the limits"
                reason = reason if hit is None else f"found no way around: {hit.words}"
                return Attempt("failed", reason, iterations, solves, hit=hit)
            spline = spline_of(guess.space, programme.joint_points(result.free), result.duration)
            excess = self._excess(spline)
            if excess is not None:
                spline = self._stretched(spline, excess)
                excess = self._excess(spline)
            hit = self.task.hit(spline)
            if (
                hit is not None
                and not len(pairs)
                and self.task.objective_of(self.task.energy(spline)) >= self.best_known
            ):
                return Attempt("pruned", DEARER, iterations, solves)
            beyond = self._beyond(spline, programme.path, hit)
            if excess is None and hit is None and not beyond.any():
                return Attempt("solved", "converged", iterations, solves, spline, result.stationarity)
            if excess is not None:
                limits = _tightened(limits, excess)
                programme = replace(programme, coordinates=self._coordinates(limits))
            # pairs are watched only once something is hit, since most motions hit nothing
            nearby = pairs if hit is None else np.union1d(pairs, self.task.near(spline))
            programme = self._watched(programme, pairs, nearby, beyond, hit)
            pairs = nearby
            # the solver takes no step for positions alone: it bounds them
            free = np.clip(result.free, programme.limits.q_min, programme.limits.q_max)
            duration, multiplier = result.duration, result.multiplier
        reason = "limits stay broken between the nodes" if hit is None else f"found no way around: {hit.words}"
        return Attempt("failed", reason, iterations, REPAIRS, hit=hit)

    def _watched(
        self, programme: Programme, pairs: Indices, nearby: Indices, beyond: Array, hit: Clearance | None
    ) -> Programme:
        """The programme with the limits along its path tightened, and all of `nearby` watched instead of `pairs`."""
        room = programme.room - beyond
        if len(nearby) > len(pairs):
            path = self.task.guarded(nearby)
            widened = _rooms(path)
            widened[np.append(np.ones(len(room) - len(pairs), dtype=bool), np.isin(nearby, pairs))] = room
            return replace(programme, path=path, room=widened)
        if hit is not None and programme.path is not None and not beyond.any():
            # met nowhere, but not proven either: a hair more between the points that are held
            room -= np.where(np.array(programme.path.names) == CLEARANCE, RESERVE / SCALE, 0.0)
        return replace(programme, room=room)

    def _beyond(self, spline: Spline, path: PathLimits | None, hit: Clearance | None) -> Array:
        """By how much each share of the limits along the path must shrink, (c,): they are broken between the points."""
        if path is None:
            return np.zeros(0)
        # clearance comes last, and where it is proven the motion keeps it
        looked_at = path if hit is not None else self.task.path
        share = np.zeros(len(path.names))
        if looked_at is not None:
            q, v, _ = sample(spline, np.linspace(0.0, spline.duration, PATH_SAMPLES))
            share[: len(looked_at.names)] = looked_at.shares(q, v).max(axis=0)
        beyond = share - 1
        return np.where(beyond > -REPAIR_MARGIN / 4, PATH_REPAIR * np.maximum(beyond, 0.0) + REPAIR_MARGIN, 0.0)

    def _coordinates(self, limits: Limits) -> Coordinates:
        """What the space describes: every joint by itself."""
        return Coordinates.joints(self.q_start, self.q_goal, limits)

    def _first_duration(self, programme: Programme, free: Array, least: float) -> float:
        """The cheapest of a few durations at which the guess holds the limits on speed, acceleration and jerk."""
        limits = programme.limits
        rates = np.stack([limits.v_max, limits.a_max, limits.j_max])
        peaks = np.abs(programme.kinematics(free)).max(axis=1)
        shortest = max(stretch(peaks / rates), least, programme.t_min)
        if shortest >= programme.t_max:
            return programme.t_max
        durations = [shortest * stretch for stretch in STRETCHES]
        if programme.t_max < LONGEST_DURATION:
            durations.append(programme.t_max)
        best, chosen = np.inf, shortest
        for duration in durations:
            if duration > programme.t_max:
                continue
            cost, tau = programme.value(free, duration)
            cost *= 1 + float(np.maximum(np.abs(tau) / limits.tau_max - 1, 0).max())
            if cost < best:
                best, chosen = cost, duration
            elif best < np.inf and duration < programme.t_max:
                break
        return chosen

    def _stretched(self, spline: Spline, factors: Limits) -> Spline:
        """The motion slowed until speed, acceleration and jerk hold their limits, if that takes next to no time."""
        needed = stretch(1 / np.stack([factors.v_max, factors.a_max, factors.j_max]))
        return spline if needed > MOST_STRETCH or spline.duration * needed > self.t_max else slowed(spline, needed)

    def _excess(self, spline: Spline) -> Limits | None:
        """The factors (≤ 1) by which each limit must be tightened, positions by how much [rad]; None if all hold."""
        limits = self.task.problem.active_limits
        rates = peak_rates(spline)
        found = {
            "v_max": rates[0] / limits.v_max,
            "a_max": rates[1] / limits.a_max,
            "j_max": rates[2] / limits.j_max,
            "tau_max": self.torque_peaks(spline) / limits.tau_max,
        }
        below, above = self._overshoot(spline)
        held = 1 - REPAIR_MARGIN / 4
        if max(float(ratio.max()) for ratio in found.values()) <= held and not (below.any() or above.any()):
            return None
        factors = {name: np.where(r > held, r + REPAIR_MARGIN, 1.0) for name, r in found.items()}
        factors["tau_max"] = 1 + TORQUE_REPAIR * (factors["tau_max"] - 1)
        return Limits(q_min=below, q_max=above, **{name: 1 / factor for name, factor in factors.items()})

    def _overshoot(self, spline: Spline) -> tuple[Array, ...]:
        """How far the joints go below and above their range [rad], (nq,) each: a B-spline's hull keeps it inside."""
        none = np.zeros(len(self.q_start))
        return none, none


def sampled(spline: Spline) -> tuple[Array, Array]:
    """Samples q (k, nq) of a motion at times t (k,), to learn from."""
    t = np.linspace(0.0, spline.duration, FIT_SAMPLES)
    return np.asarray(BSpline(spline.knots, spline.control_points, spline.degree)(t)), t


def _rooms(path: PathLimits | None) -> Array:
    """How much of each limit along the path (c,) may be used at first."""
    return np.full(0 if path is None else len(path.names), 1 - MARGIN)


def _tightened(limits: Limits, excess: Limits) -> Limits:
    """Limits on speed, acceleration, jerk and torque times factors per joint, and positions moved inwards."""
    inner = limits.scaled(excess)
    return replace(inner, q_min=inner.q_min + excess.q_min, q_max=inner.q_max - excess.q_max)
