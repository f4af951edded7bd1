"""One start and goal pair from first guess to a motion that holds every limit between the nodes too."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from models.robot import Array, Limits
from optimizer import bspline, profile, shortest_line, verify
from optimizer.baselines import time_optimal, time_optimal_positions
from optimizer.bounds import LEAST_DURATION, LONGEST_DURATION
from optimizer.bspline import Basis
from optimizer.motion import Task, fine_samples, peak_rates, sample, slowed, spline_of, stretch
from optimizer.nlp import Coordinates, Programme
from optimizer.solution import Spline
from optimizer.solve import FEASIBILITY, solve
from optimizer.windows import Window, windows

# control points of a first attempt with evenly spaced knots
COARSE = 13
# evenly spaced knots are not tried where less than this multiple of the shortest duration is allowed
TIGHT = 1.12
# how often knots are repeated where jerk switches: it bends there in a refined motion, and jumps in the finest
REFINED, EXACT = 2, 3
# the solver works within limits tightened by this share, so that its own tolerance does not break the real ones
MARGIN = 2 * FEASIBILITY
# times that limits are tightened where the motion breaks them between the nodes, and by how much beyond the excess
REPAIRS = 6
REPAIR_MARGIN = 2e-4
# torque is tightened by this multiple of its excess: the peak that is held down between two nodes comes up beside them
TORQUE_REPAIR = 1.5
# a motion is slowed by at most this factor in place of another solve
MOST_STRETCH = 1 + 5e-4
# first durations tried, in multiples of the shortest that the guess allows
STRETCHES = (1.02, 1.15, 1.3, 1.5, 1.8, 2.3, 3.0, 4.5)
# points per knot span at which torque is checked between the nodes
TORQUE_POINTS = 4


@dataclass(frozen=True)
class Attempt:
    """What came of a candidate: the spline if it is solved, and what was spent on it."""

    status: Literal["solved", "infeasible", "failed", "out of time"]
    reason: str
    iterations: int = 0
    solves: int = 0
    spline: Spline | None = None
    stationarity: float | None = None


@dataclass(frozen=True)
class Guess:
    """Where to begin: a spline space, all control points (n, r) in the candidate's coordinates, a duration [s]."""

    space: Basis
    points: Array
    duration: float


