"""A robot arm: Pinocchio model, limits, drives, electronics, friction laws and link capsules."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, ClassVar, Literal

import numpy as np
import numpy.typing as npt
import pinocchio as pin

from joulepath.models.coupling import UNCOUPLED, Coupling
from joulepath.models.immutable import (
    ReadOnlyArrays,
    ReadOnlyDict,
    numbers,
    read_only_document,
    read_only_view,
)

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
TorqueSide = Literal["motor", "link"]

UPRIGHT = np.array([0.0, 0.0, -9.81])
"""Gravity [m/s²] in the frame of an upright base."""
UPRIGHT.setflags(write=False)

MOST_ROBOTS = 64
"""Robots whose models, kernels and inverse kinematics are cached; users may add any number."""


@dataclass(frozen=True)
class Limits(ReadOnlyArrays):
    """Joint limits in SI units, arrays of shape (nq,).

    All limits are symmetric, except `q_min` and `q_max`. `tau_max` limits the torque of the motor
    or of the link, as the robot's `torque_side` says. Raises ValueError if one is no numbers.
    """

    q_min: Array
    q_max: Array
    v_max: Array
    a_max: Array
    j_max: Array
    tau_max: Array

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            object.__setattr__(self, name, numbers(value, name))
        super().__post_init__()

    @cached_property
    def rates(self) -> Array:
        """Limits on speed, acceleration and jerk, (3, nq)."""
        return read_only_view(np.stack([self.v_max, self.a_max, self.j_max]))

    def scaled(self, factors: Limits | float) -> Limits:
        """Limits with speed, acceleration, jerk and torque scaled, by one factor or per joint."""
        rates = ("v_max", "a_max", "j_max", "tau_max")
        by = {n: getattr(factors, n) if isinstance(factors, Limits) else factors for n in rates}
        return replace(self, **{n: getattr(self, n) * by[n] for n in rates})

    def tightened(self, **given: Array | None) -> Limits:
        """Limits with some of the arrays replaced; the caller ensures tighter values."""
        return replace(self, **{name: value for name, value in given.items() if value is not None})


@dataclass(frozen=True)
class FrictionLaw(ReadOnlyArrays):
    """Joint friction torque, odd in the speed v.

    tau_f = (coulomb + load · |tau_link|) · v / sqrt(v² + knee²) + curved · asinh(v / speed) +
    viscous · v

    The first term is Coulomb friction, smoothed over `knee` [rad/s]. It grows with tau_link, the
    torque of the rigid bodies: the gear transmits this torque, but not the rotor's. The second term
    is the concave rise of strain-wave gears, the third viscous friction. Arrays have shape (nq,):
    coulomb, curved [N·m], load [1], speed [rad/s], viscous [N·m·s/rad]. `load` is None for a law
    without load dependence. A positive `bend` [N·m] smooths |tau_link| to sqrt(tau_link² + bend²).
    """

    name: str
    coulomb: Array
    curved: Array
    speed: Array
    viscous: Array
    knee: float = 1e-3
    load: Array | None = None
    bend: Any = 0.0

    FORMULA: ClassVar[str] = "coulomb v / sqrt(v² + knee²) + curved asinh(v / speed) + viscous v"
    LOAD_FORMULA: ClassVar[str] = FORMULA.replace("coulomb", "(coulomb + load |tau_link|)")

    def torque(self, v: Any, tau_link: Any = None, xp: Any = np) -> Any:
        """Friction torque (..., nq) [N·m].

        Args:
            v: joint speeds (..., nq) [rad/s].
            tau_link: torques of the rigid bodies (..., nq) [N·m]; unused without `load`.
            xp: numpy, or casadi for symbols.
        """
        dry = self.coulomb
        if self.load is not None:
            dry = dry + self.load * xp.sqrt(tau_link * tau_link + self.bend * self.bend)
        return (
            dry * v / xp.sqrt(v * v + self.knee * self.knee)
            + self.curved * xp.asinh(v / self.speed)
            + self.viscous * v
        )

    def loss_slope(self, v: Array) -> Array:
        """Derivative by v (..., nq) ≥ 0 [rad/s] of the loss without Coulomb's, v (curved asinh(v /
        speed) + viscous v), shape (..., nq) [N·m]."""
        bent = self.curved * (np.arcsinh(v / self.speed) + v / np.hypot(v, self.speed))
        return np.asarray(bent + 2 * self.viscous * v)

    def loss_curvature(self, v: Array) -> Array:
        """Derivative of `loss_slope` by v (..., nq), falling in v, shape (..., nq) [N·m·s/rad]."""
        bent = self.curved * (v**2 + 2 * self.speed**2) / np.hypot(v, self.speed) ** 3
        return np.asarray(bent + 2 * self.viscous)

    @property
    def unloaded(self) -> FrictionLaw:
        """The law without load dependence, a lower bound since `load` is never negative."""
        return replace(self, load=None)


@dataclass(frozen=True)
class Drives(ReadOnlyArrays):
    """Motor and gear of every joint, joint-side, shape (nq,) each.

    `torque_constant` [N·m/A], `rotor_inertia` [kg·m²], `copper` [W/A²], and the inverter's loss
    `inverter_constant + inverter_linear·|i| + inverter_quadratic·i²` [W, W/A, W/A²].
    """

    gear_ratio: Array
    torque_constant: Array
    rotor_inertia: Array
    copper: Array
    inverter_constant: Array
    inverter_linear: Array
    inverter_quadratic: Array


@dataclass(frozen=True)
class Electronics:
    """Power [W] of the arm's electronics without motors, and regeneration.

    `regeneration` is the fraction of surplus power fed back to the supply.
    """

    idle_power: float
    controller_power: float
    regeneration: float


@dataclass(frozen=True)
class Mains:
    """What the control box draws from the mains: `factor` times the energy of the arm's bus, and a
    `constant` power [W].
    """

    factor: float
    constant: float

    def energy(self, drawn: float, duration: float) -> float:
        """Energy from the mains [J] for an energy drawn from the bus [J] in a duration [s]."""
        return self.factor * drawn + self.constant * duration


@dataclass(frozen=True)
class DefaultMotion:
    """The robot controller's default motion: speed [rad/s] and acceleration [rad/s²] of a
    leading-axis trapezoid.
    """

    velocity: float
    acceleration: float


@dataclass(frozen=True)
class LinkCapsule(ReadOnlyArrays):
    """A capsule fixed to a link: ends of its axis (2, 3) [m] in the link frame, and radius [m].

    `link` is the number of the joint moving the link, 0 for the base.
    """

    link: int
    axis: Array
    radius: float


@dataclass(frozen=True, eq=False)
class LinkHull(ReadOnlyArrays):
    """The convex hull of `points` (n, 3) [m] in the frame of a link, grown by `radius` [m].

    `link` is the number of the joint moving the link, 0 for the base.
    """

    link: int
    points: Array
    radius: float


@dataclass(frozen=True, eq=False)
class Robot(ReadOnlyArrays):
    """A robot arm: serial chain of revolute joints, world frame = `base`, last frame = `flange`.
    Compared by identity. Robots are shared: none of their data can be changed.

    `model` has link inertias and rotor inertia (as armature); `loaded_model` adds payload and
    tilted gravity. `friction_laws` are named, and the first is the default. `figures` is the
    content of `GET /robots/{name}`: every figure with its unit, source and trust letter.
    `default_motion` is None if the controller's defaults are unknown.

    The `capsules` cover the meshes of the links. The `hulls` of a link, one or several, cover it
    more closely: distances to obstacles are those of hulls, and distances between links those of
    capsules, or also those of hulls with `hulls_between_links`.
    `never_in_collision` has pairs of non-adjacent links which cannot touch in any configuration.
    `elbow` is the capsule around the elbow, for its speed limit; None for an arm without an elbow.
    `torque_side` is `motor` if the torque limits include rotor and friction, `link` if they exclude
    them. `T_base_base_link` (4, 4) is the pose of ROS's frame `base_link` in `base`. `gravity` (3,)
    [m/s²] is that in `base` unless an arm has another mounting. `mains` is None where nobody
    measured what the control box draws. `coupling` has the joints of the chain that follow others;
    the others are the nq joints of the arm. `maker` is None for a user's own arm.
    """

    name: str
    title: str
    model: pin.Model
    limits: Limits
    rated_payload: float
    drives: Drives
    electronics: Electronics
    friction_laws: Mapping[str, FrictionLaw]
    default_motion: DefaultMotion | None
    capsules: tuple[LinkCapsule, ...]
    never_in_collision: frozenset[tuple[int, int]]
    figures: dict[str, Any] = field(repr=False)
    hulls: tuple[LinkHull, ...] = ()
    hulls_between_links: bool = False
    torque_side: TorqueSide = "motor"
    elbow: LinkCapsule | None = None
    T_base_base_link: Array = field(default_factory=lambda: np.eye(4), repr=False)
    gravity: Array = field(default_factory=lambda: UPRIGHT, repr=False)
    mains: Mains | None = None
    coupling: Coupling = UNCOUPLED
    maker: str | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "friction_laws", ReadOnlyDict(self.friction_laws))
        object.__setattr__(self, "figures", read_only_document(self.figures))

    @cached_property
    def links_by_hulls(self) -> frozenset[int]:
        """The links that are compared with other links by their hulls; the others by capsules."""
        return frozenset(h.link for h in self.hulls if self.hulls_between_links)

    def __repr__(self) -> str:
        return f"Robot({self.name!r}, {self.nq} joints, payload up to {self.rated_payload:g} kg)"

    @property
    def nq(self) -> int:
        """Number of joints, without those that follow others."""
        return len(self.coupling.own) or int(self.model.nq)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints from base to flange, without those that follow others."""
        names = tuple(self.model.names)[1:]
        return tuple(names[k] for k in self.coupling.own) or names

    @property
    def link_names(self) -> tuple[str, ...]:
        """Names of the base and of the moving links."""
        return link_names(self.model)

    @property
    def last_link(self) -> int:
        """Number of the link that carries the flange."""
        return int(self.model.njoints) - 1

    @property
    def T_last_flange(self) -> Array:
        """Pose (4, 4) of the flange in the frame of the last link."""
        return np.asarray(flange_placement(self.model).homogeneous)

    @property
    def friction(self) -> FrictionLaw:
        """The default friction law."""
        return next(iter(self.friction_laws.values()))

    @property
    def has_load_friction(self) -> bool:
        """Whether any friction law depends on the load."""
        return any(law.load is not None for law in self.friction_laws.values())

    def loaded_model(
        self,
        mass: float,
        com: Array,
        inertia: Array,
        gravity: Array,
        link_mass_scale: Array | None = None,
    ) -> pin.Model:
        """A copy of the model with a payload fixed to the flange, other gravity and scaled links.

        Args:
            mass: mass of the payload [kg].
            com: its centre of mass (3,) [m] in the flange frame.
            inertia: its inertia (3, 3) [kg·m²] about the centre of mass, in flange axes.
            gravity: gravity (3,) [m/s²] in the base frame.
            link_mass_scale: factors (nq,) on mass and inertia of the links that each joint turns,
                without rotors.
        """
        model = self.model.copy()
        scales = np.zeros(0) if link_mass_scale is None else self.coupling.of_links(link_mass_scale)
        for i, scale in enumerate(scales.tolist(), start=1):
            body = model.inertias[i]
            model.inertias[i] = pin.Inertia(scale * body.mass, body.lever, scale * body.inertia)
        last = model.njoints - 1
        flange = flange_placement(model)
        body = pin.Inertia(mass, np.asarray(com, dtype=float), np.asarray(inertia, dtype=float))
        model.inertias[last] = model.inertias[last] + flange.act(body)
        model.gravity.linear = np.asarray(gravity, dtype=float)
        return model


def flange_placement(model: pin.Model) -> pin.SE3:
    """Pose of the flange in the frame of the last link; a joint may have its name, too."""
    return model.frames[model.getFrameId("flange", pin.FrameType.BODY)].placement


def link_names(model: pin.Model) -> tuple[str, ...]:
    """Names of the base and the moving links of a chain, njoints of them.

    A link without a body frame in the model has the name of its joint.
    """
    # Several links may be rigidly connected to one joint, such as the flange: the first one counts.
    first = {
        frame.parentJoint: frame.name for frame in reversed(model.frames) if frame.type == pin.BODY
    }
    return tuple(first.get(joint, model.names[joint]) for joint in range(model.njoints))
