"""`polynomial_ga`: one polynomial per joint; its values and the duration are found by a genetic
algorithm.

R.-F. Fung, Y.-H. Cheng, "Trajectory planning based on minimum absolute input energy for an LCD
glass-handling robot", Appl. Math. Model. 38, 2014: high-degree polynomials by a real-coded genetic
algorithm. The algorithm is PyGAD's (A. F. Gad, "PyGAD: an intuitive genetic algorithm Python
library", Multimed. Tools Appl. 83, 2024). It has no test of convergence, so its answers never count
as optimal. If its motion collides, it runs again: from polynomials fitted to a planned path, with a
penalty for the clearance that is missing.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.collision.planner.path_planner import along
from joulepath.optimizer.collision.planner.state_validity import StateValidityChecker
from joulepath.optimizer.motion import quintic
from joulepath.optimizer.motion.polynomial import PolynomialBasis, polynomials
from joulepath.optimizer.motion.spline import (
    least_time_scale,
    retimed,
    spline_of,
    time_scales,
)
from joulepath.optimizer.result.solution import BaselineName
from joulepath.optimizer.solve.methods.limit_repair import torque_peaks
from joulepath.optimizer.solve.methods.method import Method
from joulepath.optimizer.solve.methods.planned_paths import (
    no_polynomial_around,
    plan,
    to_goal,
    without_path,
)
from joulepath.optimizer.solve.methods.solve_result import (
    MotionOrigin,
    SolveReason,
    SolveResult,
    SolveStatus,
)

# degree 9: with more values a few seconds are too short for the search
NODES = 4
POPULATION, GENERATIONS, PARENTS, ELITE, TOURNAMENT = 80, 120, 24, 4, 4
SEED = 0
# greatest deviation of a value from the straight line: this fraction of the joint's displacement,
# at least this [rad]
DISPLACEMENT_FRACTION, LEAST_REACH = 0.25, 0.15
# spread of the first population and of a mutation, as a fraction of that deviation; fraction of
# genes that mutate
SPREAD, MUTATION, MUTATION_SHARE = 0.1, 0.08, 0.15
# the longest duration, in multiples of the shortest one within the limits on speed, acceleration
# and jerk
SLOWEST = 4.0
# the limits on rates and torque are used up to these ratios: rates peak between grid points, torque
# between nodes
RATES_USED, TORQUE_USED = 1 - 1e-3, 1 - 5e-3
# relative increase of the cost for a limit exceeded by 100 %
PENALTY = 20.0
# one in so many nodes of a motion is checked for collisions, with this clearance [m] beyond the
# margins, since a motion comes nearer between them
EVERY, KEPT = 3, 5e-3
# a motion that exceeds torque between the nodes is retimed by this factor, at most so many times
TIME_SCALE, RETIMINGS = 1.01, 60


class PolynomialGA(Method):
    """Solves a candidate by a genetic algorithm; genes are the duration, and the deviations from a
    line or path.
    """

    # each takes seconds: only the candidates of least lower bound are solved
    most_solved: ClassVar[int | None] = 3
    accepted_baselines: ClassVar[tuple[BaselineName, ...]] = ("quintic",)
    converges: ClassVar[bool] = False

    # generations so far, and the least cost [J] of the first population
    generations: int = 0
    first_cost: float = np.inf
    # values at the nodes (NODES, nq) [rad] from which the genes deviate; None: those of the
    # straight line
    _planned: Array | None = None

    @property
    def space(self) -> PolynomialBasis:
        """The space of the polynomials."""
        return polynomials(NODES)

    @cached_property
    def _line(self) -> Array:
        """The quintic along the straight line at the nodes, (NODES, nq) [rad]."""
        return self.q_start + np.outer(quintic.fraction(self.space.at), self.q_goal - self.q_start)

    @cached_property
    def _reach(self) -> Array:
        """Greatest deviation (nq,) [rad] of a value from the straight line."""
        return np.maximum(DISPLACEMENT_FRACTION * np.abs(self.q_goal - self.q_start), LEAST_REACH)

    def solve(self) -> SolveResult:
        """The best motion of all generations; if it collides, of generations that deviate from a
        planned path.
        """
        if self.deadline.passed:
            return SolveResult(SolveStatus.OUT_OF_TIME, SolveReason.DEADLINE_PASSED)
        first = self._evolved()
        if first.collision is None or self.deadline.passed:
            return first
        planned = plan(self)
        paths = to_goal(self, planned)
        if not paths:
            return without_path(self, first, planned)
        self._planned = self.space.fit(
            *along(paths[0], 1.0, self.prepared.problem.arm.active_limits.v_max)
        )[1:-1]
        second = self._evolved()
        if second.spline is not None:
            return replace(second, origin=MotionOrigin.FROM_PLANNED_PATH, solves=2)
        return replace(
            no_polynomial_around(first, self.space.degree), iterations=self.generations, solves=2
        )

    def _evolved(self) -> SolveResult:
        """Run all generations, or until the deadline, and bring the best motion within the
        limits."""
        import pygad  # a request for another method need not wait for it

        rng = np.random.default_rng(SEED)
        genes = NODES * len(self.q_start) + 1
        first = np.clip(rng.normal(0.0, SPREAD, (POPULATION, genes)), -1.0, 1.0)
        first[:, -1] = np.linspace(-1.0, 1.0, POPULATION)
        # a quarter do not deviate, at several durations
        first[::4, :-1] = 0.0
        self.first_cost = float(self.costs(first).min())
        ga = pygad.GA(
            num_generations=GENERATIONS,
            num_parents_mating=PARENTS,
            initial_population=first,
            fitness_func=self._fitness,
            fitness_batch_size=POPULATION,
            gene_space=[{"low": -1.0, "high": 1.0}] * genes,
            parent_selection_type="tournament",
            K_tournament=TOURNAMENT,
            keep_elitism=ELITE,
            crossover_type="uniform",
            mutation_type="random",
            mutation_probability=MUTATION_SHARE,
            random_mutation_min_val=-MUTATION,
            random_mutation_max_val=MUTATION,
            on_generation=self._next,
            random_seed=SEED,
            suppress_warnings=True,
        )
        ga.run()
        best = np.asarray(ga.best_solution(ga.last_generation_fitness)[0], dtype=float)
        return self._within_limits(best)

    def costs(self, genes: Array) -> Array:
        """The cost (P,) [J] of every chromosome (P, n), with penalties for the limits that it
        exceeds.
        """
        limits = self.prepared.problem.arm.active_limits
        points, duration, late = self._decoded(genes)
        count, nq = len(points), points.shape[2]
        z = np.einsum("dkm,pmj->pkdj", self.space.at_nodes, points, optimize=True)
        z[:, :, 1] /= duration[:, None, None]
        z[:, :, 2] /= duration[:, None, None] ** 2
        cost, tau = self.prepared.kernel.value(z.reshape(-1, 3 * nq), self.interval.p)
        nodes = len(self.space.nodes)
        total = (
            duration * (cost.reshape(count, nodes) @ self.space.weights) + self.interval.constant
        )
        torque = np.abs(tau).reshape(count, nodes, nq).max(axis=1) / (limits.tau_max * TORQUE_USED)
        q = z[:, :, 0]
        beyond = (
            np.maximum(limits.q_min - q.min(axis=1), q.max(axis=1) - limits.q_max) / self._reach
        )
        broken = np.maximum(torque - 1, 0).sum(axis=1) + np.maximum(beyond, 0).sum(axis=1) + late
        if self._planned is not None:
            broken = broken + self._colliding(q[:, ::EVERY])
        return np.asarray(total + PENALTY * broken * np.abs(total))

    def _colliding(self, q: Array) -> Array:
        """The share (P,) of samples that collide, of motions with samples q (P, k, nq) [rad]."""
        return np.array(
            [np.mean([not self._checker.is_valid(each) for each in motion]) for motion in q]
        )

    @cached_property
    def _checker(self) -> StateValidityChecker:
        """Checks one configuration at a time: penalties need no distance."""
        return StateValidityChecker(
            self.prepared.problem.arm, self.prepared.surroundings.model, KEPT
        )

    def _decoded(self, genes: Array) -> tuple[Array, Array, Array]:
        """Points (P, NODES + 2, nq), durations (P,) [s], and the relative excess over the longest
        duration (P,).
        """
        count, nq = len(genes), len(self.q_start)
        centre = self._line if self._planned is None else self._planned
        values = centre + genes[:, :-1].reshape(count, NODES, nq) * self._reach
        ends = np.ones((count, 1, 1))
        points = np.concatenate([ends * self.q_start, values, ends * self.q_goal], axis=1)
        limits = self.prepared.problem.arm.active_limits
        peaks = np.abs(np.einsum("dgm,pmj->pdgj", self.space.at_grid, points, optimize=True)).max(
            axis=2
        )
        least = np.maximum(time_scales(peaks / (limits.rates * RATES_USED)), self.t_min)
        # the gene is linear in the duration's logarithm
        duration = np.clip(least * SLOWEST ** ((genes[:, -1] + 1) / 2), self.t_min, self.t_max)
        return points, duration, np.maximum(least / self.t_max - 1, 0)

    def _fitness(self, ga: Any, genes: Array, indices: Any) -> list[float]:
        genes = np.asarray(genes, dtype=float).reshape(-1, NODES * len(self.q_start) + 1)
        # always POPULATION of them: the kernel is set up for a number of nodes
        padded = np.concatenate([genes, np.zeros((POPULATION - len(genes), genes.shape[1]))])
        return [float(-cost) for cost in self.costs(padded)[: len(genes)]]

    def _next(self, ga: Any) -> str | None:
        self.generations += 1
        return "stop" if self.deadline.passed else None

    def _within_limits(self, genes: Array) -> SolveResult:
        """The motion of a chromosome, retimed until it is within the limits between the nodes
        too."""
        limits = self.prepared.problem.arm.active_limits
        points, duration, _ = self._decoded(genes[None])
        spline = spline_of(self.space, points[0], float(duration[0]))
        needed = least_time_scale(spline, limits.rates)
        if needed > 1:
            spline = retimed(spline, needed)
        for _ in range(RETIMINGS):
            if (
                spline.duration > self.t_max
                or (torque_peaks(self.prepared, spline) <= limits.tau_max).all()
            ):
                break
            spline = retimed(spline, TIME_SCALE)
        if (
            spline.duration > self.t_max
            or (torque_peaks(self.prepared, spline) > limits.tau_max).any()
        ):
            return SolveResult(
                SolveStatus.FAILED, SolveReason.NO_GENES_WITHIN_LIMITS, self.generations, 1
            )
        collision = self.prepared.surroundings.worst_violation(spline)
        if collision is not None:
            return SolveResult(
                SolveStatus.FAILED,
                SolveReason.NO_COLLISION_FREE_MOTION,
                self.generations,
                1,
                collision=collision,
            )
        return SolveResult(
            SolveStatus.SOLVED,
            SolveReason.BEST_OF_GENERATIONS,
            self.generations,
            1,
            spline,
            figures=(self.generations,),
        )
