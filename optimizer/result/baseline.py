"""Motions of other planners, which an answer is compared with."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

from joulepath.optimizer.declared import Internal, Joules, PerJoint, Ratio, Seconds, Unit
from joulepath.optimizer.presentation.equality import Comparable
from joulepath.optimizer.result.energy import SavingInterval, Sensitivity


@dataclass(frozen=True, eq=False)
class Standing(Comparable):
    """Arm at rest at q (nq,) [rad] with motor torques tau (nq,) [N·m] and a total power of `power`
    [W].
    """

    q: Annotated[PerJoint, Unit("rad")]
    tau: Annotated[PerJoint, Unit("N·m")]
    power: float


BaselineName = Literal[
    "trapezoid",
    "quintic",
    "ruckig",
    "ruckig_slowed",
    "straight",
    "controller_default",
    "waypoints",
    "blended",
    "even_speed",
]


@dataclass(frozen=True, kw_only=True)
class Baseline:
    """The energy of another planner's motion from the same start to the nearest goal configuration;
    `waypoints` and `blended` go to the goal configuration of the answer."""

    name: BaselineName
    """`trapezoid`: trapezoidal velocity, in the duration of the answer. `quintic`: polynomial of
    degree 5, in the duration of the answer. `ruckig`: time-optimal within the velocity,
    acceleration and jerk limits. `ruckig_slowed`: the same motion, uniformly slowed down to the
    duration of the answer. `straight`: the fastest motion within the same limits along the straight
    line in joint space, with all joints synchronised, slowed down to the duration of the answer.
    `controller_default`: the robot's own controller with its default speed
    and acceleration. `waypoints`: from waypoint to waypoint of a planned path without collisions,
    straight in joints, with a rest at each. `blended`: along the same path without a rest, its
    corners rounded. These two are computed if fewer than two others are within every limit; they
    are as fast as the limits allow, but not faster than the answer. Along a tool path, there are
    `even_speed`, with an even speed between two smooth ramps, and `quintic`, both along the joint
    path of the answer and as fast as the last two."""
    duration: Seconds
    """Duration of this motion."""
    electrical: Joules
    """Electrical energy of this motion, drawn from the supply; with a `dwell`, also of the wait
    after it."""
    mechanical: Joules
    """Mechanical work of this motion."""
    within_limits: bool = field(init=False)
    """Whether this motion is within every limit; collisions are checked at sample points."""
    reason: str | None
    """Limits that this motion exceeds, and the two bodies closer than allowed, with the amount.
    Null if it is within every limit."""
    saving: Ratio | None
    """1 - energy of the answer / energy of this motion, of the objective, in the same cycle time:
    the shorter motion also waits at its goal, held by the motors, until the longer one ends. Null
    if this motion is not within every limit, since it is then no valid comparison.
    """
    sensitivity: Annotated[Sensitivity | None, Internal] = field(repr=False)
    """Sensitivity of the electrical energy. None for a motion outside of a limit with which nothing
    is compared."""
    at_goal: Annotated[Standing, Internal] = field(repr=False)
    """Arm at rest at the goal of this motion."""
    saving_interval: SavingInterval | None = None
    """Uncertainty of the saving. Null without a saving, and for the objective `mechanical`."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "within_limits", self.reason is None)
