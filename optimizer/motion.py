"""A problem made ready to compute with, and what a spline motion does in it: samples, torques, energy, limits."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import pinocchio as pin
from scipy.interpolate import BSpline

from models.robot import Array, FrictionLaw
from optimizer import bspline
from optimizer.arm import Arm
from optimizer.bus import charges, drawn_at
from optimizer.clearance import clearance
from optimizer.collision import CollisionModel, Indices, collision_model
from optimizer.dwell import holding_power
from optimizer.energy import breakdown, power_flow
from optimizer.keep_away import KeepAway
from optimizer.kernel import Kernel, Parameters, kernel_for
from optimizer.kinematics import joint_placements
from optimizer.path_limits import PathLimits
from optimizer.problem import Problem
from optimizer.solution import Clearance, Energy, Spline, Trajectory
from optimizer.way_around import ways_around

# smoothing that the optimiser works with: friction's reversal [rad/s] and the corners of |power| [W]
KNEE = 0.02
WIDTH = 0.5
# what a second costs where the shortest duration is looked for [W]: a hundred times what energy could make up for
HASTE = 1e4
# quadrature points per panel for reported energies, the longest panel [s], and how many there are at most
REPORT_NODES = 8
LONGEST_PANEL, LEAST_PANELS, MOST_PANELS = 0.2, 64, 2000
# points per knot span at which peaks of speed, acceleration and jerk are looked for
RATE_POINTS = 33
# samples at which contact is looked for, and a distance [m] there that leaves no doubt until the certificate
CONTACT_SAMPLES, CLEAR = 96, 0.02
# pairs further apart than that [m] are left out of the programme until a motion brings them nearer
WATCHED = 0.15
# nearer to something than this beyond the margins [m], a motion is taken to be held off by it
GRAZING = 5e-3
# rounding of a share of a limit
SHARE_TOLERANCE = 1e-6


@dataclass(frozen=True)
class Plant:
    """An arm with its kernel and Pinocchio model."""

    arm: Arm

    @cached_property
    def kernel(self) -> Kernel:
        """The robot's compiled functions."""
        return kernel_for(self.arm.robot)

    @cached_property
    def model(self) -> pin.Model:
        """Pinocchio model of the arm, payload and gravity included."""
        return self.arm.loaded_model()

    @cached_property
    def _data(self) -> pin.Data:
        return self.model.createData()

    def parameters(
        self,
        electrical: float = 0.0,
        mechanical: float = 0.0,
        time: float = 0.0,
        regeneration: float | None = None,
    ) -> Array:
        """Packed kernel parameters with the given weights on energies [1] and duration [W].

        A store has no cost per instant: `regeneration` then says what its charge is taken to be worth. None: the arm's.
        """
        payload, friction, drives = self.arm.payload, self.arm.friction_law, self.arm.drives
        return Parameters(
            mass=payload.mass,
            com=payload.com,
            inertia=payload.inertia[[0, 0, 0, 1, 1, 2], [0, 1, 2, 1, 2, 2]],
            gravity=self.arm.gravity,
            rotor_inertia=drives.rotor_inertia,
            coulomb=friction.coulomb,
            curved=friction.curved,
            speed=friction.speed,
            viscous=friction.viscous,
            torque_constant=drives.torque_constant,
            copper=drives.copper,
            inverter_constant=drives.inverter_constant,
            inverter_linear=drives.inverter_linear,
            inverter_quadratic=drives.inverter_quadratic,
            base_power=self.arm.base_power,
            regeneration=self.arm.regeneration if regeneration is None else regeneration,
            isolated=float(self.arm.bus.mode == "isolated"),
            link_mass_scale=self.arm.link_mass_scale,
            electrical=electrical,
            mechanical=mechanical,
            time=time,
            knee=KNEE,
            width=WIDTH,
        ).pack()

    @cached_property
    def electrical_parameters(self) -> Array:
        """Parameters with the electrical energy as the cost."""
        return self.parameters(electrical=1.0)

    @property
    def friction(self) -> FrictionLaw:
        """The friction law in force."""
        return self.arm.friction_law

    def torques(self, q: Array, v: Array, a: Array) -> Array:
        """Rigid body and rotor torques (k, nq) [N·m]."""
        return self.kernel.torque(q, v, a, self.electrical_parameters)

    def potential(self, q: Array) -> float:
        """Potential energy [J] of arm and payload."""
        return float(pin.computePotentialEnergy(self.model, self._data, q))

    def energy(self, spline: Spline) -> Energy:
        """Energy of a spline motion by Gauss-Legendre quadrature, with the exact, unsmoothed formulas."""
        weights, q, v, a = fine_samples(spline, REPORT_NODES)
        ends = spline.control_points
        change = self.potential(ends[-1]) - self.potential(ends[0])
        return breakdown(weights, v, self.torques(q, v, a), change, self.arm)

    def trajectory(self, spline: Spline, period: float) -> Trajectory:
        """Samples at a period [s]; the last one lies on the end."""
        duration = spline.duration
        # a remainder below a millionth of a period is rounding, not a sample of its own
        t = np.append(np.arange(int(np.ceil(duration / period - 1e-6))) * period, duration)
        q, v, a = sample(spline, t)
        tau = self.torques(q, v, a)
        flow = power_flow(tau, v, self.arm.drives, self.friction)
        charge = self._charge(spline, t)
        power = drawn_at(self.arm.bus, self.arm.regeneration, self.arm.base_power, flow.joints, charge)
        stored = charge if self.arm.bus.mode == "storage" else None
        return Trajectory(t, q, v, a, tau, flow.tau_motor, power, spline, stored)

    def _charge(self, spline: Spline, t: Array) -> Array:
        """The store's charge [J] at times t (k,), on the reported energy's own quadrature; zero without a store."""
        if self.arm.bus.mode != "storage":
            return np.zeros_like(t)
        weights, q, v, a = fine_samples(spline, REPORT_NODES)
        joints = power_flow(self.torques(q, v, a), v, self.arm.drives, self.friction).joints
        course = charges(self.arm.bus, weights * (self.arm.base_power + joints.sum(axis=1)), weights)
        return np.interp(t, np.append(0.0, weights.cumsum()), course)