class Solver:
    """Solves one candidate, from q_start to q_goal (nq,), as often as it is asked to before `deadline`.

    `window` says which durations are allowed and what is minimised; None: the problem's first.
    """

    def __init__(
        self, task: Task, q_start: Array, q_goal: Array, deadline: float, window: Window | None = None
    ) -> None:
        problem = task.problem
        self.task, self.deadline = task, deadline
        self.on_line = problem.method == "time_scaling"
        self.q_start, self.q_goal = q_start, q_goal
        self.window = windows(task, q_goal)[0] if window is None else window
        self.t_min, self.t_max = self.window.t_min, self.window.t_max
        self.coordinates = self._coordinates(problem.active_limits.scaled(1 - MARGIN))

    def solve(self) -> Attempt:
        """From the ground up; over knots made for haste where time is short or evenly spaced ones find nothing."""
        if self.on_line:
            return self._on_line()
        shortest = float(profile.shortest_duration(self.q_goal - self.q_start, self.coordinates.limits))
        first = Attempt("failed", "not tried")
        if not self.window.hurried and self.t_max >= TIGHT * shortest:
            space = bspline.uniform(COARSE)
            first = self.improve(Guess(space, self._smoothed(space), 0.0))
            if first.status in ("solved", "out of time"):
                return first
        second = self.improve(self.in_haste())
        return replace(second, iterations=first.iterations + second.iterations, solves=first.solves + second.solves)

    def in_haste(self) -> Guess:
        """The fastest motion under limits on speed, acceleration and jerk, in a space that holds its jerk's jumps."""
        line = self.coordinates
        fastest = time_optimal(line.limits, line.start, line.goal)
        duration = max(fastest.duration, LEAST_DURATION)
        space = self.graded(duration, EXACT)
        return Guess(space, bspline.fit(fastest.q, fastest.t / duration, space.knots), duration)

    def graded(self, duration: float, repeat: int) -> Basis:
        """A space with knots where the leading coordinate's jerk switches in a motion of that duration."""
        line = self.coordinates
        return bspline.graded(profile.switches(line.goal - line.start, duration, line.limits), repeat)

    def _on_line(self) -> Attempt:
        law = shortest_line.shortest_law(self.task, self.q_start, self.q_goal)
        if law is None:
            return Attempt("infeasible", "the straight line needs more torque than the joints have")
        if law.duration_bound > self.t_max:
            return Attempt("infeasible", f"the straight line takes at least {law.duration_bound:.4f} s")
        self.t_min = max(self.t_min, law.duration_bound)
        line = self.coordinates
        space = self.graded(float(profile.shortest_duration(line.goal - line.start, line.limits)), EXACT)
        # toppra's law jumps in acceleration: few control points round that off before many follow it
        coarse = bspline.uniform(COARSE).knots
        points = bspline.refit(law.fractions(coarse)[:, None], coarse, space.knots)
        return self.improve(Guess(space, points, self.t_min))

    def improve(self, guess: Guess) -> Attempt:
        """Optimise from a guess, tightening the limits where the motion breaks them between the nodes."""
        window, kernel = self.window, self.task.kernel
        programme = Programme(kernel, guess.space, window.p, self.coordinates, self.t_min, self.t_max, window.constant)
        limits = self.task.problem.active_limits.scaled(1 - MARGIN)
        free = guess.points[guess.space.free]
        duration = self._first_duration(programme, free, guess.duration)
        iterations, multiplier = 0, None
        for solves in range(1, REPAIRS + 1):
            result = solve(programme, free, duration, multiplier, self.deadline)
            iterations += result.iterations
            if result.status == "out of time":
                return Attempt("out of time", "the deadline passed", iterations, solves)
            if result.violation > FEASIBILITY:
                reason = f"found no motion of {guess.space.n} control points that holds the limits"
                return Attempt("failed", reason, iterations, solves)
            spline = spline_of(guess.space, programme.joint_points(result.free), result.duration)
            excess = self._excess(spline)
            if excess is not None:
                spline = self._stretched(spline, excess)
                excess = self._excess(spline)
            if excess is None:
                return Attempt("solved", "converged", iterations, solves, spline, result.stationarity)
            limits = limits.scaled(excess)
            programme = replace(programme, coordinates=self._coordinates(limits))
            free, duration, multiplier = result.free, result.duration, result.multiplier
        return Attempt("failed", "limits stay broken between the nodes", iterations, REPAIRS)

    def _coordinates(self, limits: Limits) -> Coordinates:
        build = Coordinates.straight_line if self.on_line else Coordinates.joints
        return build(self.q_start, self.q_goal, limits)

    def _smoothed(self, space: Basis) -> Array:
        """Control points (n, r) of the fastest motion with its corners rounded: its positions at the Greville points.

        Control values set to a function's values there give a spline that varies less than the function (Schoenberg).
        """
        line = self.coordinates
        points = time_optimal_positions(line.limits, line.start, line.goal, bspline.greville(space.knots))
        points[: bspline.REST_POINTS], points[-bspline.REST_POINTS :] = line.start, line.goal
        return points

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
        """The factors (≤ 1) by which each limit must be tightened, None when the motion holds them all."""
        limits = self.task.problem.active_limits
        # the certificate's own instants too: where a joint turns back, friction changes sign within a millisecond
        between, replayed = fine_samples(spline, TORQUE_POINTS)[1:], sample(spline, verify.grid(spline.duration))
        q, v, a = (np.concatenate(both) for both in zip(between, replayed, strict=True))
        tau = self.task.torques(q, v, a) + self.task.friction.torque(v)
        rates = peak_rates(spline)
        found = {
            "v_max": rates[0] / limits.v_max,
            "a_max": rates[1] / limits.a_max,
            "j_max": rates[2] / limits.j_max,
            "tau_max": np.abs(tau).max(axis=0) / limits.tau_max,
        }
        held = 1 - REPAIR_MARGIN / 4
        if max(float(ratio.max()) for ratio in found.values()) <= held:
            return None
        factors = {name: np.where(r > held, r + REPAIR_MARGIN, 1.0) for name, r in found.items()}
        factors["tau_max"] = 1 + TORQUE_REPAIR * (factors["tau_max"] - 1)
        return Limits(q_min=limits.q_min, q_max=limits.q_max, **{name: 1 / factor for name, factor in factors.items()})
