"""One start and goal pair: what solves it, and the way from a first guess to a motion that holds every limit.

The methods themselves are in `optimizer.methods`, a file each.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from models.robot import Array, Limits
from optimizer.collision.bodies import Indices
from optimizer.deadline import Deadline
from optimizer.kinematics.path_constraints import PathConstraints
from optimizer.methods.duration_intervals import DurationInterval
from optimizer.methods.limit_repair import MARGIN, initial_bounds, tightened
from optimizer.methods.method import Method, SolveResult
from optimizer.nlp.clearance_constraint import CLEARANCE, RESERVE, SCALE
from optimizer.nlp.coordinates import Coordinates
from optimizer.nlp.nonlinear_program import FEASIBILITY, NonlinearProgram
from optimizer.nlp.sqp import SqpStatus, solve
from optimizer.prepared_problem import PreparedProblem
from optimizer.problem.problem import LONGEST_DURATION
from optimizer.solution import Clearance
from optimizer.trajectories.bspline import Basis
from optimizer.trajectories.spline import Spline, peak_rates, retimed, sample, spline_of, time_scale

# times that limits are tightened where the motion breaks them between the nodes, and by how much beyond the excess
REPAIRS = 8
REPAIR_MARGIN = 2e-4
# torque is tightened by this multiple of its excess: the peak that is held down between two nodes comes up beside them
TORQUE_REPAIR = 1.5
# a motion is retimed by at most this factor in place of another solve
MOST_STRETCH = 1 + 5e-4
# first durations tried, in multiples of the shortest that the guess allows
STRETCHES = (1.02, 1.15, 1.3, 1.5, 1.8, 2.3, 3.0, 4.5)
# samples at which limits along the path are looked at, and the multiple of an excess by which they are tightened
PATH_SAMPLES, PATH_REPAIR = 401, 1.5
NO_BETTER = "its best motion hits something, and even so spends no less than the best found"


@dataclass(frozen=True)
class Guess:
    """Where to begin: a spline space, all control points (n, r) in the candidate's coordinates, a duration [s]."""

    space: Basis
    points: Array
    duration: float