@dataclass(frozen=True)
class Task(Plant):
    """A problem ready to be worked on: shared by all candidates of one request."""

    arm: Problem

    @property
    def problem(self) -> Problem:
        """The problem."""
        return self.arm

    def holding_power(self, q: Array) -> Array:
        """What the arm draws (...) [W] while its motors hold it still at q (..., nq)."""
        at = q.reshape(-1, q.shape[-1])
        still = np.zeros_like(at)
        return holding_power(self.arm, self.torques(at, still, still)).reshape(q.shape[:-1])

    def energy(self, spline: Spline) -> Energy:
        """Energy of a spline motion and of waiting after it, exact but for quadrature."""
        energy, cycle = super().energy(spline), self.problem.cycle
        if cycle is None:
            return energy
        hold = float(self.holding_power(spline.control_points[-1]))
        return energy.with_dwell(cycle.dwell(self.problem, hold, spline.duration))

    @cached_property
    def objective_parameters(self) -> Array:
        """Parameters of the problem's objective."""
        return self.parameters(**{self.problem.objective: 1.0})

    @cached_property
    def path(self) -> PathLimits | None:
        """Limits along the path but for clearance, None where there are none."""
        return self.problem.path

    def guarded(self, pairs: Indices) -> PathLimits:
        """Limits along the path, clearance of these pairs of the collision model too."""
        return PathLimits(self._placements, [*self.problem.path_limits, KeepAway(self.collisions, pairs)])

    def near(self, spline: Spline) -> Indices:
        """The pairs that come so near each other in a motion that they are worth watching."""
        return np.flatnonzero(self._gaps(spline, WATCHED).min(axis=0) < WATCHED)

    def _gaps(self, spline: Spline, within: float) -> Array:
        """Distances (CONTACT_SAMPLES, pairs) [m] along a motion, exact up to `within`."""
        q = sample(spline, np.linspace(0.0, spline.duration, CONTACT_SAMPLES))[0]
        return self.collisions.gaps(self.collisions.frames(q), within=within).distance

    @cached_property
    def collisions(self) -> CollisionModel:
        """What can hit what."""
        return collision_model(self.problem)

    @cached_property
    def _placements(self) -> Array:
        return joint_placements(self.problem.robot.model)

    def ways(self, q_start: Array, q_goal: Array, deadline: float) -> list[Array]:
        """Joint paths from q_start to q_goal (nq,) that hit nothing, found before `deadline`; looked for once."""
        key = q_start.tobytes() + q_goal.tobytes()
        if key not in self._ways:
            self._ways[key] = ways_around(self.problem, q_start, q_goal, deadline, model=self.collisions)
        return self._ways[key]

    def has_ways(self, q_start: Array, q_goal: Array) -> bool:
        """Whether ways from q_start to q_goal have been looked for and found."""
        return bool(self._ways.get(q_start.tobytes() + q_goal.tobytes()))

    @cached_property
    def _ways(self) -> dict[bytes, list[Array]]:
        return {}

    def grazes(self, q: Array) -> bool:
        """Whether q (k, nq) come so near to something that it is likely to keep them from being better."""
        return self.problem.collisions and self.collisions.least(q, GRAZING) < GRAZING

    def hit(self, spline: Spline) -> Clearance | None:
        """Where the motion comes nearest, if it is not proven to keep its margins there."""
        if not self.problem.collisions:
            return None
        gaps = self._gaps(spline, CLEAR)
        least = float(gaps.min(initial=np.inf))
        if least >= CLEAR:
            return None
        if least < 0:
            k, pair = np.unravel_index(int(gaps.argmin()), gaps.shape)
            when = spline.duration * float(k) / (CONTACT_SAMPLES - 1)
            return Clearance(least, least, self.collisions.names(int(pair)), when)
        found = clearance(self.collisions, spline)
        return found if found is not None and found.min_clearance < 0 else None

    def keeps_path(self, q: Array, v: Array) -> bool:
        """Whether samples q, v (k, nq) hold the limits along the path and, as far as samples tell, hit nothing."""
        if self.path is not None and (self.path.shares(q, v) > 1 + SHARE_TOLERANCE).any():
            return False
        if not self.problem.collisions:
            return True
        return self.collisions.least(q[:: max(len(q) // CONTACT_SAMPLES, 1)], 0.0) >= 0

    @cached_property
    def fastest_parameters(self) -> Array:
        """Parameters that make the duration the cost; a little energy beside it conditions the programme."""
        return self.parameters(electrical=1.0, time=HASTE)

    def objective_of(self, energy: Energy) -> float:
        """The part of an energy that is minimised [J]."""
        return energy.electrical.total if self.problem.objective == "electrical" else energy.mechanical.total


def spline_of(basis: bspline.Basis, points: Array, duration: float) -> Spline:
    """A motion in a spline space: its points (n, nq) there, lasting `duration` [s]."""
    return Spline(basis.degree, basis.knots * duration, basis.to_spline(points))


def sample(spline: Spline, t: Array) -> tuple[Array, Array, Array]:
    """q, v, a (k, nq) at times t (k,)."""
    curve = BSpline(spline.knots, spline.control_points, spline.degree)
    return curve(t), curve(t, 1), curve(t, 2)


def fine_samples(spline: Spline, per_panel: int) -> tuple[Array, Array, Array, Array]:
    """Quadrature weights (k,) [s] and q, v, a (k, nq) at Gauss-Legendre points of panels of a knot span at most."""
    longest = max(min(LONGEST_PANEL, spline.duration / LEAST_PANELS), spline.duration / MOST_PANELS)
    points, weights = bspline.quadrature(spline.knots, per_panel, longest)
    return weights, *sample(spline, points)


def peak_rates(spline: Spline) -> Array:
    """Greatest absolute speed, acceleration and jerk of every joint, (3, nq).

    Every knot span is expanded around its middle, so that both sides of a repeated knot count, and samples are
    raised to the vertex of the parabola through their neighbours: exact for a quintic's jerk, which is such a parabola.
    Samples are denser where the degree is higher.
    """
    terms = spline.degree + 1
    curve = BSpline(spline.knots, spline.control_points, spline.degree)
    edges = np.unique(spline.knots)
    middle, half = (edges[:-1] + edges[1:]) / 2, np.diff(edges) / 2
    # the spans as polynomials in x ∈ [-1, 1] around their middles
    series = np.stack([curve(middle, k) * half[:, None] ** k for k in range(terms)])
    x = np.linspace(-1.0, 1.0, (RATE_POINTS - 1) * (1 + 3 * max(spline.degree - bspline.DEGREE, 0)) + 1)
    powers = np.stack([x**k / math.factorial(k) for k in range(terms)], axis=1)
    peaks = []
    for d in range(1, 4):
        values = np.tensordot(powers[:, : terms - d], series[d:], axes=1) / half[:, None] ** d
        low, top, high = np.abs(values[:-2]), np.abs(values[1:-1]), np.abs(values[2:])
        bend = 2 * top - low - high
        # the vertex counts where it lies between the two outer samples
        vertex = np.where(np.abs(high - low) <= 2 * bend, (high - low) ** 2 / (8 * bend + 1e-300), 0.0)
        peaks.append(np.maximum(np.abs(values[[0, -1]]).max(axis=(0, 1)), (top + vertex).max(axis=(0, 1))))
    return np.array(peaks)


def stretch(ratios: Array) -> float:
    """The factor on the duration that brings speed, acceleration and jerk, ratios (3, nq) of their limits, to these."""
    return float((ratios.max(axis=1) ** (1 / np.arange(1, 4))).max())


def slowed(spline: Spline, factor: float) -> Spline:
    """The same path and law in `factor` times the duration."""
    return replace(spline, knots=spline.knots * factor)
