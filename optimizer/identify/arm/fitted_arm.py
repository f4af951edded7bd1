"""Arm with fitted figures: its torques and its power for rows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from joulepath.models.robot import Array, Robot
from joulepath.optimizer.identify.arm.friction_columns import (
    LAW_TERMS,
    OF_COUPLINGS,
    column,
    deciding_term,
)
from joulepath.optimizer.identify.arm.power_model import (
    PowerParameters,
    TorqueParts,
    bus_power,
    friction_torque,
    power_of_torque,
)
from joulepath.optimizer.identify.estimates.estimate import Name
from joulepath.optimizer.identify.options import Coupling
from joulepath.optimizer.identify.rows.fit_rows import Rows


@dataclass(frozen=True, eq=False)
class LinkSensor:
    """Readings of torque sensors behind the gears beyond the rigid bodies, per joint (nq,)."""

    sensor_coulomb: Array
    """Coulomb friction behind the sensors [N·m]."""
    sensor_viscous: Array
    """Viscous friction behind the sensors [N·m·s/rad]."""
    sensor_gain: Array
    """Share by which the sensors read too much [1]."""
    offset: Array
    """Reading of the sensors without a torque [N·m]."""
    reversal: int
    """Index of the reversal distance of the Coulomb friction among the distances of the rows."""


@dataclass(frozen=True, eq=False)
class FittedArm:
    """Figures of an arm, per joint (nq,) unless stated otherwise.

    The friction law has the terms `coulomb`, `curved`, `offset` [N·m], `viscous` [N·m·s/rad],
    `load` [1]. The curved term bends at the `speed` [rad/s].
    """

    coulomb: Array
    viscous: Array
    load: Array
    curved: Array
    speed: Array
    offset: Array
    rotor_inertia: Array
    """Inertia of the rotors at the joints [kg·m²]."""
    torque_constant: Array
    """Torque constants [N·m/A]."""
    power_parameters: PowerParameters
    regeneration: float
    """Share of negative power that is regained [1]."""
    knee: float
    """Speed over which Coulomb friction reverses [rad/s]."""
    couplings: tuple[tuple[Coupling, dict[str, float]], ...] = ()
    """Motors that several joints share, with their terms."""
    link_change: Array | None = None
    """Change (10 nq,) of the links' parameters from the robot's own; None for the own links."""
    link_scale: float = 1.0
    """Factor on the masses of all links [1]."""
    sensor: LinkSensor | None = None
    """Sensors behind the gears; None where no such torques were fitted."""

    def rigid_torque(self, rows: Rows) -> Array:
        """Rigid-body torque (n, nq) [N·m]."""
        rigid = rows.rigid
        if self.link_scale != 1:
            rigid = rows.rigid + (self.link_scale - 1) * rows.link_torques
        if self.link_change is None:
            return rigid
        assert rows.regressor is not None
        return np.asarray(rigid + rows.regressor @ self.link_change)

    def friction_torque(self, rows: Rows) -> Array:
        """Friction torque and offset (n, nq) [N·m]."""
        parts = self.torque_parts(rows)
        return parts.other + friction_torque(parts)

    def link_torque(self, rows: Rows) -> Array:
        """Torque (n, nq) [N·m] of rigid bodies and rotors, without friction and offset."""
        return self.rigid_torque(rows) + self.rotor_inertia * rows.a

    def torque(self, rows: Rows) -> Array:
        """Motor torque (n, nq) [N·m]."""
        parts = self.torque_parts(rows)
        return parts.rigid + parts.rotor + parts.other + friction_torque(parts)

    def measured_torque(self, rows: Rows) -> Array:
        """Measured torque (n, nq) [N·m], of the motors or behind the gears."""
        if not rows.link_side:
            return self.torque(rows)
        rigid, sensor = self.rigid_torque(rows), self.sensor
        if sensor is None or rows.drags is None:
            return rigid
        friction = sensor.sensor_coulomb * rows.drags[:, :, sensor.reversal]
        friction = friction + sensor.sensor_viscous * rows.v
        return np.asarray((1 + sensor.sensor_gain) * rigid + friction + sensor.offset)

    def logged_torque(self, rows: Rows) -> Array:
        """Logged torques (n, nq) [N·m] of motors or links, NaN if not logged."""
        return rows.effort * self.torque_constant if rows.current else rows.effort

    def motor_torque(self, rows: Rows) -> Array:
        """Logged motor torques (n, nq) [N·m], NaN if not logged or measured behind the gears."""
        return np.full_like(rows.v, np.nan) if rows.link_side else self.logged_torque(rows)

    def measured_power(self, rows: Rows) -> Array:
        """Power (n,) [W] on the bus: as logged, or else by the logged torques of the motors and the
        arm's idle power and losses. NaN without either."""
        by_torque = power_of_torque(
            self.power_parameters,
            rows.v,
            self.motor_torque(rows),
            self.torque_constant,
            self.regeneration,
        )
        return np.where(np.isfinite(rows.power), rows.power, by_torque)

    def torque_parts(self, rows: Rows) -> TorqueParts:
        """Torque parts for the computation of the power."""
        v, a = rows.v, rows.a
        smooth_sign = v / np.hypot(v, self.knee)
        other = np.tile(self.offset, (len(v), 1))
        for coupling, terms in self.couplings:
            motor_v, motor_a = v @ coupling.ratios, a @ coupling.ratios
            motor = sum(
                value * column(term, motor_v, motor_a, motor_v, self.knee)
                for term, value in terms.items()
            )
            other += np.outer(motor, coupling.ratios)
        dry = self.coulomb * smooth_sign
        if self.curved.any():
            dry += self.curved * np.arcsinh(v / self.speed)
        return TorqueParts(
            v=v,
            smooth_sign=smooth_sign,
            rigid=self.rigid_torque(rows),
            links=self.link_scale * rows.link_torques,
            dry=dry,
            viscous=self.viscous * v,
            rotor=self.rotor_inertia * a,
            other=other,
            load=self.load,
        )

    def power(self, rows: Rows) -> tuple[Array, Array]:
        """Power (n,) [W] on the bus, and its derivatives (n, 2 + 7 nq) by the power parameters."""
        return bus_power(
            self.power_parameters,
            self.torque_parts(rows),
            self.torque_constant,
            self.regeneration,
        )

    def energy(self, rows: Rows) -> float:
        """Energy [J] of the rows on the bus."""
        return float(rows.weight @ self.power(rows)[0])