class SqpMethod(Method):
    """A method whose motions live in a linear space and are optimised by the SQP."""

    def __init__(
        self,
        prepared: PreparedProblem,
        q_start: Array,
        q_goal: Array,
        deadline: Deadline,
        interval: DurationInterval | None = None,
    ) -> None:
        super().__init__(prepared, q_start, q_goal, deadline, interval)
        self.coordinates = self._coordinates(prepared.problem.arm.active_limits.scaled(1 - MARGIN))

    def improve(self, guess: Guess, guarded: bool = False, deadline: Deadline | None = None) -> SolveResult:
        """Optimise from a guess, tightening the limits where the motion breaks them between the nodes.

        With `guarded`, for a guess that hits nothing, it keeps clear from the first step on. `deadline` is one earlier
        than the candidate's.
        """
        interval, kernel = self.interval, self.prepared.kernel
        deadline = self.deadline if deadline is None else deadline
        program = NonlinearProgram(
            kernel, guess.space, interval.p, self.coordinates, self.t_min, self.t_max, interval.constant
        )
        pairs: Indices = np.zeros(0, dtype=np.intp)
        if guarded:
            guessed = spline_of(guess.space, self.coordinates.to_joints(guess.points), 1.0)
            pairs = self.prepared.surroundings.active_pairs(guessed)
        path = self.prepared.surroundings.with_clearance(pairs) if guarded else self.prepared.path
        program = replace(program, path=path, path_bounds=initial_bounds(path))
        limits = self.prepared.problem.arm.active_limits.scaled(1 - MARGIN)
        free = guess.points[guess.space.free]
        duration = self._first_duration(program, free, guess.duration)
        iterations, multiplier, hit = 0, None, None
        for solves in range(1, REPAIRS + 1):
            result = solve(program, free, duration, multiplier, deadline)
            iterations += result.iterations
            if result.status is SqpStatus.OUT_OF_TIME:
                return SolveResult("out of time", "the deadline passed", iterations, solves)
            if result.violation > FEASIBILITY:
                reason = f"found no motion of {guess.space.n} control points that holds the limits"
                reason = reason if hit is None else f"found no way around: {hit.message}"
                return SolveResult("failed", reason, iterations, solves, hit=hit)
            spline = spline_of(guess.space, program.joint_points(result.free), result.duration)
            excess = self._excess(spline)
            if excess is not None:
                spline = self._stretched(spline, excess)
                excess = self._excess(spline)
            hit = self.prepared.surroundings.worst_violation(spline)
            if (
                hit is not None
                and not len(pairs)
                and self.prepared.objective_of(self.prepared.energy(spline)) >= self.best_known
            ):
                return SolveResult("pruned", NO_BETTER, iterations, solves)
            beyond = self._beyond(spline, program.path, hit)
            if excess is None and hit is None and not beyond.any():
                return SolveResult("solved", "converged", iterations, solves, spline, result.stationarity)
            if excess is not None:
                limits = tightened(limits, excess)
                program = replace(program, coordinates=self._coordinates(limits))
            # pairs are watched only once something is hit, since most motions hit nothing
            nearby = pairs if hit is None else np.union1d(pairs, self.prepared.surroundings.active_pairs(spline))
            program = self._watched(program, pairs, nearby, beyond, hit)
            pairs = nearby
            # the solver takes no step for positions alone: it bounds them
            free = np.clip(result.free, program.limits.q_min, program.limits.q_max)
            duration, multiplier = result.duration, result.multiplier
        reason = "limits stay broken between the nodes" if hit is None else f"found no way around: {hit.message}"
        return SolveResult("failed", reason, iterations, REPAIRS, hit=hit)

    def _watched(
        self, program: NonlinearProgram, pairs: Indices, nearby: Indices, beyond: Array, hit: Clearance | None
    ) -> NonlinearProgram:
        """The program with the limits along its path tightened, and all of `nearby` watched instead of `pairs`."""
        room = program.path_bounds - beyond
        if len(nearby) > len(pairs):
            path = self.prepared.surroundings.with_clearance(nearby)
            widened = initial_bounds(path)
            widened[np.append(np.ones(len(room) - len(pairs), dtype=bool), np.isin(nearby, pairs))] = room
            return replace(program, path=path, path_bounds=widened)
        if hit is not None and program.path is not None and not beyond.any():
            # met nowhere, but not proven either: a hair more between the points that are held
            room -= np.where(np.array(program.path.names) == CLEARANCE, RESERVE / SCALE, 0.0)
        return replace(program, path_bounds=room)

    def _beyond(self, spline: Spline, path: PathConstraints | None, hit: Clearance | None) -> Array:
        """By how much each share of the limits along the path must shrink, (c,): they are broken between the points."""
        if path is None:
            return np.zeros(0)
        # clearance comes last, and where it is proven the motion keeps it
        looked_at = path if hit is not None else self.prepared.path
        share = np.zeros(len(path.names))
        if looked_at is not None:
            q, v, _ = sample(spline, np.linspace(0.0, spline.duration, PATH_SAMPLES))
            share[: len(looked_at.names)] = looked_at.ratios(q, v).max(axis=0)
        beyond = share - 1
        return np.where(beyond > -REPAIR_MARGIN / 4, PATH_REPAIR * np.maximum(beyond, 0.0) + REPAIR_MARGIN, 0.0)

    def _coordinates(self, limits: Limits) -> Coordinates:
        """What the space describes: every joint by itself."""
        return Coordinates.joints(self.q_start, self.q_goal, limits)

    def _first_duration(self, program: NonlinearProgram, free: Array, least: float) -> float:
        """The cheapest of a few durations at which the guess holds the limits on speed, acceleration and jerk."""
        limits = program.limits
        rates = limits.rates
        peaks = np.abs(program.kinematics(free)).max(axis=1)
        shortest = max(time_scale(peaks / rates), least, program.t_min)
        if shortest >= program.t_max:
            return program.t_max
        durations = [shortest * stretch for stretch in STRETCHES]
        if program.t_max < LONGEST_DURATION:
            durations.append(program.t_max)
        best, chosen = np.inf, shortest
        for duration in durations:
            if duration > program.t_max:
                continue
            cost, tau = program.value(free, duration)
            cost *= 1 + float(np.maximum(np.abs(tau) / limits.tau_max - 1, 0).max())
            if cost < best:
                best, chosen = cost, duration
            elif best < np.inf and duration < program.t_max:
                break
        return chosen

    def _stretched(self, spline: Spline, factors: Limits) -> Spline:
        """The motion retimed until speed, acceleration and jerk hold their limits, if that takes next to no time."""
        needed = time_scale(1 / factors.rates)
        return spline if needed > MOST_STRETCH or spline.duration * needed > self.t_max else retimed(spline, needed)

    def _excess(self, spline: Spline) -> Limits | None:
        """The factors (≤ 1) by which each limit must be tightened, positions by how much [rad]; None if all hold."""
        limits = self.prepared.problem.arm.active_limits
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
