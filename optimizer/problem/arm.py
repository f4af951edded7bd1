"""An arm in its cell: robot, tool, payload, mounting, limits, friction, drives, bus. Validated on
construction.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from joulepath.models.robot import Array, Drives, FrictionLaw, Limits, Robot
from joulepath.optimizer.exceptions import InvalidProblem, OutsideLimits
from joulepath.optimizer.problem.arrays import frozen, per_joint, rigid_transform
from joulepath.optimizer.problem.bus import Bus
from joulepath.optimizer.problem.names import first_among
from joulepath.optimizer.problem.scene import Attachment, Scene
from joulepath.optimizer.problem.tool_cone import ToolCone

# least speed limit [m/s] of a point: below it, motions would last longer than any answer may
LEAST_SPEED = 1e-3
LIMIT_NAMES = {"velocity": "v_max", "acceleration": "a_max", "jerk": "j_max", "torque": "tau_max"}
# most capsules of a tool
MOST_PARTS = 16
# names of the bodies at the flange
TOOL, PAYLOAD = "tool", "payload"

# range of the factors on mass and inertia of a link: beyond it, the arm is no variant of the robot
LINK_MASS_SCALES = (0.1, 10.0)
# coefficients of the inverter's loss, and their greatest value [W, W/A, W/A²], far above that of
# any inverter
INVERTER_PARTS = ("constant", "linear", "quadratic")
INVERTER_MOST = 1e3


@dataclass(frozen=True)
class Payload:
    """A body fixed to the flange: mass [kg], com (3,) [m] in the flange frame, inertia (3, 3)
    [kg·m²] about the com.

    `shape` is its geometry, which is used for collisions only. Raises InvalidProblem, with the
    field named, for a mass or an inertia that no body has.
    """

    mass: float = 0.0
    com: Array = field(default_factory=lambda: np.zeros(3))
    inertia: Array = field(default_factory=lambda: np.zeros((3, 3)))
    shape: Attachment | None = None

    def __post_init__(self) -> None:
        if not (np.isfinite(self.mass) and self.mass >= 0):
            raise InvalidProblem(
                "payload.mass", "payload.mass must be a finite number of kg, zero or more."
            )
        # Pinocchio takes no number of numpy's other types
        object.__setattr__(self, "mass", float(self.mass))
        object.__setattr__(self, "com", frozen(self.com, (3,), "payload.com"))
        object.__setattr__(self, "inertia", frozen(self.inertia, (3, 3), "payload.inertia"))
        if np.abs(self.inertia - self.inertia.T).max() > 1e-9 * np.abs(self.inertia).max():
            raise InvalidProblem("payload.inertia", "payload.inertia must be symmetric.")
        principal = np.linalg.eigvalsh(self.inertia)
        slack = 1e-9 * max(1.0, float(principal[-1]))
        if principal[0] < -slack or principal[2] > principal[0] + principal[1] + slack:
            raise InvalidProblem(
                "payload.inertia",
                "payload.inertia belongs to no body: its principal moments must not be negative, "
                "and none may exceed "
                "the sum of the other two.",
            )

    @property
    def content(self) -> tuple[float, bytes, bytes, int]:
        """The same for the same body. A shape is the same as itself alone."""
        return self.mass, self.com.tobytes(), self.inertia.tobytes(), id(self.shape)


@dataclass(frozen=True)
class Inverter:
    """Coefficients of the inverters' loss constant + linear·|i| + quadratic·i² [W, W/A, W/A²].

    Each is one number for all joints, or one per joint (nq,). None keeps the robot's figure.
    """

    constant: float | Array | None = None
    linear: float | Array | None = None
    quadratic: float | Array | None = None


@dataclass(frozen=True, kw_only=True)
class Arm:
    """A robot with its tool, payload, mounting, surroundings and limits.

    `T_flange_tcp` (4, 4) is the pose of the TCP in the flange frame, `gravity` (3,) [m/s²] is in
    the base frame. `limits` replaces the robot's limits and may only tighten them. `friction` names
    one of the robot's friction laws (None: its default). `inverter` replaces coefficients of the
    robot's inverters, and `bus` says where surplus power goes. `link_mass_scale` (nq,), or one
    number, multiplies mass and inertia of every moving link, not of the payload.

    `tool` holds the shapes fixed to the flange, `scene` the obstacles around the arm; both are used
    for collisions only. With `collisions` false, no collisions are checked. `tool_cone` keeps an
    axis of the tool near a direction; `tcp_speed` and `elbow_speed` [m/s] limit the speeds of these
    points in the base frame.

    Raises InvalidProblem, with the field named, if the parts do not fit together.
    """

    robot: Robot
    T_flange_tcp: Array = field(default_factory=lambda: np.eye(4))
    payload: Payload = field(default_factory=Payload)
    gravity: Array = field(default_factory=lambda: np.array([0.0, 0.0, -9.81]))
    limits: Limits | None = None
    friction: str | None = None
    inverter: Inverter = field(default_factory=Inverter)
    bus: Bus = field(default_factory=Bus)
    link_mass_scale: Array = field(default_factory=lambda: np.array(1.0))
    tool: Sequence[Attachment] = ()
    scene: Scene = field(default_factory=Scene)
    collisions: bool = True
    tool_cone: ToolCone | None = None
    tcp_speed: float | None = None
    elbow_speed: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "T_flange_tcp", rigid_transform(self.T_flange_tcp, "tcp"))
        object.__setattr__(self, "gravity", frozen(self.gravity, (3,), "gravity"))
        object.__setattr__(
            self, "limits", self.robot.limits if self.limits is None else self.limits
        )
        object.__setattr__(self, "tool", tuple(self.tool))
        if len(self.tool) > MOST_PARTS:
            raise InvalidProblem("tool.capsules", f"A tool has at most {MOST_PARTS} capsules.")
        self._check_touches()
        self._check_names()
        self._check_limits()
        for name in ("tcp_speed", "elbow_speed"):
            speed = getattr(self, name)
            if speed is not None and not LEAST_SPEED <= speed < np.inf:
                raise InvalidProblem(
                    f"limits.{name}", f"limits.{name} must be at least {LEAST_SPEED:g} m/s."
                )
        if self.elbow_speed is not None and self.robot.elbow is None:
            raise InvalidProblem(
                "limits.elbow_speed", "This robot has no elbow: leave limits.elbow_speed out."
            )
        if self.friction is not None and self.friction not in self.robot.friction_laws:
            known = ", ".join(self.robot.friction_laws)
            raise InvalidProblem(
                "friction", f"There is no friction law of that name: use one of {known}."
            )
        nq = self.robot.nq
        scale = per_joint(self.link_mass_scale, nq, "link_mass_scale", *LINK_MASS_SCALES)
        object.__setattr__(self, "link_mass_scale", scale)
        given = {name: getattr(self.inverter, name) for name in INVERTER_PARTS}
        figures = {
            name: per_joint(value, nq, f"drives.inverter.{name}", 0.0, INVERTER_MOST)
            for name, value in given.items()
            if value is not None
        }
        object.__setattr__(self, "inverter", Inverter(**figures))

    @property
    def active_limits(self) -> Limits:
        """The limits in force."""
        assert self.limits is not None
        return self.limits

    @cached_property
    def friction_law(self) -> FrictionLaw:
        """The friction law in force."""
        return (
            self.robot.friction
            if self.friction is None
            else self.robot.friction_laws[self.friction]
        )

    @cached_property
    def drives(self) -> Drives:
        """The drives in force."""
        names = [name for name in INVERTER_PARTS if getattr(self.inverter, name) is not None]
        return replace(
            self.robot.drives,
            **{f"inverter_{name}": getattr(self.inverter, name) for name in names},
        )

    @property
    def base_power(self) -> float:
        """Power [W] of the electronics, without the motors and their inverters."""
        return self.robot.electronics.idle_power + self.robot.electronics.controller_power

    @property
    def regeneration(self) -> float:
        """Fraction of the surplus power on the bus that is fed back to the supply."""
        if self.bus.mode == "recuperating":
            return self.bus.efficiency
        return 0.0 if self.bus.mode == "isolated" else self.robot.electronics.regeneration

    def check_inside(self, target: str, q: Array) -> None:
        """Raises OutsideLimits, which names `target`, if a joint of q (nq,) [rad] is out of
        range."""
        lower, upper = self.active_limits.q_min, self.active_limits.q_max
        outside = np.flatnonzero((q < lower) | (q > upper))
        if outside.size:
            j = int(outside[0])
            raise OutsideLimits(
                target, self.robot.joint_names[j], float(q[j]), float(lower[j]), float(upper[j])
            )

    def _check_touches(self) -> None:
        """Raises InvalidProblem if a part of the tool, or the payload, touches a link that the
        robot does not have.
        """
        parts = [(f"tool.capsules.{k}.touches", part) for k, part in enumerate(self.tool)]
        if self.payload.shape is not None:
            parts.append(("payload.touches", self.payload.shape))
        known = self.robot.link_names
        for name, part in parts:
            if part.touches is not None and not set(part.touches) <= set(known):
                raise InvalidProblem(
                    name, f"{name} may name only links of the robot: {', '.join(known)}."
                )

    def _check_names(self) -> None:
        own = (*self.robot.link_names, TOOL, PAYLOAD)
        taken = first_among(self.scene.names, own)
        if taken is not None:
            raise InvalidProblem(
                f"scene.obstacles.{taken}.name",
                f"The arm's own bodies have the names {', '.join(own)}: give the obstacle another "
                "name.",
            )

    def _check_limits(self) -> None:
        limits, robot = self.active_limits, self.robot.limits
        # written so that NaN, which compares false with everything, is refused
        for public, name in LIMIT_NAMES.items():
            value, most = getattr(limits, name), getattr(robot, name)
            # bounds divide by the others; without a limit on jerk, acceleration jumps
            finite = name == "j_max" or (value < np.inf).all()
            if value.shape != most.shape or not ((value > 0).all() and finite):
                message = (
                    f"limits.{public} must be a positive number for every joint, and a finite one."
                )
                raise InvalidProblem(f"limits.{public}", message)
            # the factor allows the robot's own limits after rounding
            if (value > most * (1 + 1e-9)).any():
                joint = int(np.argmax(value / most))
                raise InvalidProblem(
                    f"limits.{public}",
                    f"limits.{public} may only tighten the robot's: "
                    f"{self.robot.joint_names[joint]} "
                    f"allows at most {most[joint]:.6g}.",
                )
        if limits.q_min.shape != robot.q_min.shape or limits.q_max.shape != robot.q_max.shape:
            raise InvalidProblem(
                "limits.position", "limits.position must have one number for every joint."
            )
        if not ((limits.q_min >= robot.q_min - 1e-9) & (limits.q_max <= robot.q_max + 1e-9)).all():
            raise InvalidProblem(
                "limits.position", "limits.position may only tighten the robot's own range."
            )
        if (limits.q_min >= limits.q_max).any():
            raise InvalidProblem(
                "limits.position", "limits.position.lower must be below limits.position.upper."
            )

    def no_faster_than(self, tcp_speed: float | None) -> Arm:
        """The same arm, whose TCP is no faster than this [m/s] either; None changes nothing."""
        return (
            self
            if tcp_speed is None
            else replace(self, tcp_speed=min(tcp_speed, self.tcp_speed or np.inf))
        )

    def check_rating(self, field: str, mass: float) -> None:
        """Raises InvalidProblem for `field` if a payload of `mass` [kg] exceeds the robot's
        rating."""
        if mass > self.robot.rated_payload:
            rating = self.robot.rated_payload
            raise InvalidProblem(
                field, f"{field} exceeds the robot's rating: give at most {rating:g} kg."
            )
