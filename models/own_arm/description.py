"""The description of a user's own arm: its URDF, and figures beyond a URDF."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Literal

from joulepath.models.robot import TorqueSide

# one number for all joints, or one per joint from base to tip
PerJoint = float | tuple[float, ...]
Letter = Literal["A", "B", "C", "T"]
# x, y, z of both ends of the axis in the link's frame, then the radius [m]
CapsuleRow = tuple[float, float, float, float, float, float, float]


@dataclass(frozen=True)
class PlausibleRanges:
    """Ranges of an arm in SI units; a description beyond them is likely in other units."""

    mass: float = 1e4
    """Largest mass [kg], lever [m] or inertia [kg·m²]."""
    length: float = 50.0
    """Largest distance of a joint or shape from the previous joint [m]."""
    angle: float = 100.0
    """Largest position limit [rad]."""
    mesh: float = 5.0
    """Largest mesh of a link [m]; a file in millimetres needs a scale."""
    radius: float = 1.0
    """Largest radius of a capsule [m]."""
    least: float = 1e-6
    """Least positive limit, inertia or friction [SI]."""
    most: float = 1e6
    """Greatest limit, inertia or friction [SI]."""
    least_multiplier: float = 1e-3
    """Least multiplier of a joint that follows another [1]; the greatest is its inverse."""
    name: int = 200
    """Most characters of a name or path repeated in a message."""


PLAUSIBLE = PlausibleRanges()


class InvalidArm(ValueError):
    """An invalid description or URDF. `field` is the path in the description: `drives.copper`.

    `problems` has all errors found together, each with its field and message; `field` is that of
    the first, and the message has one line for each.
    """

    def __init__(self, field: str, message: str, *others: tuple[str, str]) -> None:
        self.field = field
        self.problems = ((field, message), *others)
        super().__init__("\n".join(text for _, text in self.problems))

    def __reduce__(self) -> tuple[Any, ...]:
        (field, message), *others = self.problems
        return type(self), (field, message, *others)


class Problems:
    """Errors of a description that are reported together."""

    def __init__(self) -> None:
        self._found = list[tuple[str, str]]()

    @contextmanager
    def noted(self) -> Iterator[None]:
        """A context in which an InvalidArm is kept for `raise_any`."""
        try:
            yield
        except InvalidArm as error:
            self._found += error.problems

    def raise_any(self) -> None:
        """Raises InvalidArm with all errors kept so far, if there are any."""
        if self._found:
            (field, message), *others = dict.fromkeys(self._found)
            raise InvalidArm(field, message, *others)


@dataclass(frozen=True)
class Drives:
    """Joint-side figures of motors and gears.

    `rotor_inertia` [kg·m²], `coulomb` [N·m] and `viscous` [N·m·s/rad] friction, `copper`
    [W/(N·m)²]: copper loss over the square of the motor torque. None stands for the default derived
    from the torque limits (`joulepath.models.own_arm.rules`).
    """

    rotor_inertia: PerJoint | None = None
    coulomb: PerJoint | None = None
    viscous: PerJoint | None = None
    copper: PerJoint | None = None


@dataclass(frozen=True)
class Electronics:
    """Power [W] of the arm's electronics, and the share of surplus power fed back (0 … 1)."""

    idle_power: float | None = None
    controller_power: float | None = None
    regeneration: float | None = None


@dataclass(frozen=True)
class Collision:
    """Shapes of the links.

    `capsules` are given by the name of a link. Other links have capsules around their URDF shapes,
    or one of `radius` [m] from joint to joint. `never_meet` has pairs of links excluded from
    checks.
    """

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
    """A user's own arm: text of the URDF, link `tip` at the end of the arm, further figures.

    `payload` [kg]. `base` is the link with the world frame (default: the root). `acceleration`
    [rad/s²], `velocity` [rad/s], `torque` [N·m] and `jerk` [rad/s³] replace the limits of the URDF;
    `torque_side` says whether torque limits include friction and rotor. `locked` has positions
    [rad] or [m] of fixed joints; "others" holds all joints that are not between base and tip, at
    zero or the limit nearest to it. `source` is the origin of the URDF, `trust` its trust letter.
    `srdf` is the text of an SRDF with disabled collision checks. `meshes` has mesh files by path.
    `masses` [kg] by link replace those of the URDF, and one number is the mass of all moving links;
    links without a mass are estimated by `density` [kg/m³] (default: aluminium), with either field.
    `mend_inertias` replaces impossible inertias by the nearest possible ones.
    """

    urdf: str
    tip: str
    payload: float
    acceleration: PerJoint | None = None
    base: str | None = None
    title: str | None = None
    source: str = "given by the user"
    trust: Letter = "C"
    velocity: PerJoint | None = None
    torque: PerJoint | None = None
    torque_side: TorqueSide | None = None
    jerk: PerJoint | None = None
    locked: Mapping[str, float] | Literal["others"] | None = None
    drives: Drives = Drives()
    electronics: Electronics = Electronics()
    collision: Collision = Collision()
    srdf: str | None = None
    meshes: Mapping[str, bytes] | None = None
    default_motion: Motion | None = None
    masses: Mapping[str, float] | float | None = None
    density: float | None = None
    mend_inertias: bool = False