def own_arm(robot: Robot, knee: float | None = None) -> FittedArm:
    """The arm with the robot's own figures; `knee` [rad/s] replaces the robot's own."""
    law, drives, nq = robot.friction, robot.drives, robot.nq
    idle = robot.electronics.idle_power + float(drives.inverter_constant.sum())
    return FittedArm(
        coulomb=law.coulomb,
        viscous=law.viscous,
        load=np.zeros(nq) if law.load is None else law.load,
        curved=law.curved,
        speed=law.speed,
        offset=np.zeros(nq),
        rotor_inertia=drives.rotor_inertia,
        torque_constant=drives.torque_constant,
        power_parameters=PowerParameters.nominal(
            idle, drives.copper + drives.inverter_quadratic, drives.inverter_linear
        ),
        regeneration=robot.electronics.regeneration,
        knee=law.knee if knee is None else knee,
    )


def with_torques(
    arm: FittedArm, reasons: Mapping[Name, str], value: Array, couplings: tuple[Coupling, ...]
) -> FittedArm:
    """The arm with some figures replaced.

    A joint with a fitted friction law loses all terms of its own law without a new figure.

    Args:
        arm: the arm.
        reasons: names of the figures, with the reason for keeping the robot's own value, or an
            empty text.
        value: values (p,) of the figures.
        couplings: motors shared by several joints.
    """
    parts = {
        name: getattr(arm, name).copy()
        for name in (*LAW_TERMS, "offset", "rotor_inertia", "torque_constant", "speed")
    }
    shared = [(each, dict[str, float]()) for each in couplings]
    fitted = {name for name, _ in reasons}
    deciding = deciding_term(fitted)
    for ((figure, joint), reason), found in zip(reasons.items(), value.tolist(), strict=True):
        assert joint is not None
        if figure in OF_COUPLINGS:
            shared[joint][1][OF_COUPLINGS[figure]] = found
            continue
        parts[figure][joint] = found
        if figure == deciding and not reason:
            for term in set(LAW_TERMS) - fitted:
                parts[term][joint] = 0.0
    return replace(arm, **parts, couplings=tuple(shared))
