"""An arm in its cell: robot, tool, payload, mounting, limits, friction, drives and bus. Validated
on construction.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from joulepath.models.robot import Array, Drives, FrictionLaw, Limits, Robot
from joulepath.optimizer.exceptions import InvalidProblem, OutsideLimits
from joulepath.optimizer.presentation import bounds_in_words
from joulepath.optimizer.problem.arrays import frozen, per_joint, rigid_transform
from joulepath.optimizer.problem.bus import Bus
from joulepath.optimizer.problem.declared_types import check_fields
from joulepath.optimizer.problem.names import first_taken
from joulepath.optimizer.problem.scalars import check_number, check_speed
from joulepath.optimizer.problem.scene import Attachment, Scene
from joulepath.optimizer.problem.tool_cone import ToolCone


@dataclass(frozen=True)
class ArmRanges:
    """Ranges of the figures of an arm."""

    least_speed: float = 1e-3
    """Least speed limit of a point [m/s]; below it, motions would exceed the longest duration."""
    limit_grace: float = 1e-4
    """Distance beyond a position limit that is rounding [rad], as of 3.1416 or 6.28319."""
    max_tool_parts: int = 16
    """Most capsules of a tool."""
    link_mass_scales: tuple[float, float] = (0.1, 10.0)
    """Least and greatest factor on mass and inertia of a link; beyond, it is no variant of the
    robot.
    """
    max_inverter_coefficient: float = 1e3
    """Greatest coefficient of an inverter's loss [W, W/A, W/A²], far above any inverter."""


ARM_RANGES = ArmRanges()

LIMIT_NAMES = {"velocity": "v_max", "acceleration": "a_max", "jerk": "j_max", "torque": "tau_max"}
TOOL = "tool"
"""Name of the tool among the bodies."""
PAYLOAD = "payload"
"""Name of the payload among the bodies."""
INVERTER_COEFFICIENTS = ("constant", "linear", "quadratic")
"""Coefficients of the inverters' loss."""


@dataclass(frozen=True)
class Payload:
    """A body fixed to the flange.

    Attributes:
        mass: mass [kg].
        com: centre of mass in the flange frame, shape (3,) [m].
        inertia: inertia about the centre of mass, shape (3, 3) [kg·m²].
        shape: geometry for collisions; None without one.

    Raises:
        InvalidProblem: no body has this mass or inertia; names the field.
    """

    mass: float = 0.0
    com: Array = field(default_factory=lambda: np.zeros(3))
    inertia: Array = field(default_factory=lambda: np.zeros((3, 3)))
    shape: Attachment | None = None

    def __post_init__(self) -> None:
        check_fields(self, "payload.")
        check_number("payload.mass", self.mass, "kilograms")
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
                "payload.inertia is impossible for a real body: its principal moments must not "
                "be negative, and none may exceed the sum of the other two.",
            )

    def is_same_body(self, other: Payload) -> bool:
        """Whether two payloads have the same mass, centre and inertia, and the same shape
        object.
        """
        return (
            self.shape is other.shape
            and self.mass == other.mass
            and np.array_equal(self.com, other.com)
            and np.array_equal(self.inertia, other.inertia)
        )


@dataclass(frozen=True)
class Inverter:
    """Coefficients of the inverters' loss constant + linear·|i| + quadratic·i² [W, W/A, W/A²].

    A coefficient is one number for all joints, or an array (nq,). None keeps the robot's value.
    """

    constant: float | Array | None = None
    linear: float | Array | None = None
    quadratic: float | Array | None = None


