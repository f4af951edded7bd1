"""Independent check of a motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, NamedTuple, NotRequired, TypedDict

from joulepath.optimizer.declared import Internal, Keys, Metres, Radians, Ratio, Seconds, Unit
from joulepath.optimizer.motion.limit_ratios import RATIO_TOLERANCE


@dataclass(frozen=True)
class Clearance:
    """Smallest distance between two bodies during the motion, minus the obstacle's `margin`."""

    min_clearance: Metres
    """Proven smallest clearance over the whole motion: no two bodies are ever closer."""
    sampled: Metres
    """Smallest clearance at sample points. The true value is between `min_clearance` and this."""
    pair: tuple[str, str]
    """Names of the two bodies: links, `tool`, `payload` or obstacles."""
    time: Seconds
    """Time of this sample, from the start of the motion."""
    points: Annotated[tuple[list[float], list[float]], Unit("m")] | None = None
    """The nearest points of the two bodies at that time, in the base frame, without the margin.
    Null in answers of an earlier version."""

    @property
    def message(self) -> str:
        """The two bodies, and the missing clearance [m]."""
        first, second = self.pair
        return f"{first} and {second}: clearance {max(-self.sampled, 0.0):.4f} m too small"


class WorstRatio(TypedDict):
    """Largest value / limit over all joints and instants: at most 1 + 1e-6. The fields after
    `torque` are present only if the request limits their quantity.
    """

    position: Ratio
    """Joint position: distance from the middle of the range / half of the range."""
    velocity: Ratio
    """Joint velocity."""
    acceleration: Ratio
    """Joint acceleration."""
    jerk: Ratio
    """Joint jerk."""
    torque: Ratio
    """Torque at the joint, on the side of the robot's `limits.torque_side`."""
    tool_cone: NotRequired[Ratio]
    """Angle between tool axis and direction / `half_angle` of `tool_cone`."""
    tcp_speed: NotRequired[Ratio]
    """Speed of the TCP."""
    elbow_speed: NotRequired[Ratio]
    """Speed of the elbow."""
    path_position: NotRequired[Ratio]
    """Distance of the TCP from the path / `tolerance.position`, between the samples, too."""
    path_rotation: NotRequired[Ratio]
    """Angle of the tool from that of the path / `tolerance.rotation`, between the samples, too."""
    path_speed: NotRequired[Ratio]
    """`speed.min` of the path / least speed of the TCP between the ramps. Of a fixed speed, the
    largest deviation from it / 0.1 % of it. Between the samples, too."""


class EndError(NamedTuple):
    """Deviation of the TCP from its target."""

    position: Metres
    """Distance."""
    rotation: Radians
    """Angle to the target orientation, or to the nearest allowed one; includes the deviation of the
    joints."""


@dataclass(frozen=True)
class Certificate:
    """Independent check of the motion: Pinocchio replays the spline on a grid of at most 1 ms."""

    worst_ratio: Annotated[dict[str, float], Keys(WorstRatio)]
    """Largest value / limit, for each limit."""
    start_error: EndError
    """Deviation at the start."""
    goal_error: EndError
    """Deviation at the goal."""
    rest_error: Annotated[float, Internal]
    """The worst |v| / v_max and |a| / a_max at the two ends."""
    pass_error: Annotated[Radians, Internal]
    """Largest deviation of a joint from the joint positions that the motion passes through; 0 if
    there are none."""
    energy_error: Ratio
    """Relative difference of the energy on this grid and the reported energy: the larger one of
    electrical and mechanical."""
    balance_error: Ratio
    """Relative difference of the sum of the electrical parts and the total."""
    clearance: Clearance | None
    """Smallest clearance; null if `collisions` is false."""
    close_pass: Annotated[Clearance | None, Internal]
    """The least distance without margins; None unless it may be below 2 mm."""

    POSITION_TOLERANCE = 1e-6
    # rounding of control points (1e-16 rad) over the square of the shortest knot span
    REST_TOLERANCE = 1e-7
    ENERGY_TOLERANCE = 1e-3

    @property
    def valid(self) -> bool:
        """Whether the motion is within every limit, at rest at its ends, on its passes, and of the
        reported energy.

        NaN is invalid.
        """
        return (
            all(ratio <= 1 + RATIO_TOLERANCE for ratio in self.worst_ratio.values())
            and all(
                error <= self.POSITION_TOLERANCE for error in self.start_error + self.goal_error
            )
            and self.rest_error <= self.REST_TOLERANCE
            and self.pass_error <= self.POSITION_TOLERANCE
            and self.energy_error <= self.ENERGY_TOLERANCE
            and self.balance_error <= self.ENERGY_TOLERANCE
            and (self.clearance is None or self.clearance.min_clearance >= 0)
        )
