"""An arm with its kernel and Pinocchio model: torques, energy and samples of its motions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin

from models.robot import Array, FrictionLaw
from optimizer.energy.bus_flow import charges, drawn_at
from optimizer.energy.kernel import Kernel, kernel_for
from optimizer.energy.kernel_expressions import Parameters
from optimizer.energy.losses import breakdown, power_flow
from optimizer.kinematics.rigid_body_model import rigid_body_model
from optimizer.problem.arm import Arm
from optimizer.solution import Energy, Trajectory
from optimizer.trajectories.spline import Spline, fine_samples, sample

# smoothing that the optimiser works with: friction's reversal [rad/s] and the corners of |power| [W]
KNEE = 0.02
WIDTH = 0.5
# quadrature points per panel for reported energies, the longest panel [s], and how many there are at most
REPORT_NODES = 8


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
        return rigid_body_model(self.arm)

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
