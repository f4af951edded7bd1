"""Public entry point: `excite(problem)` finds a motion that determines the parameters of an arm.

The motion is a Fourier series at rest at both ends (Swevers, Ganseman, Tükel, De Schutter, Van
Brussel 1997), D-optimal, found by L-BFGS on a cost with penalties from several random starts. A
longer period removes the remaining excess of speed, acceleration, jerk and torque. Starts without a
proof of clearance are dropped.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import OptimizeResult, minimize

from joulepath.models.robot import Array
from joulepath.optimizer.certificate import certify
from joulepath.optimizer.collision.model import CollisionModel, collision_model
from joulepath.optimizer.deadline import Deadline
from joulepath.optimizer.dynamics.plant import Plant
from joulepath.optimizer.exceptions import DeadlineExceeded, OutsideLimits
from joulepath.optimizer.excitation.errors import ExcitationInfeasible
from joulepath.optimizer.excitation.excitation_problem import ExcitationProblem
from joulepath.optimizer.excitation.excitation_result import (
    Excitation,
    PredictedDeviation,
    Series,
)
from joulepath.optimizer.excitation.fourier import FourierBasis
from joulepath.optimizer.excitation.information import Information
from joulepath.optimizer.excitation.limits import (
    ClearancePenalty,
    excess,
    range_excess,
    torque_excess,
)
from joulepath.optimizer.excitation.torque_columns import TorqueColumns
from joulepath.optimizer.linear_algebra import one_thread
from joulepath.optimizer.motion.spline import Spline, retimed
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.problem.declared_types import checked_arguments
from joulepath.optimizer.problem.problem import Problem
from joulepath.optimizer.problem.scene import HalfSpace, Obstacle, Scene
from joulepath.optimizer.progress import Steps, TellSteps, no_listener
from joulepath.optimizer.result.certificate import Certificate
from joulepath.optimizer.result.energy import Energy

MOUNTING_PLANE = "mounting plane"


@dataclass(frozen=True)
class ExcitationSettings:
    """Settings of the search for an excitation."""

    states: int = 120
    """States of the period at which columns and limits are evaluated."""
    penalty_weight: float = 40.0
    """Weight of the penalties in the cost."""
    max_evaluations: int = 1000
    """Largest number of evaluations of the cost per start."""
    cost_tolerance: float = 1e-5
    """Relative decrease of the cost at which a start ends [1]."""
    lbfgs_memory: int = 30
    """Corrections that L-BFGS keeps."""
    independent_rate: float = 10.0
    """Independent samples per second assumed for the predicted deviations [Hz]; residuals of
    torques are correlated over 0.1 s."""
    centre_attempts: int = 100
    """Random centres that are tested for collisions."""
    start_amplitude: float = 0.15
    """Largest coefficient of a start [rad/s]."""
    start_range: float = 0.2
    """Share of a joint's range from its ends to the centre of a start, and to which its motion
    about the centre is limited [1]."""
    fallback_shares: tuple[float, ...] = (1.0, 0.9, 0.7, 0.4, 0.0)
    """Shares of the way from the start to the optimum, tried in turn for a motion within all
    limits."""
    search_share: float = 0.9
    """Share of a start's time that the search may use; the certificate needs the rest."""


EXCITATION = ExcitationSettings()


@checked_arguments
@one_thread()
def excite(problem: ExcitationProblem, tell: TellSteps = no_listener) -> Excitation:
    """Find an excitation from several random starts.

    Args:
        problem: the request.
        tell: gets the progress, in starts.

    Returns:
        The best motion of all starts completed before the deadline.

    Raises:
        ExcitationInfeasible: no start leads to a motion within all limits.
        DeadlineExceeded: the deadline passed before any start ended.
    """
    deadline = Deadline.after(problem.deadline)
    design = _Design(problem)
    best: Excitation | None = None
    done = feasible = 0
    limit: str | None = None
    for start in Steps("starts", problem.starts, tell).each(range(problem.starts)):
        if deadline.passed:
            break
        coordinates = design.start(start)
        part = EXCITATION.search_share * deadline.left / (problem.starts - start)
        done += 1
        if coordinates is None:
            limit = "clearance"
            continue
        motion, limit = design.within_limits(
            coordinates, design.improved(coordinates, deadline.within(part))
        )
        if motion is None:
            continue
        feasible += 1
        if best is None or motion.cost < best.cost:
            best = motion
    if best is None:
        raise DeadlineExceeded([]) if limit is None else ExcitationInfeasible(limit)
    return replace(best, starts=done, feasible=feasible)