@dataclass(frozen=True, kw_only=True)
class Arm:
    """A robot with its tool, payload, mounting, surroundings and limits.

    Attributes:
        robot: the robot.
        T_flange_tcp: pose of the TCP in the flange frame, shape (4, 4).
        payload: body carried.
        gravity: gravity in the base frame, shape (3,) [m/s²]; None for that of the robot.
        limits: joint limits, at most those of the robot; None for these.
        friction: name of one of the robot's friction laws; None for its default.
        inverter: replaced coefficients of the inverters.
        bus: exchange of power between joints and supply.
        link_mass_scale: factor on mass and inertia of every moving link without the payload, a
            number or shape (nq,).
        tool: shapes fixed to the flange, for collisions.
        scene: obstacles, for collisions.
        collisions: whether collisions are checked.
        tool_cone: cone for an axis of the tool; None without one.
        tcp_speed: speed limit of the TCP in the base frame [m/s]; None without one.
        elbow_speed: speed limit of the elbow in the base frame [m/s]; None without one.

    Raises:
        InvalidProblem: the parts do not fit together; names the field.
    """

    robot: Robot
    T_flange_tcp: Array = field(default_factory=lambda: np.eye(4))
    payload: Payload = field(default_factory=Payload)
    # None is replaced on construction
    gravity: Array = field(default=None)  # type: ignore[arg-type]
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
        check_fields(self)
        object.__setattr__(self, "T_flange_tcp", rigid_transform(self.T_flange_tcp, "tcp"))
        gravity = self.gravity
        if gravity is None:
            gravity = self.robot.gravity  # type: ignore[unreachable]
        object.__setattr__(self, "gravity", frozen(gravity, (3,), "gravity"))
        object.__setattr__(
            self, "limits", self.robot.limits if self.limits is None else self.limits
        )
        object.__setattr__(self, "tool", tuple(self.tool))
        if len(self.tool) > ARM_RANGES.max_tool_parts:
            raise InvalidProblem(
                "tool.capsules", f"A tool has at most {ARM_RANGES.max_tool_parts} capsules."
            )
        self._check_touches()
        self._check_names()
        self._check_limits()
        for name in ("tcp_speed", "elbow_speed"):
            check_speed(f"limits.{name}", getattr(self, name), ARM_RANGES.least_speed)
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
        scale = per_joint(self.link_mass_scale, nq, "link_mass_scale", *ARM_RANGES.link_mass_scales)
        object.__setattr__(self, "link_mass_scale", scale)
        given = {name: getattr(self.inverter, name) for name in INVERTER_COEFFICIENTS}
        figures = {
            name: per_joint(
                value, nq, f"drives.inverter.{name}", 0.0, ARM_RANGES.max_inverter_coefficient
            )
            for name, value in given.items()
            if value is not None
        }
        object.__setattr__(self, "inverter", Inverter(**figures))

    @property
    def active_limits(self) -> Limits:
        """Joint limits in force."""
        assert self.limits is not None
        return self.limits

    @cached_property
    def friction_law(self) -> FrictionLaw:
        """Friction law in force."""
        return (
            self.robot.friction
            if self.friction is None
            else self.robot.friction_laws[self.friction]
        )

    @cached_property
    def drives(self) -> Drives:
        """Drives in force."""
        names = [name for name in INVERTER_COEFFICIENTS if getattr(self.inverter, name) is not None]
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
        """Fraction of the surplus power on the bus fed back to the supply."""
        if self.bus.mode == "recuperating":
            return self.bus.efficiency
        return 0.0 if self.bus.mode == "isolated" else self.robot.electronics.regeneration

    def inside(self, target: str, q: Array) -> Array:
        """Joint positions within the limits, to which those beyond by rounding are moved.

        Args:
            target: name of the target, for the error.
            q: joint positions, shape (nq,) [rad].

        Returns:
            Read-only joint positions, shape (nq,) [rad].

        Raises:
            OutsideLimits: a joint is out of range.
        """
        lower, upper = self.active_limits.q_min, self.active_limits.q_max
        within = np.clip(q, lower, upper)
        outside = np.flatnonzero(np.abs(within - q) > ARM_RANGES.limit_grace)
        if outside.size:
            j = int(outside[0])
            raise OutsideLimits(
                target, self.robot.joint_names[j], float(q[j]), float(lower[j]), float(upper[j])
            )
        within.setflags(write=False)
        return np.asarray(within)

    def _check_touches(self) -> None:
        """Check that all links touched by tool or payload exist."""
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
        taken = first_taken(self.scene.names, own)
        if taken is not None:
            raise InvalidProblem(
                f"scene.obstacles.{taken}.name",
                f"The arm's own bodies have the names {', '.join(own)}: give the obstacle another "
                "name.",
            )

    def _check_limits(self) -> None:
        limits, robot = self.active_limits, self.robot.limits
        # negated comparisons refuse NaN
        for public, name in LIMIT_NAMES.items():
            value, most = getattr(limits, name), getattr(robot, name)
            # bounds divide by the others; without a limit on jerk, acceleration jumps
            finite = name == "j_max" or (value < np.inf).all()
            if value.shape != most.shape or not ((value > 0).all() and finite):
                message = f"limits.{public} must be a positive, finite number for every joint."
                raise InvalidProblem(f"limits.{public}", message)
            # the factor allows the robot's own limits after rounding
            if (value > most * (1 + 1e-9)).any():
                joint = int(np.argmax(value / most))
                raise InvalidProblem(
                    f"limits.{public}",
                    f"limits.{public} may only tighten the robot's: "
                    f"{self.robot.joint_names[joint]} "
                    f"allows at most {bounds_in_words.most(most[joint])}.",
                )
        if limits.q_min.shape != robot.q_min.shape or limits.q_max.shape != robot.q_max.shape:
            raise InvalidProblem(
                "limits.position", "limits.position must have one number for every joint."
            )
        if not ((limits.q_min >= robot.q_min - 1e-9) & (limits.q_max <= robot.q_max + 1e-9)).all():
            raise InvalidProblem(
                "limits.position", "limits.position may only tighten the robot's own range."
            )
        narrow = limits.q_max <= limits.q_min
        if narrow.any():
            raise InvalidProblem(
                "limits.position",
                f"The range of {self.robot.joint_names[int(narrow.argmax())]} is empty: upper must "
                "exceed lower.",
            )

    def no_faster_than(self, tcp_speed: float | None) -> Arm:
        """The arm with a further speed limit of the TCP [m/s]; None changes nothing."""
        return (
            self
            if tcp_speed is None
            else replace(self, tcp_speed=min(tcp_speed, self.tcp_speed or np.inf))
        )

    def check_rating(self, field: str, mass: float) -> None:
        """Check a payload's mass [kg] against the robot's rating.

        Raises:
            InvalidProblem: the mass exceeds the rating; names `field`.
        """
        if mass > self.robot.rated_payload:
            rating = self.robot.rated_payload
            raise InvalidProblem(
                field,
                f"{field} exceeds the robot's rating: the arm would carry {mass:g} kg and may "
                f"carry {rating:g} kg, a tool given by name included.",
            )
