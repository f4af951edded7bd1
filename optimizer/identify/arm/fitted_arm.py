"""An arm with fitted figures: its torques and its power on rows."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from joulepath.models.robot import Array, Robot
from joulepath.optimizer.identify.arm.friction_columns import COUPLED, column
from joulepath.optimizer.identify.arm.power_model import Electrics, Motion, friction, power
from joulepath.optimizer.identify.estimates.estimate import Name
from joulepath.optimizer.identify.options import Coupling
from joulepath.optimizer.identify.rows.fit_rows import Rows

FRICTION_TERMS = ("coulomb", "viscous", "load", "curved", "offset")


@dataclass(frozen=True, eq=False)
class FittedArm:
    """Figures (nq,) of an arm: those of the friction law, `rotor_inertia`, `torque_constant`; and
    its electrics.

    `couplings` has the terms of motors that several joints share, `bodies` (10 nq,) the change of
    the links' parameters from the robot's own; None for its own links. `links` is a factor on their
    masses.
    """

    coulomb: Array
    viscous: Array
    load: Array
    curved: Array
    speed: Array
    offset: Array
    rotor_inertia: Array
    torque_constant: Array
    electrics: Electrics
    regeneration: float
    knee: float
    couplings: tuple[tuple[Coupling, dict[str, float]], ...] = ()
    bodies: Array | None = None
    links: float = 1.0

    def rigid_torque(self, rows: Rows) -> Array:
        """Torque (n, nq) [N·m] of rigid bodies."""
        rigid = rows.rigid if self.links == 1 else rows.rigid + (self.links - 1) * rows.links
        if self.bodies is None:
            return rigid
        assert rows.regressor is not None
        return np.asarray(rigid + rows.regressor @ self.bodies)

    def friction_torque(self, rows: Rows) -> Array:
        """Friction torque and offset (n, nq) [N·m]."""
        motion = self.motion(rows)
        return motion.other + friction(motion)

    def link_torque(self, rows: Rows) -> Array:
        """Torque (n, nq) [N·m] of rigid bodies and rotors."""
        return self.rigid_torque(rows) + self.rotor_inertia * rows.a

    def torque(self, rows: Rows) -> Array:
        """Motor torque (n, nq) [N·m]."""
        motion = self.motion(rows)
        return motion.rigid + motion.rotor + motion.other + friction(motion)

    def motion(self, rows: Rows) -> Motion:
        """What the power follows from."""
        v, a = rows.v, rows.a
        step, other = v / np.hypot(v, self.knee), np.tile(self.offset, (len(v), 1))
        for coupling, terms in self.couplings:
            at, by = v @ coupling.ratios, a @ coupling.ratios
            motor = sum(
                value * column(term, at, by, at, self.knee) for term, value in terms.items()
            )
            other += np.outer(motor, coupling.ratios)
        dry = self.coulomb * step
        if self.curved.any():
            dry += self.curved * np.arcsinh(v / self.speed)
        return Motion(
            v=v,
            step=step,
            rigid=self.rigid_torque(rows),
            bodies=self.links * rows.links,
            dry=dry,
            viscous=self.viscous * v,
            rotor=self.rotor_inertia * a,
            other=other,
            load=self.load,
        )

    def power(self, rows: Rows) -> tuple[Array, Array]:
        """Power (n,) [W] on the bus, and its derivatives (n, 2 + 7 nq) by the electrics."""
        return power(self.electrics, self.motion(rows), self.torque_constant, self.regeneration)


def own_arm(robot: Robot, knee: float | None = None) -> FittedArm:
    """The arm with the robot's own figures."""
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
        electrics=Electrics.plain(idle, drives.copper, drives.inverter_linear),
        regeneration=robot.electronics.regeneration,
        knee=law.knee if knee is None else knee,
    )


def with_torques(
    arm: FittedArm, names: tuple[Name, ...], value: Array, couplings: tuple[Coupling, ...]
) -> FittedArm:
    """The arm with the figures `names` at these values (p,). A joint whose viscous friction is
    among them, and is not the arm's own, has no other curved part than a fitted one."""
    parts = {
        name: getattr(arm, name).copy()
        for name in (*FRICTION_TERMS, "rotor_inertia", "torque_constant", "speed")
    }
    shared = [(each, dict[str, float]()) for each in couplings]
    fitted = {name for name, _ in names}
    for (figure, joint), found in zip(names, value.tolist(), strict=True):
        assert joint is not None
        if figure.startswith(COUPLED):
            shared[joint][1][figure.removeprefix(COUPLED)] = found
        else:
            if (
                figure == "viscous"
                and "curved" not in fitted
                and found != float(arm.viscous[joint])
            ):
                parts["curved"][joint] = 0.0
            parts[figure][joint] = found
    return replace(arm, **parts, couplings=tuple(shared))
