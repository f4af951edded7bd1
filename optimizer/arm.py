"""The arm as it stands in its cell: robot, tool, payload, mounting, limits and friction, validated on construction."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from models.registry import load_robot
from models.robot import Array, FrictionLaw, Limits, Robot
from optimizer.exceptions import InvalidProblem, OutsideLimits

LIMIT_NAMES = {"velocity": "v_max", "acceleration": "a_max", "jerk": "j_max", "torque": "tau_max"}


def frozen(values: object, shape: tuple[int, ...], name: str) -> Array:
    """A read-only array of that shape. Raises InvalidProblem, with the field named."""
    try:
        array = np.array(values, dtype=float)
    except (TypeError, ValueError):
        raise InvalidProblem(name, f"{name} must be numbers.") from None
    if array.shape != shape:
        raise InvalidProblem(name, f"{name} must have shape {shape}, not {array.shape}.")
    if not np.isfinite(array).all():
        raise InvalidProblem(name, f"{name} must be finite.")
    array.setflags(write=False)
    return array


@dataclass(frozen=True)
class Pose:
    """Pose of the TCP in the robot's base frame: `T` is the homogeneous matrix T_base_tcp, shape (4, 4), metres."""

    T: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "T", frozen(self.T, (4, 4), "pose"))
        rotation = self.T[:3, :3]
        # 1e-9: a rotation assembled in double precision is orthonormal to about 1e-15
        if np.abs(rotation @ rotation.T - np.eye(3)).max() > 1e-9 or np.linalg.det(rotation) < 0:
            raise InvalidProblem("pose", "The pose's rotation matrix must be orthonormal and right-handed.")
        if self.T[3].tolist() != [0, 0, 0, 1]:
            raise InvalidProblem("pose", "The last row of the pose's matrix must be 0, 0, 0, 1.")


@dataclass(frozen=True)
class Payload:
    """A body fixed to the flange: mass [kg], com (3,) [m] in the flange frame, inertia (3, 3) [kg·m²] about the com."""

    mass: float = 0.0
    com: Array = field(default_factory=lambda: np.zeros(3))
    inertia: Array = field(default_factory=lambda: np.zeros((3, 3)))

    def __post_init__(self) -> None:
        if not (np.isfinite(self.mass) and self.mass >= 0):
            raise InvalidProblem("payload.mass", "payload.mass must be a finite number of kg, zero or more.")
        object.__setattr__(self, "com", frozen(self.com, (3,), "payload.com"))
        object.__setattr__(self, "inertia", frozen(self.inertia, (3, 3), "payload.inertia"))
        if np.abs(self.inertia - self.inertia.T).max() > 1e-9 * np.abs(self.inertia).max():
            raise InvalidProblem("payload.inertia", "payload.inertia must be symmetric.")
        principal = np.linalg.eigvalsh(self.inertia)
        slack = 1e-9 * max(1.0, float(principal[-1]))
        if principal[0] < -slack or principal[2] > principal[0] + principal[1] + slack:
            raise InvalidProblem(
                "payload.inertia",
                "payload.inertia fits no body: principal moments must be positive and obey the triangle inequality.",
            )


@dataclass(frozen=True, kw_only=True)
class Arm:
    """A robot with what it carries, how it is mounted and which limits it keeps.

    `limits` replaces the robot's limits and may only tighten them. `gravity` (3,) [m/s²] is in the base frame.
    `friction` names one of the robot's friction laws (None: its default).

    Raises InvalidProblem, with the field named, when the parts do not fit together.
    """

    robot: Robot = field(default_factory=lambda: load_robot("ur5e"))
    T_flange_tcp: Array = field(default_factory=lambda: np.eye(4))
    payload: Payload = field(default_factory=Payload)
    gravity: Array = field(default_factory=lambda: np.array([0.0, 0.0, -9.81]))
    limits: Limits | None = None
    friction: str | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "T_flange_tcp", Pose(self.T_flange_tcp).T)
        object.__setattr__(self, "gravity", frozen(self.gravity, (3,), "gravity"))
        object.__setattr__(self, "limits", self.robot.limits if self.limits is None else self.limits)
        self._check_limits()
        if self.friction is not None and self.friction not in self.robot.friction_laws:
            known = ", ".join(self.robot.friction_laws)
            raise InvalidProblem("friction", f"There is no friction law of that name: use one of {known}.")

    @property
    def active_limits(self) -> Limits:
        """The limits in force."""
        assert self.limits is not None
        return self.limits

    @property
    def friction_law(self) -> FrictionLaw:
        """The friction law in force."""
        return self.robot.friction if self.friction is None else self.robot.friction_laws[self.friction]

    def check_inside(self, target: str, q: Array) -> None:
        """Raises OutsideLimits when a joint of q (nq,) is out of range; `target` says whose joints they are."""
        lower, upper = self.active_limits.q_min, self.active_limits.q_max
        outside = np.flatnonzero((q < lower) | (q > upper))
        if outside.size:
            j = int(outside[0])
            raise OutsideLimits(target, self.robot.joint_names[j], float(q[j]), float(lower[j]), float(upper[j]))

    def _check_limits(self) -> None:
        limits, robot = self.active_limits, self.robot.limits
        # asked so that NaN, which compares false with everything, is refused
        for public, name in LIMIT_NAMES.items():
            value, most = getattr(limits, name), getattr(robot, name)
            if value.shape != most.shape or not (value > 0).all():
                raise InvalidProblem(f"limits.{public}", f"limits.{public} must be a positive number for every joint.")
            # the factor lets a caller pass the robot's own figure back after rounding
            if (value > most * (1 + 1e-9)).any():
                joint = int(np.argmax(value / most))
                raise InvalidProblem(
                    f"limits.{public}",
                    f"limits.{public} may only tighten the robot's: {self.robot.joint_names[joint]} "
                    f"allows at most {most[joint]:.6g}.",
                )
        if limits.q_min.shape != robot.q_min.shape or limits.q_max.shape != robot.q_max.shape:
            raise InvalidProblem("limits.position", "limits.position must have one number for every joint.")
        if not ((limits.q_min >= robot.q_min - 1e-9) & (limits.q_max <= robot.q_max + 1e-9)).all():
            raise InvalidProblem("limits.position", "limits.position may only tighten the robot's own range.")
        if (limits.q_min >= limits.q_max).any():
            raise InvalidProblem("limits.position", "limits.position.lower must be below limits.position.upper.")
