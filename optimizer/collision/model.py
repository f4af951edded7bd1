"""Collision model of an arm: bodies, the pairs that are checked, and their signed distances with
gradients.

Everything is computed for many configurations at once. Configurations are q (n, nq) [rad] or the
link frames there, `frames` (n, nq + 1, 4, 4) as `CollisionModel.frames` returns them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from joulepath.models.robot import MOST_ROBOTS, Array, Mask, Robot
from joulepath.optimizer.collision.bodies import Body, Indices, bodies_of
from joulepath.optimizer.collision.pair_distance import PairGeometry, WitnessPoints
from joulepath.optimizer.declared import Metres
from joulepath.optimizer.kinematics.forward import joint_placements, link_frames
from joulepath.optimizer.problem.arm import Arm

# along a motion, the distances at every so many samples are computed first
STRIDE = 6


@dataclass(frozen=True)
class ClosestPair:
    """Two bodies and the distance between them."""

    pair: tuple[str, str]
    """Names of the two bodies: links, `tool`, `payload` or obstacles."""
    distance: Metres
    """Distance between the two bodies minus the obstacle's `margin`; if negative, the two bodies
    are too close or overlap."""


@dataclass(frozen=True)
class PairDistances:
    """Signed distances (n, p) [m] of p pairs at n configurations; k of them are exact.

    `configuration`, `column` (k,) index the exact ones, `nearest` holds their witness points. The
    others are lower bounds.
    """

    distance: Array
    configuration: Indices
    column: Indices
    nearest: WitnessPoints


class CollisionModel:
    """The bodies of an arm, and the `pairs` (p, 2) of them that are checked, the body nearer to the
    base first.

    Two links are checked unless they are adjacent or can never be in collision. Tool and payload
    are checked against all links but those that they touch by design. The scene is checked against
    every moving body. All distances have the margin of the obstacle subtracted.
    """

    def __init__(self, arm: Arm) -> None:
        self.bodies = bodies_of(arm)
        self.pairs = _checked_pairs(arm, self.bodies)
        self.geometry = PairGeometry(self.bodies, self.pairs, arm.robot.nq)
        self.nq = arm.robot.nq
        self._placements = joint_placements(arm.robot.model)
        joints = np.arange(1, self.nq + 1)
        first, second = self.geometry.links[self.pairs].T
        # the joints (p, nq) that move the second body relative to the first
        self.joints_between = (joints > first[:, None]) & (joints <= second[:, None])

    def names(self, pair: int) -> tuple[str, str]:
        """Names of the two bodies of a pair."""
        first, second = self.pairs[pair]
        return self.bodies[first].name, self.bodies[second].name

    def frames(self, q: Array) -> Array:
        """T_base_link (n, nq + 1, 4, 4) for q (n, nq) [rad]."""
        return link_frames(self._placements, q)

    def signed_distances(self, q: Array, within: float = np.inf) -> tuple[Array, Array]:
        """Signed distances (n, p) [m] of every pair at q (n, nq) [rad], and their gradients (n, p,
        nq) [m/rad].

        Pairs whose enclosing balls are farther apart than `within` [m] get the distance of the
        balls, a lower bound, and the gradient zero.
        """
        frames = self.frames(q)
        found = self.pair_distances(frames, within=within)
        gradient = np.zeros((*found.distance.shape, self.nq))
        exact = found.configuration, found.column
        gradient[exact] = self.gradients(frames, *exact, found.nearest)
        return found.distance, gradient

    def pair_distances(
        self,
        frames: Array,
        pairs: Indices | None = None,
        within: float = np.inf,
        known: Array | None = None,
    ) -> PairDistances:
        """Signed distances of `pairs` (p,), by default of every pair, at n configurations.

        They are exact for half-spaces, and for pairs whose lower bounds are at most `within` [m],
        of patches of a cloud only those that are at most `within` apart themselves. `known` (n, p)
        are lower bounds: balls bound only what they leave open.
        """
        pairs = np.arange(len(self.pairs)) if pairs is None else pairs
        distance, configuration, column = self.geometry.bounds(frames, pairs, within, known)
        nearest = self.geometry.witness_points(frames, configuration, pairs[column], within)
        if self.geometry.is_cloud.any() and np.isfinite(within):
            # no part of these patches is within the limit, which is then the better lower bound
            beyond = np.isinf(nearest.distance)
            far = configuration[beyond], column[beyond]
            distance[far] = np.maximum(distance[far], within)
            configuration, column, nearest = (
                configuration[~beyond],
                column[~beyond],
                nearest[~beyond],
            )
        distance[configuration, column] = nearest.distance
        return PairDistances(distance, configuration, column, nearest)

    def along(self, q: Array, within: float, pairs: Indices | None = None) -> Array:
        """Signed distances (n, p) [m] at consecutive samples q (n, nq) [rad] of a motion, exact up
        to `within` [m].

        Those of every STRIDE-th sample bound the others from below, since a distance changes no
        faster than the levers allow. Most of the others need not be computed. Several motions may
        follow one another.
        """
        pairs = np.arange(len(self.pairs)) if pairs is None else pairs
        frames, rows, count = self.frames(q), np.arange(len(q)), len(q)
        if count <= 2 * STRIDE or not len(pairs):
            return self.pair_distances(frames, pairs, within).distance
        chosen = np.append(rows[:-1:STRIDE], count - 1)
        # half of the way between two of them: the median, since the leap from one motion to the
        # next says nothing
        reach = float(np.median(self.changes(np.diff(q[chosen], axis=0), pairs).max(axis=1))) / 2
        result = np.empty((count, len(pairs)))
        result[chosen] = self.pair_distances(frames[chosen], pairs, within + reach).distance
        rest = np.delete(rows, chosen)
        before = chosen[rest // STRIDE]
        after = np.minimum(before + STRIDE, count - 1)
        known = np.maximum(
            *(result[at] - self.changes(q[rest] - q[at], pairs) for at in (before, after))
        )
        result[rest] = self.pair_distances(frames[rest], pairs, within, known).distance
        return result

    def changes(self, move: Array, pairs: Indices) -> Array:
        """Greatest changes (n, p) [m] of the distances of `pairs` (p,) when the joints move by
        `move` (n, nq) [rad].
        """
        return np.asarray(np.abs(move) @ self.levers_between[pairs].T)

    def pairs_within(self, frames: Array, within: float) -> Mask:
        """Which pairs (p,) are less than `within` [m] apart at any of n configurations.

        Most are so where their lower bounds are least: few distances are needed.
        """
        every = np.arange(len(self.pairs))
        bound = self.geometry.bounds(frames, every, within)[0]
        least = bound.argmin(axis=0)
        found = np.zeros(len(every), dtype=bool)
        (near,) = np.nonzero((bound[least, every] < within) & ~self.geometry.is_cloud)
        found[near] = self.geometry.witness_points(frames, least[near], near).distance < within
        (rest,) = np.nonzero((bound[least, every] < within) & ~found)
        found[rest] = (
            self.pair_distances(frames, rest, within, bound[:, rest]).distance < within
        ).any(axis=0)
        return found

    def chosen_distances(self, frames: Array, pairs: Indices, wanted: Mask) -> PairDistances:
        """Exact signed distances of those of `pairs` (p,) that are `wanted` (n, p); the others are
        zero.
        """
        configuration, column = np.nonzero(wanted)
        nearest = self.geometry.witness_points(frames, configuration, pairs[column])
        distance = np.zeros(wanted.shape)
        distance[configuration, column] = nearest.distance
        return PairDistances(distance, configuration, column, nearest)

    def least_distance(self, q: Array, within: float) -> float:
        """The least signed distance [m] over all pairs and q (n, nq) [rad]; if above `within`, a
        lower bound above it.

        Infinite if no pair is checked.
        """
        return float(
            self.pair_distances(self.frames(q), within=within).distance.min(initial=np.inf)
        )

    def closest_pairs(
        self, q: Sequence[Array] | Array, within: float = np.inf
    ) -> list[ClosestPair]:
        """The closest pair at each of q (n, nq) [rad]; an empty list if no pair is checked.

        If no distance is below `within` [m], `distance` is only a lower bound, and the pair may be
        another one.
        """
        if not (len(self.pairs) and len(q)):
            return []
        frames = self.frames(np.asarray(q))
        # configurations that differ by full turns have the same frames: each set of frames is
        # computed once
        rounded = np.round(frames[:, 1:, :3], 9) + 0.0
        rows: dict[bytes, int] = {}
        which = [rows.setdefault(each.tobytes(), len(rows)) for each in rounded]
        distinct = np.unique(which, return_index=True)[1]
        distance = self.pair_distances(frames[distinct], within=within).distance
        closest = distance.argmin(axis=1)
        found = [
            ClosestPair(self.names(int(k)), float(d[k]))
            for k, d in zip(closest, distance, strict=True)
        ]
        return [found[k] for k in which]

    def nearest_points(self, frames: Array, pair: int) -> tuple[list[float], list[float]]:
        """The nearest points [m] of a pair on the surfaces of its first and second body, without
        margins, at the frames (1, nq + 1, 4, 4)."""
        found = self.geometry.witness_points(frames, np.array([0]), np.array([pair]))
        first, second = self.geometry.surface_points(np.array([pair]), found)[0].tolist()
        return first, second

    def gradients(
        self, frames: Array, configuration: Indices, pair: Indices, found: WitnessPoints
    ) -> Array:
        """Gradients (k, nq) [m/rad] of signed distances: n · (axis × (point - origin)) of every
        joint in between.

        By the envelope theorem, the motion of the witness points over the bodies does not
        contribute.
        """
        return self.geometry.gradients(frames, configuration, pair, found)

    @cached_property
    def levers_between(self) -> Array:
        """Levers (p, nq) [m] of the joints between, else 0: a pair's distance changes by no more
        per radian.
        """
        return np.asarray(self.levers() * self.joints_between)

    def levers(self) -> Array:
        """Upper bounds (p, nq) [m], over all configurations, on the distance of a pair's second
        core from each axis.
        """
        offsets = self._placements[:, :3, 3]
        across = np.hypot(offsets[:, 0], offsets[:, 1])
        lengths = np.linalg.norm(offsets, axis=1)
        result = np.zeros((len(self.bodies), self.nq))
        for k, body in enumerate(self.bodies):
            if body.link == 0:
                continue
            radius = body.core.disc_radius
            reach = float(np.linalg.norm(body.points, axis=1).max()) + radius
            result[k, body.link - 1] = (
                float(np.hypot(body.points[:, 0], body.points[:, 1]).max()) + radius
            )
            for joint in range(body.link - 2, -1, -1):
                # the offset of the next joint, in the frame of this one: its part along this axis
                # is no lever
                result[k, joint] = across[joint + 1] + reach
                reach += lengths[joint + 1]
        return np.asarray(result[self.pairs[:, 1]])


def _checked_pairs(arm: Arm, bodies: Sequence[Body]) -> Indices:
    """Indices (p, 2) of the bodies of every checked pair."""
    links = range(len(arm.robot.capsules))
    moving = range(len(arm.robot.capsules) + len(arm.tool) + (arm.payload.shape is not None))
    pairs: list[tuple[int, int]] = []
    for k in moving:
        link = bodies[k].link
        if k in links:
            apart = [
                i
                for i in links
                if link - bodies[i].link > 1
                and (bodies[i].link, link) not in arm.robot.never_in_collision
            ]
        else:
            apart = [i for i in links if bodies[i].link not in bodies[k].touches]
        obstacles = range(len(moving), len(bodies)) if link > 0 else ()
        pairs += [(i, k) for i in (*apart, *obstacles)]
    return np.array(pairs, dtype=np.intp).reshape(-1, 2)


def collision_model(arm: Arm) -> CollisionModel:
    """Collision model of an arm. The model of a robot without tool, payload shape and obstacles is
    cached.
    """
    bare = not (arm.tool or arm.scene.obstacles or arm.payload.shape)
    return _robot_alone(arm.robot) if bare else CollisionModel(arm)


@lru_cache(MOST_ROBOTS)
def _robot_alone(robot: Robot) -> CollisionModel:
    return CollisionModel(Arm(robot=robot))
