"""Use of the limits by a given motion: for each limit, the instant with the largest value /
limit."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Literal

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.declared import NullIfNotFinite, Ratio, Seconds, Unit
from joulepath.optimizer.dynamics.limited_torque import limited_torque
from joulepath.optimizer.evaluate.piecewise_motion import Indices, PiecewiseMotion
from joulepath.optimizer.kinematics.path_constraints import path_constraints_of
from joulepath.optimizer.motion.limit_ratios import RATIO_TOLERANCE, ratios
from joulepath.optimizer.problem.arm import Arm

LimitName = Literal[
    "position",
    "velocity",
    "acceleration",
    "jerk",
    "torque",
    "tool_cone",
    "tcp_speed",
    "elbow_speed",
]


@dataclass(frozen=True)
class StepSettings:
    """Sizes of steps between two pieces, over the limit: above rounding errors, and harmless."""

    speed: float = 1e-6
    """Velocity step over the limit of the velocity [1]."""
    acceleration: float = 1e-4
    """Acceleration step over the limit of the acceleration [1]."""


STEPS = StepSettings()


@dataclass(frozen=True)
class LimitReport:
    """One limit, at the instant of the motion with the largest value / limit."""

    worst_ratio: Annotated[Ratio, NullIfNotFinite]
    """|value| / limit; for positions: distance from the middle of the range / half of the range.
    Null
    if the value is infinite."""
    limit: LimitName
    """The limit. `tool_cone`, `tcp_speed` and `elbow_speed` only if the request limits them."""
    held: bool = field(init=False)
    """Whether the motion is within this limit."""
    joint: str | None
    """Name of the joint; null for `tool_cone`, `tcp_speed` and `elbow_speed`."""
    t: Seconds
    """Time of this instant, from the start of the motion."""
    value: Annotated[float, Unit("SI"), NullIfNotFinite]
    """Value at this instant, in the unit of the limit: rad, rad/s, rad/s², rad/s³, N·m or m/s. Null
    if it is infinite: the acceleration at a velocity step, the jerk at an acceleration step."""
    bound: Annotated[float, Unit("SI")]
    """Value of the limit, in the same unit."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "held", self.worst_ratio <= 1 + RATIO_TOLERANCE)


class LimitMonitor:
    """Largest ratio of value to limit for every limit of an arm, updated block after block."""

    def __init__(self, arm: Arm) -> None:
        self._limits, self._joints, self._arm = arm.active_limits, arm.robot.joint_names, arm
        self._worst: dict[LimitName, LimitReport] = {}
        self._path = path_constraints_of(arm)
        self._path_bounds: dict[str, float] = {
            name: bound
            for name, bound in {
                "tool_cone": arm.tool_cone.half_angle if arm.tool_cone else None,
                "tcp_speed": arm.tcp_speed,
                "elbow_speed": arm.elbow_speed,
            }.items()
            if bound is not None
        }

    def update(self, t: Array, q: Array, v: Array, a: Array, jerk: Array, tau: Array) -> None:
        """Add samples of a motion.

        Args:
            t: times (k,) [s].
            q: positions (k, nq) [rad].
            v: velocities (k, nq) [rad/s].
            a: accelerations (k, nq) [rad/s²].
            jerk: jerks (k, nq) [rad/s³].
            tau: torques (k, nq) of rigid bodies and rotors [N·m].
        """
        limits, tau_limited = self._limits, limited_torque(self._arm, tau, v, a)
        nearer_end = np.where(q > (limits.q_max + limits.q_min) / 2, limits.q_max, limits.q_min)
        values = {
            "position": q,
            "velocity": v,
            "acceleration": a,
            "jerk": jerk,
            "torque": tau_limited,
        }
        bounds = {
            "velocity": limits.v_max,
            "acceleration": limits.a_max,
            "jerk": limits.j_max,
            "torque": limits.tau_max,
        }
        for name, ratio in ratios(limits, q, v, a, jerk, tau_limited).items():
            k, j = np.unravel_index(int(np.argmax(ratio)), ratio.shape)
            bound = nearer_end[k, j] if name == "position" else bounds[name][j]
            self._update_worst(
                name,  # type: ignore[arg-type]
                float(ratio[k, j]),
                int(j),
                float(t[k]),
                float(values[name][k, j]),
                float(bound),
            )
        if self._path is not None:
            path_ratios = self._path.ratios(q, v)
            for c, path_name in enumerate(self._path.names):
                at, bound = int(path_ratios[:, c].argmax()), self._path_bounds[path_name]
                worst = float(path_ratios[at, c])
                found = (path_name, worst, None, float(t[at]), worst * bound, bound)
                self._update_worst(*found)  # type: ignore[arg-type]

    def update_breakpoints(
        self, motion: PiecewiseMotion, before: PiecewiseMotion | None
    ) -> Indices:
        """Add the steps at the breakpoints of a block.

        Args:
            motion: the block.
            before: the previous block; None for the first block.

        Returns:
            Indices (k,) of the pieces that begin with a velocity step.
        """
        piece = np.arange(len(motion.segment))
        _, v_end, a_end, _ = motion.at(piece, np.diff(motion.breakpoints))
        _, v, a, _ = motion.at(piece, np.zeros(len(piece)))
        if before is None:
            v_before, a_before = v[:1], a[:1]
        else:
            last = np.array([len(before.segment) - 1])
            _, v_before, a_before, _ = before.at(last, np.diff(before.breakpoints)[last])
        t, limits = motion.breakpoints, self._limits
        speed_step = np.abs(v - np.concatenate([v_before, v_end[:-1]])) / limits.v_max > STEPS.speed
        step = (
            np.abs(a - np.concatenate([a_before, a_end[:-1]])) / limits.a_max > STEPS.acceleration
        )
        self._update_step("acceleration", speed_step, t, limits.a_max)
        self._update_step("jerk", speed_step | step, t, limits.j_max)
        return np.flatnonzero(speed_step.any(axis=1))

    def report(self) -> list[LimitReport]:
        """The largest ratio of every limit."""
        return list(self._worst.values())

    def _update_step(self, name: LimitName, steps: Mask, t: Array, bounds: Array) -> None:
        steps = steps & np.isfinite(bounds)  # a step violates no limit that is infinite
        if steps.any():
            k, j = np.argwhere(steps)[0].tolist()
            self._update_worst(name, np.inf, j, float(t[k]), np.inf, float(bounds[j]))

    def _update_worst(
        self, name: LimitName, ratio: float, joint: int | None, t: float, value: float, bound: float
    ) -> None:
        known = self._worst.get(name)
        if known is None or ratio > known.worst_ratio:
            joint_name = None if joint is None else self._joints[joint]
            self._worst[name] = LimitReport(ratio, name, joint_name, t, value, bound)
