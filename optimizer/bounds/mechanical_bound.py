"""Lower bound on the mechanical work of all motions between two configurations, from the arm's
energy.

Let E = K + U be kinetic and potential energy of rigid bodies and rotors, and W = ∫ Σ_j |tau_j v_j|
dt the mechanical work. The torques tau are those of rigid bodies and rotors, without friction, so
dE/dt = Σ_j tau_j v_j (U and K do not depend on time) and

    W ≥ ∫ |dE/dt| dt,                                                                       (1)

the total variation of E between two rests, E(0) = U_0 and E(T) = U_1.

**Range.** If E reaches h ≥ max(U_0, U_1) and l ≤ min(U_0, U_1), it reaches one of them first:

    W ≥ h - l + min((h - U_0) + (U_1 - l), (U_0 - l) + (h - U_1)).                          (2)

Without further knowledge, h = max(U_0, U_1) and l = min(U_0, U_1) give |U_1 - U_0|.

**Barrier.** Joints with axes parallel to gravity turn the arm about the vertical and do not change
U. Let k be the first other joint. With the links beyond k lumped at the origin of joint k + 1, the
potential energy is a function of q_k alone, u(q_k) = constant + a cos q_k + b sin q_k. The true
energy differs by at most R = Σ_i m_i |g| r_i over the links i beyond k, where r_i is the length of
the chain from this origin to the centre of mass of link i, at least their distance. On the way q_k
takes every value between its ends, so E ≥ U ≥ u - R at the greatest u: h = max u - R. At the least
u, U ≤ u + R, so l = min u + R + K_max with the greatest kinetic energy K_max under the limits on
speed and acceleration: the centre of mass of each link is at most as fast as Σ_j |v_j| times its
greatest distance from the axis of joint j, and the link turns at most at Σ_j |v_j|.

**Travel.** In weightlessness U is constant, and from (2) K ≤ W / 2 at all times. The mass matrix is
the sum of the rotors' D = diag(rotor inertia) and the links', which is positive semidefinite. With
|v|_D² = vᵀ D v and A = |a_max|_D, as v starts and ends at zero,

    |q_1 - q_0|_D ≤ ∫ |v|_D dt ≤ ∫ min(s, A min(t, T - t)) dt = s T - s² / A,  s = sqrt(W).   (3)

The least s for which (3) holds gives W ≥ s². A motion that takes less than T and then rests until T
does the same work: the bound for the longest allowed duration holds for all. Under gravity, the arm
can gain speed by falling. A similar bound then never exceeded (2) for 600 pairs of random
configurations of a UR5e, a UR20 and a Panda, so it is left out.

The bound is not tight for a motion in which one joint takes up the energy that gravity gives to
another, because (1) adds up the joints before the absolute value, nor for a motion that could swing
through a potential well and does not.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array
from joulepath.optimizer.prepared_problem import PreparedProblem
from joulepath.optimizer.problem.problem import DURATIONS


@dataclass(frozen=True)
class MechanicalSettings:
    """Settings of the mechanical bound."""

    parallel: float = 1e-8
    """Sine of the angle below which an axis is parallel to gravity: rounding of a placement."""
    rounding: float = 1e-7
    """Error of a potential energy, relative to weight times length of the arm.

    It covers rounding and the angle of `parallel` axes.
    """


MECHANICAL = MechanicalSettings()


@dataclass(frozen=True)
class EnergyRange:
    """Bounds on the kinetic and potential energy of an arm; the symbols are those of the module."""

    prepared: PreparedProblem

    @property
    def model(self) -> pin.Model:
        """Pinocchio model of the arm, payload and gravity included."""
        return self.prepared.model

    @cached_property
    def gravity(self) -> Array:
        """Gravity (3,) [m/s²] in the base frame."""
        return np.array(self.model.gravity.linear)

    @cached_property
    def masses(self) -> Array:
        """Masses (nq,) [kg] of the links, the payload with the last."""
        return np.array([body.mass for body in self.model.inertias[1:]])

    @cached_property
    def lengths(self) -> Array:
        """Greatest distance of link i's centre of mass from the axis of joint j, at [j, i], (nq,
        nq) [m].

        It is zero for i < j.
        """
        placements, bodies = self.model.jointPlacements, self.model.inertias
        n = self.model.nq
        result = np.zeros((n, n))
        for j in range(n):
            # link j turns about its own axis; later links may turn about any axis
            along = 0.0
            for i in range(j, n):
                offset = np.array(bodies[i + 1].lever)
                result[j, i] = along + float(np.linalg.norm(offset[:2] if i == j else offset))
                if i + 1 < n:
                    step = np.array(placements[i + 2].translation)
                    along += float(np.linalg.norm(step[:2] if i == j else step))
        return result

    @cached_property
    def leading(self) -> int | None:
        """Index k of the first joint that changes the potential energy; None if there is none."""
        strength, R = float(np.linalg.norm(self.gravity)), np.eye(3)
        for k in range(self.model.nq):
            R = R @ np.array(self.model.jointPlacements[k + 1].rotation)
            if np.linalg.norm(np.cross(R[:, 2], self.gravity)) > MECHANICAL.parallel * strength:
                return k
        return None

    @cached_property
    def lumped(self) -> tuple[Array, float, float]:
        """The wave (a, b) [J], the constant and R [J]: |U(q) - constant - a cos q_k - b sin q_k| ≤
        R.
        """
        k, placements, bodies = self.leading, self.model.jointPlacements, self.model.inertias
        assert k is not None
        T, constant = pin.SE3.Identity(), 0.0
        for i in range(k):
            T = T * placements[i + 1]
            constant -= bodies[i + 1].mass * float(self.gravity @ T.act(bodies[i + 1].lever))
        T = T * placements[k + 1]
        distal = float(self.masses[k + 1 :].sum())
        moment = bodies[k + 1].mass * np.array(bodies[k + 1].lever)
        if distal:
            moment = moment + distal * np.array(placements[k + 2].translation)
        g = np.array(T.rotation).T @ self.gravity
        constant -= float(
            (bodies[k + 1].mass + distal) * (self.gravity @ T.translation) + g[2] * moment[2]
        )
        wave = -np.array([g[0] * moment[0] + g[1] * moment[1], g[1] * moment[0] - g[0] * moment[1]])
        return wave, constant, float(np.linalg.norm(self.gravity)) * self._beyond(k)

    def _beyond(self, k: int) -> float:
        """Σ m_i r_i [kg·m] over the links beyond joint k."""
        placements, bodies = self.model.jointPlacements, self.model.inertias
        total, along = 0.0, 0.0
        for i in range(k + 1, self.model.nq):
            if i > k + 1:
                along += float(np.linalg.norm(placements[i + 1].translation))
            total += bodies[i + 1].mass * (along + float(np.linalg.norm(bodies[i + 1].lever)))
        return total

    @cached_property
    def rounding(self) -> float:
        """Greatest error of a potential energy [J], which is subtracted from the bound."""
        return (
            MECHANICAL.rounding
            * float(np.linalg.norm(self.gravity))
            * float(self.lengths.sum(axis=0) @ self.masses)
        )

    def most_kinetic(self, duration: Array) -> Array:
        """Greatest kinetic energies (P,) [J] of motions from rest to rest in durations (P,) [s]."""
        limits = self.prepared.problem.arm.active_limits
        v = np.minimum(limits.v_max, limits.a_max * duration[:, None] / 2)
        spin = np.array(
            [
                float(np.linalg.eigvalsh(np.array(body.inertia))[-1])
                for body in self.model.inertias[1:]
            ]
        )
        rotors = v**2 @ self.prepared.problem.arm.drives.rotor_inertia
        links = (v @ self.lengths) ** 2 @ self.masses + np.cumsum(v, axis=1) ** 2 @ spin
        return np.asarray((rotors + links) / 2)

    def work_of_travel(self, displacement: Array, duration: Array) -> Array:
        """Least work (P,) [J] by (3) of displacements (P, nq) [rad] in durations (P,) [s]."""
        rotors = self.prepared.problem.arm.drives.rotor_inertia
        needed = np.sqrt(displacement**2 @ rotors)
        most = float(np.sqrt(self.prepared.problem.arm.active_limits.a_max**2 @ rotors))
        if most == 0:
            # without rotor inertia, (3) says nothing
            return np.zeros(len(displacement))
        spare = np.sqrt(np.maximum(duration**2 - 4 * needed / most, 0.0))
        # the root A / 2 (T - spare) without a difference of nearly equal numbers
        return np.asarray((2 * needed / (duration + spare)) ** 2)


@dataclass(frozen=True)
class Swing:
    """Highest and lowest potential energies that motions have to reach, shape (P,) [J]."""

    arm: EnergyRange
    displacement: Array
    """Displacements, shape (P, nq) [rad]."""
    ends: Array
    """Potential energies of start and goal, shape (P, 2) [J]."""
    top: Array
    """Energy that every motion reaches at least, h."""
    bottom: Array
    """Energy that every motion reaches at most, l without the kinetic energy K_max."""

    @classmethod
    def of(cls, arm: EnergyRange, q_start: Array, q_goal: Array, ends: Array) -> Swing:
        """The swing of motions from q_start to q_goal (P, nq) [rad]."""
        low, high = ends.min(axis=1), ends.max(axis=1)
        if arm.leading is None:
            return cls(arm, q_goal - q_start, ends, high, low)
        wave, constant, beyond = arm.lumped
        crest, trough = _extremes(wave, q_start[:, arm.leading], q_goal[:, arm.leading])
        top = np.maximum(high, constant + crest - beyond)
        return cls(arm, q_goal - q_start, ends, top, constant + trough + beyond)

    def least_work(self, duration: Array) -> Array:
        """Least work (P,) [J] by (2), or (3) in weightlessness, in at most durations (P,) [s]."""
        return np.maximum(self._work(duration) - 4 * self.arm.rounding, 0.0)

    def _work(self, duration: Array) -> Array:
        if self.arm.leading is None:
            return self.arm.work_of_travel(self.displacement, duration)
        (first, last), low = self.ends.T, self.ends.min(axis=1)
        bottom = np.minimum(low, self.bottom + self.arm.most_kinetic(duration))
        return np.asarray(
            self.top
            - bottom
            + np.minimum(self.top - first + last - bottom, first - bottom + self.top - last)
        )


def mechanical_bounds(
    prepared: PreparedProblem, q_start: Array, q_goal: Array, potentials: Array
) -> Array:
    """Lower bounds on the mechanical work of motions, shape (P,) [J].

    Args:
        prepared: problem of the motions.
        q_start: start configurations, shape (P, nq) [rad].
        q_goal: goal configurations, shape (P, nq) [rad].
        potentials: potential energies of start and goal, shape (P, 2) [J].
    """
    arm, problem = EnergyRange(prepared), prepared.problem
    if problem.arm.robot.coupling.follows:
        # the lengths of `EnergyRange` are those of a chain whose joints follow no other
        return np.abs(np.diff(potentials, axis=1)[:, 0])
    longest = np.full(
        len(q_start), DURATIONS.longest if problem.duration_max is None else problem.duration_max
    )
    return Swing.of(arm, q_start, q_goal, potentials).least_work(longest)


def _extremes(wave: Array, one: Array, other: Array) -> tuple[Array, Array]:
    """Extremes of wave[0] cos q + wave[1] sin q over angles between two angles (P,) [rad].

    Returns:
        Greatest and least values (P,).
    """
    low, high = np.minimum(one, other), np.maximum(one, other)
    ends = np.stack([wave[0] * np.cos(q) + wave[1] * np.sin(q) for q in (low, high)])
    size, phase = float(np.hypot(*wave)), float(np.arctan2(wave[1], wave[0]))

    def holds(angle: float) -> Array:
        return np.asarray(
            np.floor((high - angle) / (2 * np.pi)) >= np.ceil((low - angle) / (2 * np.pi))
        )

    crest = np.where(holds(phase), size, ends.max(axis=0))
    return crest, np.where(holds(phase + np.pi), -size, ends.min(axis=0))
