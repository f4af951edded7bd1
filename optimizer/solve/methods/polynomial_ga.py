"""`polynomial_ga`: one polynomial per joint, found by a genetic algorithm.

R.-F. Fung, Y.-H. Cheng, "Trajectory planning based on minimum absolute input energy for an LCD
glass-handling robot", Appl. Math. Model. 38, 2014: high-degree polynomials by a real-coded genetic
algorithm. The algorithm is PyGAD's (A. F. Gad, "PyGAD: an intuitive genetic algorithm Python
library", Multimed. Tools Appl. 83, 2024). It has no test of convergence, so its answers never count
as optimal. If its motion collides, the algorithm runs again from polynomials fitted to a planned
path, with a penalty for missing clearance.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.collision.planner.joint_path import path_samples
from joulepath.optimizer.collision.planner.state_validity import StateValidityChecker
from joulepath.optimizer.motion import quintic
from joulepath.optimizer.motion.polynomial import PolynomialBasis, polynomials
from joulepath.optimizer.motion.spline import least_time_scale, retimed, spline_of, time_scales
from joulepath.optimizer.result.baseline import BaselineName
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


@dataclass(frozen=True)
class PolynomialGASettings:
    """Settings of the genetic algorithm."""

    nodes: int = 4
    """Free values of every polynomial, of degree 9: with more, a few seconds are too short."""

    population: int = 80
    """Chromosomes of a generation."""

    generations: int = 120
    """Number of generations."""

    parents: int = 24
    """Parents of a generation."""

    elite: int = 4
    """Best chromosomes kept unchanged."""

    tournament: int = 4
    """Chromosomes of a selection tournament."""

    seed: int = 0
    """Seed of the random numbers."""

    displacement_share: float = 0.25
    """Largest deviation of a value from the straight line, relative to the joint's displacement."""

    least_deviation: float = 0.15
    """The same, at least [rad]."""

    spread: float = 0.1
    """Standard deviation of the first population, relative to the largest deviation."""

    mutation: float = 0.08
    """Largest mutation, relative to the largest deviation."""

    mutation_share: float = 0.15
    """Share of genes that mutate."""

    slowest: float = 4.0
    """Longest duration, in multiples of the shortest duration within the limits on rates."""

    rates_used: float = 1 - 1e-3
    """Share of the limits on rates that is used: rates peak between grid points."""

    torque_used: float = 1 - 5e-3
    """Share of the torque limits that is used: torque peaks between nodes."""

    penalty: float = 20.0
    """Relative increase of the cost for a limit exceeded by 100 %."""

    checked_every: int = 3
    """Distance between the nodes that are checked for collisions."""

    clearance: float = 5e-3
    """Clearance of these nodes beyond the margins, since a motion comes nearer in between [m]."""

    time_scale: float = 1.01
    """Time scale of a motion that exceeds torque between the nodes."""

    max_retimings: int = 60
    """Largest number of such retimings."""


POLYNOMIAL_GA = PolynomialGASettings()


