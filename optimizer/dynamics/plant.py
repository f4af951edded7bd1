"""An arm with its kernel and Pinocchio model: torques, energy and samples of its motions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Generic, TypeVar

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array, FrictionLaw
from joulepath.optimizer.dynamics.bus_flow import charges, drawn_at
from joulepath.optimizer.dynamics.dwell import holding_power
from joulepath.optimizer.dynamics.interval import arm_spread
from joulepath.optimizer.dynamics.kernel import Kernel, kernel_for
from joulepath.optimizer.dynamics.kernel_expressions import Parameters
from joulepath.optimizer.dynamics.limited_torque import limited_torque
from joulepath.optimizer.dynamics.losses import breakdown, flow_with, friction_torque, power_flow
from joulepath.optimizer.dynamics.sensitivity import energy_sensitivity
from joulepath.optimizer.kinematics.rigid_body_model import rigid_body_model
from joulepath.optimizer.motion.spline import Spline, fine_samples, sample
from joulepath.optimizer.problem.arm import Arm
from joulepath.optimizer.result.energy import Energy, Sensitivity
from joulepath.optimizer.result.solution import Trajectory

Result = TypeVar("Result")
ReportSamples = tuple[Array, Array, Array, Array, Array, Array]
"""Quadrature weights (k,) [s], then q, v, a, torques and friction torques (k, nq) of a motion."""


@dataclass(frozen=True)
class SmoothingSettings:
    """Smoothing of the optimiser's cost; reports and certificates use the exact formulas."""

    knee: float = 0.02
    """Speed range of the reversal of friction [rad/s]."""
    load_share: float = 0.01
    """Range of the corner of load-dependent friction, relative to the torque limit [1]."""
    power_width: float = 0.5
    """Range of the corners of |power| [W]."""
    sharper_power_widths: tuple[float, float] = (0.1, 0.02)
    """Ranges [W] of two subsequent solves, each from the previous solution, if every joint's power
    has a corner of its own.
    """


@dataclass(frozen=True)
class ReportSettings:
    """Sampling of reported motions."""

    nodes_per_panel: int = 8
    """Quadrature points per panel of the reported energy."""
    smallest_step: float = 1e-6
    """Smallest distance of the last sample from the one before, in periods [1]; a smaller distance
    is rounding.
    """


SMOOTHING = SmoothingSettings()
REPORT = ReportSettings()


def has_corners(objective: str, arm: Arm) -> bool:
    """Whether the power of every joint has a corner of its own in the objective: for mechanical
    work, and on an isolated bus.
    """
    return objective == "mechanical" or (objective == "electrical" and arm.bus.mode == "isolated")


@dataclass(eq=False)
class _LastResult(Generic[Result]):
    """Result for the last motion: a motion is evaluated several times and then reported."""

    known: tuple[Spline, Result] | None = None

    def of(self, spline: Spline, compute: Callable[[Spline], Result]) -> Result:
        """Result of `compute` for the motion, computed only if the motion differs from the last
        one.
        """
        # Read once, since other threads may replace it.
        known = self.known
        if known is None or known[0] is not spline:
            known = self.known = spline, compute(spline)
        return known[1]


