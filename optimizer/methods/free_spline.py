"""`bspline`: every joint a quintic B-spline of its own, its control points and the duration optimised together.

C. Hansen, J. Öltjen, D. Meike, T. Ortmaier, "Enhanced approach for energy-efficient trajectory generation of industrial
robots", IEEE CASE 2012: B-splines optimised by an SQP. Knots repeated where jerk switches, and the ways to a first
guess, are this project's.
"""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

from models.robot import Array
from optimizer.collision.path_planner import along, interpolation_is_free, length
from optimizer.methods.method import SolveResult
from optimizer.methods.sqp_method import Guess, SqpMethod
from optimizer.problem.problem import LEAST_DURATION
from optimizer.solution import BaselineName
from optimizer.trajectories import bspline
from optimizer.trajectories import seven_segment as profile
from optimizer.trajectories.bspline import Basis
from optimizer.trajectories.ruckig_motion import time_optimal, time_optimal_positions
from optimizer.trajectories.spline import Spline, sample

# control points of a first attempt with evenly spaced knots
COARSE = 13
# evenly spaced knots are not tried where less than this multiple of the shortest duration is allowed
TIGHT = 1.12
# how often knots are repeated where jerk switches: it bends there in a refined motion, and jumps in the finest
REFINED, EXACT = 2, 3
# shares of the time left that a candidate's ways around may take, looking for them and in all
PLANNING, PATIENCE = 0.1, 0.3
# a way longer than the shortest by more than this is not tried
DETOUR = 1.3
# said of what came of one
FROM_PLANNED_PATH = ", from a planned collision-free path"


class FreeSpline(SqpMethod):
    """Solves a candidate over splines whose knots follow from where jerk switches."""

    guess_baselines: ClassVar[tuple[BaselineName, ...]] = (
        "trapezoid",
        "quintic",
        "ruckig",
        "ruckig_slowed",
        "controller_default",
    )
    accepted_baselines: ClassVar[tuple[BaselineName, ...]] = ("quintic", "ruckig", "ruckig_slowed")

    def solve(self) -> SolveResult:
        """From the ground up; over knots made for haste where time is short or evenly spaced ones find nothing."""
        shortest = float(profile.shortest_duration(self.q_goal - self.q_start, self.coordinates.limits))
        tried: list[SolveResult] = []
        if not self.interval.minimum_time and self.t_max >= TIGHT * shortest:
            space = bspline.uniform(COARSE)
            tried.append(self.improve(Guess(space, self._smoothed(space), 0.0)))
        if not tried or (tried[-1].status == "failed" and tried[-1].hit is None):
            tried.append(self.improve(self.time_optimal_guess()))
        if tried[-1].status == "failed" and tried[-1].hit is not None:
            tried.append(self.around(tried[-1]))
        return replace(tried[-1], iterations=sum(a.iterations for a in tried), solves=sum(a.solves for a in tried))

    def around(self, stuck: SolveResult) -> SolveResult:
        """From ways that hit nothing, the cheapest motion that comes of them; `stuck` itself where none does."""
        prepared, space = self.prepared, bspline.uniform(COARSE)
        v_max, left = prepared.problem.arm.active_limits.v_max, max(self.deadline.left, 0.0)
        planning, patience = self.deadline.within(PLANNING * left), self.deadline.within(PATIENCE * left)
        ways = prepared.surroundings.planned_paths(self.q_start, self.q_goal, planning)
        found: list[SolveResult] = []
        for way in ways:
            if patience.passed or length(way, v_max) > DETOUR * length(ways[0], v_max):
                break
            q, t = along(way, 1.0, v_max)
            motions = [sample(a.spline, t * a.spline.duration)[0] for a in found if a.spline is not None]
            if any(interpolation_is_free(prepared.surroundings.model, q, motion) for motion in motions):
                continue
            points = space.fit(self.coordinates.from_joints(q), t)
            outcome = self.improve(Guess(space, points, 0.0), guarded=True, deadline=patience)
            found.append(replace(outcome, reason=f"{outcome.reason}{FROM_PLANNED_PATH}"))
        solved = [
            (prepared.objective_of(prepared.energy(a.spline)), k) for k, a in enumerate(found) if a.spline is not None
        ]
        best = found[min(solved)[1]] if solved else stuck
        return replace(best, iterations=sum(a.iterations for a in found), solves=sum(a.solves for a in found))

    @staticmethod
    def may_refine(found: Spline) -> bool:
        """More control points, placed where jerk switches, unless they are placed so already."""
        return len(found.control_points) == COARSE

    def solve_from(self, q: Array, t: Array, fine: bool) -> SolveResult:
        """From samples q (k, nq) at times t (k,), over knots where jerk bends, or jumps if `fine`."""
        duration = float(t[-1])
        space = self.graded(duration, EXACT if fine else REFINED)
        guess = Guess(space, space.fit(self.coordinates.from_joints(q), t / duration), duration)
        # what was led around something would otherwise go back to where it is stuck
        outcome = self.improve(guess, guarded=self.prepared.surroundings.is_near_contact(q))
        led = outcome.status == "solved" and self.prepared.surroundings.has_planned_paths(self.q_start, self.q_goal)
        return replace(outcome, reason=f"{outcome.reason}{FROM_PLANNED_PATH}") if led else outcome

    def time_optimal_guess(self) -> Guess:
        """The fastest motion under limits on speed, acceleration and jerk, in a space that holds its jerk's jumps."""
        line = self.coordinates
        fastest = time_optimal(line.limits, line.start, line.goal)
        duration = max(fastest.duration, LEAST_DURATION)
        space = self.graded(duration, EXACT)
        return Guess(space, space.fit(fastest.q, fastest.t / duration), duration)

    def graded(self, duration: float, repeat: int) -> Basis:
        """A space with knots where the leading coordinate's jerk switches in a motion of that duration."""
        line = self.coordinates
        return bspline.graded(profile.switches(line.goal - line.start, duration, line.limits), repeat)

    def _smoothed(self, space: Basis) -> Array:
        """Control points (n, r) of the fastest motion with its corners rounded: its positions at the Greville points.

        Control values set to a function's values there give a spline that varies less than the function (Schoenberg).
        """
        line = self.coordinates
        points = time_optimal_positions(line.limits, line.start, line.goal, bspline.greville(space.knots))
        points[: bspline.REST_POINTS], points[-bspline.REST_POINTS :] = line.start, line.goal
        return points