class PolynomialGA(Method):
    """Solves a candidate by a genetic algorithm.

    The genes are the duration, and deviations from the straight line or from a planned path. A
    solve takes seconds: only the candidates of least lower bound are solved.
    """

    most_solved: ClassVar[int | None] = 3
    accepted_baselines: ClassVar[tuple[BaselineName, ...]] = ("quintic",)
    converges: ClassVar[bool] = False

    generations: int = 0
    """Number of generations so far."""

    first_cost: float = np.inf
    """Least cost of the first population [J]."""

    _planned: Array | None = None
    """Values of a planned path at the nodes, shape (nodes, nq) [rad]; None for the straight
    line."""

    @property
    def space(self) -> PolynomialBasis:
        """The space of the polynomials."""
        return polynomials(POLYNOMIAL_GA.nodes)

    @cached_property
    def _line(self) -> Array:
        """The quintic along the straight line at the nodes, shape (nodes, nq) [rad]."""
        return self.q_start + np.outer(quintic.fraction(self.space.at), self.q_goal - self.q_start)

    @cached_property
    def _largest_deviation(self) -> Array:
        """Largest deviation (nq,) [rad] of a value from the straight line."""
        settings = POLYNOMIAL_GA
        displacement = np.abs(self.q_goal - self.q_start)
        return np.maximum(settings.displacement_share * displacement, settings.least_deviation)

    def solve(self) -> SolveResult:
        """Solve by a genetic algorithm, along a planned path after a collision."""
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
            *path_samples(paths[0], 1.0, self.prepared.problem.arm.active_limits.v_max)
        )[1:-1]
        second = self._evolved()
        if second.spline is not None:
            return replace(second, origin=MotionOrigin.FROM_PLANNED_PATH, solves=2)
        return replace(
            no_polynomial_around(first, self.space.degree), iterations=self.generations, solves=2
        )

    def _evolved(self) -> SolveResult:
        """Run the generations until the deadline, and bring the best motion within its limits."""
        # requests for other methods need not wait for this import
        import pygad

        settings = POLYNOMIAL_GA
        population = settings.population
        rng = np.random.default_rng(settings.seed)
        genes = settings.nodes * len(self.q_start) + 1
        first = np.clip(rng.normal(0.0, settings.spread, (population, genes)), -1.0, 1.0)
        first[:, -1] = np.linspace(-1.0, 1.0, population)
        # a quarter of the population does not deviate, at several durations
        first[::4, :-1] = 0.0
        self.first_cost = float(self.costs(first).min())
        ga = pygad.GA(
            num_generations=settings.generations,
            num_parents_mating=settings.parents,
            initial_population=first,
            fitness_func=self._fitness,
            fitness_batch_size=population,
            gene_space=[{"low": -1.0, "high": 1.0}] * genes,
            parent_selection_type="tournament",
            K_tournament=settings.tournament,
            keep_elitism=settings.elite,
            crossover_type="uniform",
            mutation_type="random",
            mutation_probability=settings.mutation_share,
            random_mutation_min_val=-settings.mutation,
            random_mutation_max_val=settings.mutation,
            on_generation=self._next,
            random_seed=settings.seed,
            suppress_warnings=True,
        )
        ga.run()
        best = np.asarray(ga.best_solution(ga.last_generation_fitness)[0], dtype=float)
        return self._within_limits(best)

    def costs(self, genes: Array) -> Array:
        """Costs (P,) [J] of chromosomes (P, n), with penalties for exceeded limits."""
        settings = POLYNOMIAL_GA
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
        torque = np.abs(tau).reshape(count, nodes, nq).max(axis=1)
        torque = torque / (limits.tau_max * settings.torque_used)
        q = z[:, :, 0]
        beyond = np.maximum(limits.q_min - q.min(axis=1), q.max(axis=1) - limits.q_max)
        beyond = beyond / self._largest_deviation
        broken = np.maximum(torque - 1, 0).sum(axis=1) + np.maximum(beyond, 0).sum(axis=1) + late
        if self._planned is not None:
            broken = broken + self._colliding(q[:, :: settings.checked_every])
        return np.asarray(total + settings.penalty * broken * np.abs(total))

    def _colliding(self, q: Array) -> Array:
        """Shares (P,) of colliding samples of motions with samples q (P, k, nq) [rad]."""
        return np.array(
            [np.mean([not self._checker.is_valid(each) for each in motion]) for motion in q]
        )

    @cached_property
    def _checker(self) -> StateValidityChecker:
        """Check of single configurations: penalties need no distance."""
        arm, model = self.prepared.problem.arm, self.prepared.surroundings.model
        return StateValidityChecker(arm, model, POLYNOMIAL_GA.clearance)

    def _decoded(self, genes: Array) -> tuple[Array, Array, Array]:
        """Values, durations and excess of chromosomes.

        Args:
            genes: the chromosomes, shape (P, n).

        Returns:
            Values at the nodes and ends (P, nodes + 2, nq) [rad], durations (P,) [s], and the
            relative excess over the longest duration (P,).
        """
        settings = POLYNOMIAL_GA
        count, nq = len(genes), len(self.q_start)
        centre = self._line if self._planned is None else self._planned
        values = centre + genes[:, :-1].reshape(count, settings.nodes, nq) * self._largest_deviation
        ends = np.ones((count, 1, 1))
        points = np.concatenate([ends * self.q_start, values, ends * self.q_goal], axis=1)
        limits = self.prepared.problem.arm.active_limits
        peaks = np.abs(np.einsum("dgm,pmj->pdgj", self.space.at_grid, points, optimize=True)).max(
            axis=2
        )
        least = np.maximum(time_scales(peaks / (limits.rates * settings.rates_used)), self.t_min)
        # the gene is linear in the duration's logarithm
        duration = least * settings.slowest ** ((genes[:, -1] + 1) / 2)
        duration = np.clip(duration, self.t_min, self.t_max)
        return points, duration, np.maximum(least / self.t_max - 1, 0)

    def _fitness(self, ga: Any, genes: Array, indices: Any) -> list[float]:
        settings = POLYNOMIAL_GA
        size = settings.nodes * len(self.q_start) + 1
        genes = np.asarray(genes, dtype=float).reshape(-1, size)
        # padded to the population, since the kernel is set up for a number of nodes
        padded = np.concatenate([genes, np.zeros((settings.population - len(genes), size))])
        return [float(-cost) for cost in self.costs(padded)[: len(genes)]]

    def _next(self, ga: Any) -> str | None:
        self.generations += 1
        return "stop" if self.deadline.passed else None

    def _within_limits(self, genes: Array) -> SolveResult:
        """The motion of a chromosome, retimed until it keeps its limits between the nodes."""
        limits = self.prepared.problem.arm.active_limits
        points, duration, _ = self._decoded(genes[None])
        spline = spline_of(self.space, points[0], float(duration[0]))
        needed = least_time_scale(spline, limits.rates)
        if needed > 1:
            spline = retimed(spline, needed)
        for _ in range(POLYNOMIAL_GA.max_retimings):
            if (
                spline.duration > self.t_max
                or (torque_peaks(self.prepared, spline) <= limits.tau_max).all()
            ):
                break
            spline = retimed(spline, POLYNOMIAL_GA.time_scale)
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
