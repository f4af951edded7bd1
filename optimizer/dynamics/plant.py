"""An arm with its kernel and Pinocchio model: torques, energy and samples of its motions."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Generic, TypeVar

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array, FrictionLaw
from joulepath.optimizer.dynamics.bus_flow import charges, drawn_at
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

Found = TypeVar("Found")
# quadrature weights (k,) [s], and q, v, a, torques and friction's torques (k, nq) of a motion
ReportSamples = tuple[Array, Array, Array, Array, Array, Array]

# smoothing in the optimiser's cost: the reversal of friction [rad/s], the corner of the load that
# friction grows with as a share of the robot's torque limit, and the corners of |power| [W]
KNEE = 0.02
BEND = 0.01
WIDTH = 0.5
# widths [W] of the solves that follow, one from the other, where every joint has a corner of its
# own
SHARPER_WIDTHS = (0.1, 0.02)
# quadrature points per panel for reported energies
REPORT_NODES = 8
# a last sample nearer to the one before than this fraction of a period is rounding
LEAST_STEP = 1e-6


def has_corners(objective: str, arm: Arm) -> bool:
    """Whether every joint's power has a corner of its own in the objective: mechanical work, and an
    isolated bus.
    """
    return objective == "mechanical" or (objective == "electrical" and arm.bus.mode == "isolated")


@dataclass(eq=False)
class _OfTheLast(Generic[Found]):
    """What was computed of the last motion: a motion is valued several times, and then reported."""

    known: tuple[Spline, Found] | None = None

    def of(self, spline: Spline, compute: Callable[[Spline], Found]) -> Found:
        """What `compute` finds of the motion, which may be known."""
        # read once: other threads may replace it
        known = self.known
        if known is None or known[0] is not spline:
            known = self.known = spline, compute(spline)
        return known[1]


@dataclass(frozen=True)
class Plant:
    """An arm with its kernel and Pinocchio model. Any number of threads may use one plant."""

    arm: Arm

    @cached_property
    def kernel(self) -> Kernel:
        """The robot's compiled functions."""
        return kernel_for(self.arm.robot)

    @cached_property
    def model(self) -> pin.Model:
        """Pinocchio model of the arm, payload and gravity included."""
        return rigid_body_model(self.arm)

    @cached_property
    def _data(self) -> pin.Data:
        # Threads may share it for functions that return a number: Pinocchio's calls hold Python's
        # global lock, so that no other thread writes into the data before the number is returned.
        return self.model.createData()

    def parameters(
        self,
        electrical: float = 0.0,
        mechanical: float = 0.0,
        time: float = 0.0,
        regeneration: float | None = None,
        width: float = WIDTH,
    ) -> Array:
        """Packed kernel parameters: the arm's, and weights of electrical and mechanical energy [1]
        and duration [W].

        `regeneration` [1] is the value of a joule of surplus, by default what the arm's supply
        takes back. The cost of an instant cannot depend on a charge: with an energy storage, this
        value stands for it. `width` [W] smooths the corners of the cost.
        """
        return self._parameters(electrical, mechanical, time, regeneration, width).pack()

    @cached_property
    def frictionless_parameters(self) -> Array:
        """Packed kernel parameters of a cost of zero, whose limited torque is that of rigid bodies
        and rotors.
        """
        parts, none = self._parameters(0.0, 0.0, 0.0, None, WIDTH), np.zeros(self.arm.robot.nq)
        return replace(
            parts, coulomb=none, curved=none, viscous=none, load=none, link_side=0.0
        ).pack()

    def _parameters(
        self,
        electrical: float,
        mechanical: float,
        time: float,
        regeneration: float | None,
        width: float,
    ) -> Parameters:
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
            bend=BEND * self.arm.robot.limits.tau_max,
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
            knee=KNEE,
            width=width,
        )

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

    def limited_torques(self, q: Array, v: Array, a: Array) -> Array:
        """The torques (k, nq) [N·m] that the limit is for: see `limited_torque`."""
        return limited_torque(self.arm, self.torques(q, v, a), v, a)

    def motor_torques(self, q: Array, v: Array, a: Array) -> Array:
        """Motor torques at the joint (k, nq) [N·m]: rigid body, rotor and friction."""
        return np.asarray(
            power_flow(self.torques(q, v, a), v, a, self.arm.drives, self.friction).tau_motor
        )

    def potential(self, q: Array) -> float:
        """Potential energy [J] of arm and payload."""
        return float(pin.computePotentialEnergy(self.model, self._data, q))

    def energy(self, spline: Spline) -> Energy:
        """Energy [J] of a spline motion by Gauss-Legendre quadrature, with the exact, unsmoothed
        formulas.
        """
        return self._last_energy.of(spline, self._computed_energy)

    def _computed_energy(self, spline: Spline) -> Energy:
        weights, _, v, a, tau, lost = self.report_samples(spline)
        ends = spline.control_points
        change = self.potential(ends[-1]) - self.potential(ends[0])
        return breakdown(weights, v, a, tau, change, self.arm, lost=lost)

    def sensitivity(self, spline: Spline) -> Sensitivity:
        """How the electrical energy of a spline motion hangs on the arm's figures."""
        weights, q, v, a, tau, lost = self.report_samples(spline)
        return energy_sensitivity(weights, q, v, a, tau, self.arm, arm_spread(self.arm), lost)

    def report_samples(self, spline: Spline) -> ReportSamples:
        """Samples of a motion at the Gauss-Legendre points of its reported energy."""
        return self._last_samples.of(spline, self._computed_samples)

    def _computed_samples(self, spline: Spline) -> ReportSamples:
        weights, q, v, a = fine_samples(spline, REPORT_NODES)
        tau = self.torques(q, v, a)
        return weights, q, v, a, tau, friction_torque(self.friction, self.arm.drives, tau, v, a)

    def net_demand(self, spline: Spline) -> tuple[Array, Array]:
        """Net demand (k,) [J] on the bus in the intervals of a motion's reported energy, and their
        lengths (k,) [s].
        """
        weights, _, v, _, tau, lost = self.report_samples(spline)
        joints = flow_with(lost, tau, v, self.arm.drives).joints
        return weights * (self.arm.base_power + joints.sum(axis=1)), weights

    @cached_property
    def _last_energy(self) -> _OfTheLast[Energy]:
        return _OfTheLast()

    @cached_property
    def _last_samples(self) -> _OfTheLast[ReportSamples]:
        return _OfTheLast()

    def trajectory(self, spline: Spline, period: float) -> Trajectory:
        """Samples of a spline motion every `period` [s]; the last one lies on the end."""
        duration = spline.duration
        t = np.append(np.arange(int(np.ceil(duration / period - LEAST_STEP))) * period, duration)
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

        By the quadrature of the reported energy, linear in between.
        """
        if self.arm.bus.mode != "storage":
            return np.zeros_like(t)
        net, lengths = self.net_demand(spline)
        charge = charges(self.arm.bus, net, lengths)
        return np.interp(t, np.append(0.0, lengths.cumsum()), charge)
