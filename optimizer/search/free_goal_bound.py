"""A lower bound on the motions to a goal whose orientation is free in part: to all of its configurations at once.

The orientation decides what the last three joints do; the bound leaves these their freedom and looks at the first
three. Branch and bound over boxes of (q1, q2, q3): a box that cannot bring the fourth joint's origin near enough to the
goal, or not far enough from it, holds no configuration; of any other, the joints displacement at least to the box,
and the potential_gain is at least its potential_gain less what the links can still sink. `lower_bounds` of the least
displacement and the least potential_gain
then bounds every motion into the box, since it falls with neither. The least over all boxes bounds the family.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np

from models.robot import Array
from optimizer.deadline import NEVER, Deadline
from optimizer.energy.dwell import holding_power
from optimizer.kinematics.forward import joint_placements
from optimizer.kinematics.tcp import T_last_tcp
from optimizer.prepared_problem import PreparedProblem
from optimizer.problem.cone_oriented_pose import ConeOrientedPose
from optimizer.search.candidates import Candidate
from optimizer.search.lower_bound import lower_bounds

INNER = 3
# boxes along each joint at first, boxes split in a round, rounds
FIRST_BOXES, SPLIT, ROUNDS = 4, 160, 20
# a side is never split below this [rad]
SMALLEST = 0.01
# angles along the fifth and sixth joint at which the wrist's reach is looked at; between them it is given a margin
REACH_ANGLES = 240
# points on the tool's axis, from the TCP [m], whose distance from the fourth joint is bounded where a cone holds them
ANCHORS = (0.0, -0.05, 0.05, -0.1, 0.1, -0.2, 0.2, -0.3, 0.3)


def family_bound_of(prepared: PreparedProblem, candidates: Sequence[Candidate], deadline: Deadline) -> float:
    """Bound of the motions to those goals whose orientation is free in part [J]; inf where there are none."""
    poses = {e.goal.target: e.goal.tolerance for e in candidates if e.goal.tolerance is not None}
    starts = np.array(list({id(e.start): e.start.q for e in candidates}.values()))
    rounds = ROUNDS // max(len(poses), 1)
    return min((family_bound(prepared, pose, starts, rounds, deadline) for pose in poses.values()), default=np.inf)


def family_bound(
    prepared: PreparedProblem, pose: ConeOrientedPose, starts: Array, rounds: int = ROUNDS, deadline: Deadline = NEVER
) -> float:
    """What no motion from any of `starts` (s, nq) to any configuration of `pose` can go below [J].

    Fewer rounds, or a deadline, give a weaker bound.
    """
    family = _Family(prepared, pose)
    side = np.pi / FIRST_BOXES
    centres = np.array(list(product(-np.pi + side * (2 * np.arange(FIRST_BOXES) + 1), repeat=INNER)))
    origin = np.repeat(np.arange(len(starts)), len(centres))
    centres = np.tile(centres, (len(starts), 1))
    halves = np.full_like(centres, side)
    potential_gains = np.array([prepared.potential(q) for q in starts])
    value = family.bounds(starts[origin], potential_gains[origin], centres, halves)
    for _ in range(rounds):
        # what holds no configuration is let go
        kept = np.isfinite(value)
        origin, centres, halves, value = origin[kept], centres[kept], halves[kept], value[kept]
        order = np.argsort(value, kind="stable")
        worst, rest = order[:SPLIT], order[SPLIT:]
        if not len(order) or halves[order[0]].max() < SMALLEST or deadline.passed:
            break
        # the side that blurs the fourth joint's place most
        widest = (halves[worst] * family.arms).argmax(axis=1)
        step = np.zeros((len(worst), INNER))
        step[np.arange(len(worst)), widest] = halves[worst, widest] / 2
        parents = np.concatenate([worst, worst])
        fresh = np.concatenate([centres[worst] - step, centres[worst] + step])
        smaller = halves[parents] - np.concatenate([step, step])
        # a part's bound is at least the whole's
        bounds = family.bounds(starts[origin[parents]], potential_gains[origin[parents]], fresh, smaller)
        value = np.concatenate([value[rest], np.maximum(bounds, value[parents])])
        origin = np.concatenate([origin[rest], origin[parents]])
        centres, halves = np.concatenate([centres[rest], fresh]), np.concatenate([halves[rest], smaller])
    return float(value.min(initial=np.inf))


@dataclass(frozen=True)
class _Family:
    """The configurations that reach a pose with any orientation that it allows."""

    prepared: PreparedProblem
    pose: ConeOrientedPose

    def bounds(self, starts: Array, potentials: Array, centres: Array, halves: Array) -> Array:
        """Bounds (b,) [J] on motions from starts (b, nq) into boxes (b, 3); inf where a box holds no configuration."""
        wrist, height = self._placed(centres)
        blur = halves @ self.arms
        value = np.full(len(centres), np.inf)
        inside = np.ones(len(centres), dtype=bool)
        for place, least, most in self._shells:
            distance = np.linalg.norm(wrist - place, axis=1)
            inside &= (distance - blur <= most) & (distance + blur >= least)
        if inside.any():
            away = starts[inside, :INNER] - centres[inside]
            away = np.abs(away - 2 * np.pi * np.round(away / (2 * np.pi)))
            displacement = np.zeros((int(inside.sum()), starts.shape[1]))
            displacement[:, :INNER] = np.maximum(away - halves[inside], 0.0)
            lowest = height[inside] - halves[inside] @ self._leverage
            hanging = -wrist[inside] @ self._gravity - blur[inside] * np.linalg.norm(self._gravity)
            for mass, from_wrist, floor in self._wrist_bodies:
                # as low as it can hang from the fourth joint, and as low as it can be about the goal
                lowest += mass * np.maximum(hanging - from_wrist * np.linalg.norm(self._gravity), floor)
            potential_gain = lowest - potentials[inside]
            if self.prepared.problem.objective == "mechanical":
                potential_gain = np.maximum(potential_gain, 0.0)  # that bound is |potential_gain|, which is no less
            hold = np.full_like(potential_gain, self._least_hold)
            value[inside], _ = lower_bounds(self.prepared, displacement, potential_gain, hold)
        return value

    @cached_property
    def _least_hold(self) -> float:
        """What standing still draws at least [W]: with no torque to hold."""
        return float(holding_power(self.prepared.arm, np.zeros(self.prepared.problem.arm.robot.nq)))

    @property
    def _gravity(self) -> Array:
        return np.asarray(self.prepared.problem.arm.gravity)

    @cached_property
    def _placements(self) -> Array:
        return joint_placements(self.prepared.model)

    @cached_property
    def arms(self) -> Array:
        """How far the fourth joint's origin is from each of the first three at most [m]."""
        lengths = np.linalg.norm(self._placements[1 : INNER + 1, :3, 3], axis=1)
        return np.asarray(np.cumsum(lengths[::-1])[::-1])

    @cached_property
    def _leverage(self) -> Array:
        """How fast the potential energy of the first three links can change with each of their joints [N·m]."""
        lengths = np.linalg.norm(self._placements[1:INNER, :3, 3], axis=1)
        weights = np.zeros(INNER)
        for k in range(INNER):
            body = self.prepared.model.inertias[k + 1]
            for j in range(k + 1):
                weights[j] += body.mass * (float(np.linalg.norm(body.lever)) + float(lengths[j:k].sum()))
        return weights * float(np.linalg.norm(self._gravity))

    def _placed(self, q: Array) -> tuple[Array, Array]:
        """Origin of the fourth joint (b, 3) [m], and potential energy of the first three links (b,) [J]."""
        T = np.tile(np.eye(4), (len(q), 1, 1))
        height = np.zeros(len(q))
        for j in range(INNER):
            T = T @ self._placements[j] @ _about_z(q[:, j])
            body = self.prepared.model.inertias[j + 1]
            height -= body.mass * (T[:, :3, :3] @ body.lever + T[:, :3, 3]) @ self._gravity
        return (T @ self._placements[INNER])[:, :3, 3], height

    @cached_property
    def _tool(self) -> tuple[Array, Array]:
        """T_last_tcp (4, 4), and the TCP's chain: lengths [m] from the fourth joint to the fifth and to the sixth."""
        lengths = np.linalg.norm(self._placements[INNER + 1 :, :3, 3], axis=1)
        return T_last_tcp(self.prepared.problem.arm), np.asarray(lengths)

    @cached_property
    def _shells(self) -> list[tuple[Array, float, float]]:
        """Points (3,) [m], and how near to each and how far from it the fourth joint's origin must lie [m].

        A point on the tool's axis at s from the TCP lies within 2 |s| sin(half_angle / 2) of its place with the axis
        along the direction. Turning the fourth joint does not change its distance from that joint's origin.
        """
        T_last_tcp, lengths = self._tool
        angles = 2 * np.pi * np.arange(REACH_ANGLES) / REACH_ANGLES
        fifth = self._placements[INNER + 1] @ _about_z(angles) @ self._placements[INNER + 2]
        shells = []
        for s in ANCHORS if self.pose.half_angle < np.pi / 2 else (0.0,):
            anchor = T_last_tcp[:3, 3] + s * (T_last_tcp[:3, :3] @ self.pose.axis)
            turned = np.append(anchor, 1.0) @ _about_z(angles).transpose(0, 2, 1)
            reach = np.linalg.norm((turned @ fifth.transpose(0, 2, 1))[..., :3], axis=-1)
            length = float(np.linalg.norm(anchor))
            slack = np.pi / REACH_ANGLES * (2 * length + float(lengths[1])) + 1e-9
            slack += 2 * abs(s) * float(np.sin(self.pose.half_angle / 2))
            place = self.pose.position + s * self.pose.direction
            shells.append((place, float(reach.min()) - slack, float(reach.max()) + slack))
        return shells

    @cached_property
    def _wrist_bodies(self) -> list[tuple[float, float, float]]:
        """Per body beyond the fourth joint: mass [kg], farthest from that joint [m], least potential about the goal
        [J/kg]."""
        T_last_tcp, lengths = self._tool
        g, strength = self._gravity, float(np.linalg.norm(self._gravity))
        tcp = float(np.linalg.norm(T_last_tcp[:3, 3]))
        bodies = [self.prepared.model.inertias[k] for k in range(INNER + 1, self.prepared.problem.arm.robot.nq + 1)]
        levers = [float(np.linalg.norm(body.lever)) for body in bodies]
        at_goal = -float(self.pose.position @ g)
        # the last body stands still in the TCP frame: along the axis it cannot turn further than the cone lets it
        offset = T_last_tcp[:3, :3].T @ (bodies[-1].lever - T_last_tcp[:3, 3])
        along = float(offset @ self.pose.axis)
        across = float(np.linalg.norm(offset - along * self.pose.axis))
        turn = 2 * float(np.sin(self.pose.half_angle / 2))
        upright = -along * float(self.pose.direction @ g) - strength * (abs(along) * turn + across)
        floors = [
            at_goal - strength * (levers[0] + float(lengths.sum()) + tcp),
            at_goal - strength * (levers[1] + float(lengths[1]) + tcp),
            at_goal + max(upright, -strength * float(np.linalg.norm(offset))),
        ]
        from_wrist = [levers[k] + float(lengths[:k].sum()) for k in range(len(bodies))]
        return [(body.mass, far, floor) for body, far, floor in zip(bodies, from_wrist, floors, strict=True)]


def _about_z(angle: Array) -> Array:
    """Rotations (n, 4, 4) about z."""
    T = np.tile(np.eye(4), (len(angle), 1, 1))
    T[:, 0, 0] = T[:, 1, 1] = np.cos(angle)
    T[:, 1, 0] = np.sin(angle)
    T[:, 0, 1] = -T[:, 1, 0]
    return T