class _Design:
    """A problem with its regression columns, limits and collision model."""

    def __init__(self, problem: ExcitationProblem) -> None:
        self.problem, self.arm = problem, _with_mounting_plane(problem)
        self.basis = FourierBasis(problem.period, problem.harmonics)
        self.columns = TorqueColumns(self.arm, problem.parts, EXCITATION.states)
        t = np.arange(EXCITATION.states) * problem.period / EXCITATION.states
        self.matrices = [self.basis.matrix(t, order) for order in range(4)]
        self.plant = Plant(self.arm)
        limits = self.arm.active_limits
        self.rates = [limits.v_max * problem.speed_fraction, limits.a_max, limits.j_max]
        self.collisions: CollisionModel | None = (
            collision_model(self.arm) if self.arm.collisions else None
        )

    def start(self, number: int) -> Array | None:
        """Coordinates of a small motion around a collision-free centre; None if no centre was
        found."""
        random, limits = np.random.default_rng(number), self.arm.active_limits
        size = (self.basis.free, self.arm.robot.nq)
        small = random.uniform(
            -EXCITATION.start_amplitude, EXCITATION.start_amplitude, size
        ) * np.minimum(1.0, limits.v_max)
        low, high = np.maximum(limits.q_min, -np.pi), np.minimum(limits.q_max, np.pi)
        # a joint of a narrow range starts with a smaller motion, within this range
        reach = np.abs(self.matrices[0][:, 1:] @ small).max(axis=0)
        small *= np.minimum(1.0, EXCITATION.start_range * (high - low) / reach)
        if self.problem.centre is not None:
            return np.vstack([self.problem.centre, small])
        for centre in random.uniform(
            low + EXCITATION.start_range * (high - low),
            high - EXCITATION.start_range * (high - low),
            (EXCITATION.centre_attempts, len(low)),
        ):
            q = centre + self.matrices[0][:, 1:] @ small
            if (
                self.collisions is None
                or self.collisions.least_distance(q, 0.1) > self.problem.clearance
            ):
                return np.vstack([centre, small])
        return None

    def improved(self, coordinates: Array, deadline: Deadline) -> Array:
        """Coordinates of a local minimum of the cost, or of the last point before the deadline."""
        shape = coordinates.shape
        fixed = self.problem.centre is not None

        def cost(x: Array) -> tuple[float, Array]:
            value, gradient = self.cost(x.reshape(shape))
            if fixed:
                gradient[0] = 0.0
            return value, gradient.ravel()

        def stop_late(intermediate_result: OptimizeResult) -> None:
            if deadline.passed:
                raise StopIteration

        found = minimize(
            cost,
            coordinates.ravel(),
            jac=True,
            method="L-BFGS-B",
            callback=stop_late,
            options={
                "maxfun": EXCITATION.max_evaluations,
                "maxiter": EXCITATION.max_evaluations,
                "maxcor": EXCITATION.lbfgs_memory,
                "ftol": EXCITATION.cost_tolerance,
            },
        )
        return np.asarray(found.x, dtype=float).reshape(shape)

    def cost(self, coordinates: Array) -> tuple[float, Array]:
        """Cost with penalties, and its gradient (1 + free, nq)."""
        arm, columns = self.arm, self.columns
        q, v, a, jerk = states = [matrix @ coordinates for matrix in self.matrices]
        W = columns.values(q, v, a)
        noise = np.asarray(self.problem.noise)
        wanted = (W[:, :, columns.wanted] / noise[:, None]).reshape(-1, len(columns.wanted))
        value, by_wanted = Information(wanted).criterion(self.problem.criterion)
        seed = np.zeros_like(W)
        seed[:, :, columns.wanted] = by_wanted.reshape(*W.shape[:2], -1) / noise[:, None]
        torque_cost, by_torque = torque_excess(arm, W @ columns.dynamics, v, a)
        seed += EXCITATION.penalty_weight * by_torque[:, :, None] * columns.dynamics
        gradients = [*columns.pulled_back(q, v, a, seed), np.zeros_like(jerk)]
        penalties = [
            range_excess(arm, q),
            *(excess(x, most) for x, most in zip(states[1:], self.rates, strict=True)),
        ]
        for order, (_, by_state) in enumerate(penalties):
            gradients[order] = gradients[order] + EXCITATION.penalty_weight * by_state
        penalty = torque_cost + sum(each for each, _ in penalties)
        if self.collisions is not None:
            near, by_q = ClearancePenalty(self.collisions, self.problem.clearance)(q)
            penalty += near
            gradients[0] = gradients[0] + EXCITATION.penalty_weight * by_q
        total = sum(
            matrix.T @ gradient for matrix, gradient in zip(self.matrices, gradients, strict=True)
        )
        return value + EXCITATION.penalty_weight * penalty, np.asarray(total)

    def within_limits(self, start: Array, found: Array) -> tuple[Excitation | None, str | None]:
        """The first motion within all limits on the way from the end of a search to its start.

        A search without enough time may end beyond a limit.

        Args:
            start: coordinates of the start.
            found: coordinates of the end of the search.

        Returns:
            The motion and None; or None and the limit exceeded by the last motion.
        """
        limit = None
        for share in EXCITATION.fallback_shares:
            try:
                motion = self.certified(start + share * (found - start))
            except OutsideLimits:
                # of the rest at both ends
                limit = "position"
                continue
            limit = self.exceeded_limit(motion.certificate)
            if limit is None:
                return motion, None
        return None, limit

    def certified(self, coordinates: Array) -> Excitation:
        """The motion with its certificate, and with a period long enough for all rates and
        torques."""
        spline = self.basis.spline(coordinates)
        certificate, energy = self._certificate(spline)
        stretch = self._stretch(certificate)
        basis = FourierBasis(self.basis.period * stretch, self.basis.harmonics)
        if stretch > 1:
            spline = retimed(spline, stretch)
            certificate, energy = self._certificate(spline)
        # the coefficients are speeds, so a longer period makes them smaller
        stretched = np.vstack([coordinates[:1], coordinates[1:] / stretch])
        t = np.linspace(0.0, spline.duration, EXCITATION.states, endpoint=False)
        W = self.columns.values(*(np.asarray(spline.curve(t, order)) for order in range(3)))
        noise = np.asarray(self.problem.noise)
        information = Information(
            (W[:, :, self.columns.wanted] / noise[:, None]).reshape(-1, len(self.columns.wanted))
        )
        deviations = information.deviations(
            EXCITATION.independent_rate * spline.duration * self.arm.robot.nq
        )
        return Excitation(
            coefficients=Series(basis.period, *basis.coefficients(stretched)),
            trajectory=self.plant.trajectory(spline, self.problem.sample_period),
            energy=energy,
            condition=information.condition(scaled=False),
            scaled_condition=information.condition(scaled=True),
            predicted_sd=[
                PredictedDeviation(self.columns.names[k], sd)
                for k, sd in zip(self.columns.wanted, deviations.tolist(), strict=True)
            ],
            cost=information.criterion(self.problem.criterion)[0],
            certificate=certificate,
            starts=0,
            feasible=0,
        )

    def _stretch(self, certificate: Certificate) -> float:
        """Factor ≥ 1 on the period that brings every rate within its limit."""
        orders = {
            "velocity": 1,
            "acceleration": 2,
            "jerk": 3,
            "tcp_speed": 1,
            "elbow_speed": 1,
            "torque": 2,
        }
        ratios = dict(certificate.worst_ratio)
        ratios["velocity"] /= self.problem.speed_fraction
        needed = [
            (ratios[name] * (1 + 1e-9)) ** (1 / order)
            for name, order in orders.items()
            if name in ratios
        ]
        return float(max(1.0, *needed))

    def exceeded_limit(self, certificate: Certificate) -> str | None:
        """Limit exceeded by a motion; None if it is within all limits."""
        clearance = certificate.clearance
        if clearance is not None and clearance.min_clearance < self.problem.clearance:
            return "clearance"
        if not certificate.valid:
            return max(certificate.worst_ratio, key=certificate.worst_ratio.__getitem__)
        return None

    def _certificate(self, spline: Spline) -> tuple[Certificate, Energy]:
        energy, (start, *_, goal) = self.plant.energy(spline), spline.control_points
        return certify(
            Problem(arm=self.arm, start=start, goal=goal), spline, start, goal, energy
        ), energy


def _with_mounting_plane(problem: ExcitationProblem) -> Arm:
    """The arm with its mounting plane among the obstacles, if requested."""
    arm = problem.arm
    if not (problem.mounting_plane and arm.collisions) or MOUNTING_PLANE in arm.scene.names:
        return arm
    plane = Obstacle(MOUNTING_PLANE, HalfSpace(), margin=0.0)
    return replace(arm, scene=Scene([*arm.scene.obstacles, plane]))
