"""Which limits a given motion holds, and where it comes nearest to each, or breaks it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from models.robot import Array
from optimizer.kinematics.path_constraints import path_constraints_of
from optimizer.problem.arm import Arm
from optimizer.replay.piecewise_motion import PiecewiseMotion
from optimizer.trajectories.limit_ratios import RATIO_TOLERANCE, ratios

LimitName = Literal["position", "velocity", "acceleration", "jerk", "torque", "tool_cone", "tcp_speed", "elbow_speed"]

# What counts as a jump where pieces meet, as a share of the limit: far above rounding, far below what an arm would feel
SPEED_JUMP, ACCELERATION_JUMP = 1e-6, 1e-4


@dataclass(frozen=True)
class LimitReport:
    """Where a motion comes nearest to a limit, or breaks it most: `ratio` = |value| / limit of `joint` at time `t` [s].

    `joint` is None for limits on the tool and the elbow: angle [rad] and speeds [m/s].
    Position: `ratio` is the distance from the middle of the range over half of it. `value` and `ratio` are infinite
    where the acceleration (speed jumps) or the jerk (acceleration jumps) is.
    """

    limit: LimitName
    ratio: float
    joint: str | None
    t: float
    value: float
    bound: float

    @property
    def held(self) -> bool:
        """Whether the motion holds the limit."""
        return self.ratio <= 1 + RATIO_TOLERANCE


class LimitMonitor:
    """Sees a motion go by and keeps the worst of every limit."""

    def __init__(self, arm: Arm) -> None:
        self._limits, self._joints, self._friction = arm.active_limits, arm.robot.joint_names, arm.friction_law
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
        """Samples: t (k,) [s], the others (k, nq); tau is rigid body and rotor torque [N·m]."""
        tau_motor = tau + self._friction.torque(v)
        limits = self._limits
        middle = (limits.q_max + limits.q_min) / 2
        nearer = np.where(q > middle, limits.q_max, limits.q_min)
        values = {"position": q, "velocity": v, "acceleration": a, "jerk": jerk, "torque": tau_motor}
        bounds = {
            "velocity": limits.v_max, "acceleration": limits.a_max, "jerk": limits.j_max, "torque": limits.tau_max,
        }  # fmt: skip
        for name, ratio in ratios(limits, q, v, a, jerk, tau_motor).items():
            k, j = np.unravel_index(int(np.argmax(ratio)), ratio.shape)
            bound = nearer[k, j] if name == "position" else bounds[name][j]
            self._note(name, float(ratio[k, j]), int(j), float(t[k]), float(values[name][k, j]), float(bound))  # type: ignore[arg-type]

        if self._path is not None:
            shares = self._path.ratios(q, v)
            for path_name, share, at in zip(self._path.names, shares.max(axis=0), shares.argmax(axis=0), strict=True):
                bound = self._path_bounds[path_name]
                self._note(path_name, float(share), None, float(t[at]), float(share) * bound, bound)  # type: ignore[arg-type]

    def see_breaks(self, pieces: PiecewiseMotion, before: PiecewiseMotion | None) -> npt.NDArray[np.int64]:
        """Where pieces meet. Returns those of the pieces (indices) at whose start the speed jumps."""
        piece = np.arange(len(pieces.segment))
        _, v_end, a_end, _ = pieces.at(piece, np.diff(pieces.breaks))
        _, v, a, _ = pieces.at(piece, np.zeros(len(piece)))
        if before is None:
            v_before, a_before = v[:1], a[:1]
        else:
            last = np.array([len(before.segment) - 1])
            _, v_before, a_before, _ = before.at(last, np.diff(before.breaks)[last])
        limits = self._limits
        speed_jump = np.abs(v - np.concatenate([v_before, v_end[:-1]])) / limits.v_max
        jump = np.abs(a - np.concatenate([a_before, a_end[:-1]])) / limits.a_max
        self._note_jump("acceleration", speed_jump > SPEED_JUMP, pieces.breaks, limits.a_max)
        self._note_jump("jerk", (speed_jump > SPEED_JUMP) | (jump > ACCELERATION_JUMP), pieces.breaks, limits.j_max)
        return np.flatnonzero((speed_jump > SPEED_JUMP).any(axis=1))

    def report(self) -> list[LimitReport]:
        """The worst of every limit."""
        return list(self._worst.values())

    def _note_jump(self, name: LimitName, jumps: npt.NDArray[np.bool_], t: Array, bounds: Array) -> None:
        jumps = jumps & np.isfinite(bounds)  # where none is in force, a jump breaks nothing
        if jumps.any():
            k, j = np.argwhere(jumps)[0].tolist()
            self._note(name, np.inf, j, float(t[k]), np.inf, float(bounds[j]))

    def _note(self, name: LimitName, ratio: float, joint: int | None, t: float, value: float, bound: float) -> None:
        known = self._worst.get(name)
        if known is None or ratio > known.ratio:
            self._worst[name] = LimitReport(
                name, ratio, None if joint is None else self._joints[joint], t, value, bound
            )