@dataclass(frozen=True)
class Plant:
    """Arm with its kernel and Pinocchio model. Any number of threads may use one plant."""

    arm: Arm

    @cached_property
    def kernel(self) -> Kernel:
        """Compiled functions of the robot."""
        return kernel_for(self.arm.robot)

    @cached_property
    def model(self) -> pin.Model:
        """Pinocchio model of the arm, including payload and gravity."""
        return rigid_body_model(self.arm)

    @cached_property
    def _data(self) -> pin.Data:
        # Threads may share it for functions with a scalar result: Pinocchio's calls hold Python's
        # global lock, so no other thread writes into the data before the scalar is returned.
        return self.model.createData()

    def parameters(
        self,
        electrical: float = 0.0,
        mechanical: float = 0.0,
        time: float = 0.0,
        regeneration: float | None = None,
        width: float = SMOOTHING.power_width,
        friction_share: float = 1.0,
    ) -> Array:
        """Packed kernel parameters: the figures of the arm, and the weights of the cost.

        Args:
            electrical: weight of the electrical energy [1].
            mechanical: weight of the mechanical energy [1].
            time: weight of the duration [W].
            regeneration: value of a joule of surplus [1], by default the share that the arm's
                supply takes back. It stands for an energy storage, since the cost of an instant
                cannot depend on a charge.
            width: smoothing width of the corners of the cost [W].
            friction_share: share of `SMOOTHING` over which the corners of friction are smoothed
                [1].
        """
        payload, friction, drives, nq = (
            self.arm.payload,
            self.arm.friction_law,
            self.arm.drives,
            self.arm.robot.nq,
        )
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
            load=np.zeros(nq) if friction.load is None else friction.load,
            bend=friction_share * SMOOTHING.load_share * self.arm.robot.limits.tau_max,
            torque_constant=drives.torque_constant,
            copper=drives.copper,
            inverter_constant=drives.inverter_constant,
            inverter_linear=drives.inverter_linear,
            inverter_quadratic=drives.inverter_quadratic,
            link_side=float(self.arm.robot.torque_side == "link"),
            base_power=self.arm.base_power,
            regeneration=self.arm.regeneration if regeneration is None else regeneration,
            isolated=float(self.arm.bus.mode == "isolated"),
            link_mass_scale=self.arm.link_mass_scale,
            electrical=electrical,
            mechanical=mechanical,
            time=time,
            knee=friction_share * SMOOTHING.knee,
            width=width,
        ).pack()

    @cached_property
    def electrical_parameters(self) -> Array:
        """Packed kernel parameters with the electrical energy as the cost."""
        return self.parameters(electrical=1.0)

    @property
    def friction(self) -> FrictionLaw:
        """Friction law in use."""
        return self.arm.friction_law

    def torques(self, q: Array, v: Array, a: Array) -> Array:
        """Rigid-body and rotor torques (k, nq) [N·m]."""
        return self.kernel.torque(q, v, a, self.electrical_parameters)

    def limited_torques(self, q: Array, v: Array, a: Array) -> Array:
        """Torques (k, nq) [N·m] to which the torque limit applies, see `limited_torque`."""
        return limited_torque(self.arm, self.torques(q, v, a), v, a)

    def motor_torques(self, q: Array, v: Array, a: Array) -> Array:
        """Motor torques at the joints (k, nq) [N·m]: rigid bodies, rotors and friction."""
        return np.asarray(
            power_flow(self.torques(q, v, a), v, a, self.arm.drives, self.friction).tau_motor
        )

    def holding_torques(self, q: Array) -> Array:
        """Torques (k, nq) [N·m] that hold the arm still at q (k, nq) [rad]."""
        still = np.zeros_like(q)
        return self.torques(q, still, still)

    def holding_power(self, q: Array) -> Array:
        """Power (...) [W] drawn while the motors hold the arm still at q (..., nq) [rad]."""
        held = self.holding_torques(q.reshape(-1, q.shape[-1]))
        return holding_power(self.arm, held).reshape(q.shape[:-1])

    def potential(self, q: Array) -> float:
        """Potential energy [J] of arm and payload."""
        q = self.arm.robot.coupling.positions(q)
        return float(pin.computePotentialEnergy(self.model, self._data, q))

    def energy(self, spline: Spline) -> Energy:
        """Energy [J] of a spline motion by Gauss-Legendre quadrature of the exact, unsmoothed
        formulas.
        """
        return self._last_energy.of(spline, self._computed_energy)

    def _computed_energy(self, spline: Spline) -> Energy:
        weights, _, v, a, tau, tau_friction = self.report_samples(spline)
        ends = spline.control_points
        change = self.potential(ends[-1]) - self.potential(ends[0])
        return breakdown(weights, v, a, tau, change, self.arm, tau_friction=tau_friction)

    def sensitivity(self, spline: Spline) -> Sensitivity:
        """Sensitivity of the electrical energy of a spline motion to the figures of the arm."""
        weights, q, v, a, tau, tau_friction = self.report_samples(spline)
        return energy_sensitivity(
            weights, q, v, a, tau, self.arm, arm_spread(self.arm), tau_friction
        )

    def report_samples(self, spline: Spline) -> ReportSamples:
        """Samples of a motion at the Gauss-Legendre points of its reported energy."""
        return self._last_samples.of(spline, self._computed_samples)

    def _computed_samples(self, spline: Spline) -> ReportSamples:
        weights, q, v, a = fine_samples(spline, REPORT.nodes_per_panel)
        tau = self.torques(q, v, a)
        return weights, q, v, a, tau, friction_torque(self.friction, self.arm.drives, tau, v, a)

    def net_demand(self, spline: Spline) -> tuple[Array, Array]:
        """Net demand (k,) [J] on the bus in the intervals of the reported energy, and their lengths
        (k,) [s].
        """
        weights, _, v, _, tau, tau_friction = self.report_samples(spline)
        joints = flow_with(tau_friction, tau, v, self.arm.drives).joints
        return weights * (self.arm.base_power + joints.sum(axis=1)), weights

    @cached_property
    def _last_energy(self) -> _LastResult[Energy]:
        return _LastResult()

    @cached_property
    def _last_samples(self) -> _LastResult[ReportSamples]:
        return _LastResult()

    def trajectory(self, spline: Spline, period: float) -> Trajectory:
        """Samples of a spline motion every `period` [s]; the last sample lies on the end."""
        steps = np.arange(int(np.ceil(spline.duration / period - REPORT.smallest_step)))
        return self.samples(spline, np.append(steps * period, spline.duration))

    def samples(self, spline: Spline, t: Array) -> Trajectory:
        """Samples of a spline motion at times t (k,) [s]."""
        q, v, a = sample(spline, t)
        tau = self.torques(q, v, a)
        flow = power_flow(tau, v, a, self.arm.drives, self.friction)
        charge = self._charge(spline, t)
        power = drawn_at(
            self.arm.bus, self.arm.regeneration, self.arm.base_power, flow.joints, charge
        )
        shown = charge if self.arm.bus.mode == "storage" else None
        return Trajectory(t, q, v, a, tau, flow.tau_motor, power, shown, spline=spline)

    def _charge(self, spline: Spline, t: Array) -> Array:
        """Charge (k,) [J] of the energy storage at times t (k,) [s]; zero without storage.

        The quadrature of the reported energy gives the charge, linear between its points.
        """
        if self.arm.bus.mode != "storage":
            return np.zeros_like(t)
        net, lengths = self.net_demand(spline)
        charge = charges(self.arm.bus, net, lengths)
        return np.interp(t, np.append(0.0, lengths.cumsum()), charge)
