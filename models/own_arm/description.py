"""What a user says of an arm of their own: its URDF, and what a URDF does not hold."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from joulepath.models.robot import TorqueSide

# one number for all joints, or one per joint from base to tip
PerJoint = float | tuple[float, ...]
Letter = Literal["A", "B", "C", "T"]
# x, y, z of both ends of the axis in the link's frame, then the radius [m]
CapsuleRow = tuple[float, float, float, float, float, float, float]

# greatest radius of a capsule that a user gives [m]
WIDEST = 1.0
# characters of a name or a path in a file that a message repeats at most
LONGEST_NAME = 200


class InvalidArm(ValueError):
    """A description or URDF that makes no robot. `field` is the place in the description, e.g.
    `drives.copper`.
    """

    def __init__(self, field: str, message: str) -> None:
        super().__init__(message)
        self.field = field

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.field, str(self))


@dataclass(frozen=True)
class Drives:
    """Joint-side figures of motors and gears; what is None follows from the torque limits
    (`joulepath.models.own_arm.rules`).

    `rotor_inertia` [kg·m²], `coulomb` [N·m] and `viscous` [N·m·s/rad] friction, `copper`
    [W/(N·m)²]: copper loss over the square of the motor torque.
    """

    rotor_inertia: PerJoint | None = None
    coulomb: PerJoint | None = None
    viscous: PerJoint | None = None
    copper: PerJoint | None = None


@dataclass(frozen=True)
class Electronics:
    """Power [W] of the arm's electronics, and the share of surplus power that the supply takes back
    (0 … 1).
    """

    idle_power: float | None = None
    controller_power: float | None = None
    regeneration: float | None = None


@dataclass(frozen=True)
class Collision:
    """Shape of the links. `capsules` by the name of a link; links without get those of the URDF's
    own shapes, or one of `radius` [m] from joint to joint. `never_meet`: pairs of links that are
    not compared."""

    capsules: Mapping[str, tuple[CapsuleRow, ...]] | None = None
    radius: float | None = None
    never_meet: tuple[tuple[str, str], ...] | None = None


@dataclass(frozen=True)
class Motion:
    """The controller's default motion: speed [rad/s] and acceleration [rad/s²] of the leading
    joint.
    """

    velocity: float
    acceleration: float


@dataclass(frozen=True)
class Description:
    """An arm of a user's own: the URDF's text, the link `tip` at its end, and what a URDF does not
    say.

    `acceleration` [rad/s²], `payload` [kg]. `base` is the link whose frame is the world frame
    (default: the root). `velocity` [rad/s] and `torque` [N·m] replace the URDF's limits;
    `torque_side` is what the latter are for; `jerk` [rad/s³]. `locked` has a position [rad] or [m]
    for each joint that is held. `source` says where the URDF is from, `trust` how good it is.
    `srdf` is the text of an SRDF, whose disabled collisions are not compared. `meshes` has the
    content of mesh files by their paths.
    """

    urdf: str
    tip: str
    acceleration: PerJoint
    payload: float
    base: str | None = None
    title: str | None = None
    source: str = "given by the user"
    trust: Letter = "C"
    velocity: PerJoint | None = None
    torque: PerJoint | None = None
    torque_side: TorqueSide | None = None
    jerk: PerJoint | None = None
    locked: Mapping[str, float] | None = None
    drives: Drives = Drives()
    electronics: Electronics = Electronics()
    collision: Collision = Collision()
    srdf: str | None = None
    meshes: Mapping[str, bytes] | None = None
    default_motion: Motion | None = None
