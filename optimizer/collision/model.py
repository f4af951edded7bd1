"""Collision model of an arm: bodies, checked pairs, and signed distances with gradients.

Everything is computed for many configurations at once. Configurations are q (n, nq) [rad] or the
link frames there, `frames` (n, nq + 1, 4, 4) as returned by `CollisionModel.frames`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from joulepath.models.robot import MOST_ROBOTS, Array, Mask, Robot
from joulepath.optimizer.collision.bodies import Body, Indices, bodies_of
from joulepath.optimizer.collision.compiled_distances import ClearanceCheck
from joulepath.optimizer.collision.pair_distance import PairGeometry, WitnessPoints
from joulepath.optimizer.declared import Metres
from joulepath.optimizer.kinematics.forward import joint_placements, link_frames
from joulepath.optimizer.problem.arm import TOOL, Arm


@dataclass(frozen=True)
class ClosestPair:
    """Two bodies and the distance between them."""

    pair: tuple[str, str]
    """Names of the two bodies: links, `tool`, `payload` or obstacles."""
    distance: Metres
    """Distance between the two bodies minus the obstacle's `margin`; if negative, the two bodies
    are too close or overlap.
    """


@dataclass(frozen=True)
class PairDistances:
    """Signed distances (n, p) [m] of p pairs at n configurations; k of them are exact, the others
    are lower bounds.

    `configuration` and `column` (k,) index the exact distances, and `nearest` holds their witness
    points.
    """

    distance: Array
    configuration: Indices
    column: Indices
    nearest: WitnessPoints


class CollisionModel:
    """Bodies of an arm, and the checked `pairs` (p, 2) of bodies, in order from the base.

    Two links are checked unless they are adjacent or can never be in collision. Tool and payload
    are checked against all links except the links that they touch by design. Links are represented
    by their capsules, or by their hulls (`Robot.links_by_hulls`). The scene is checked
    against every moving body; of a link or a tool with hulls, these are checked, except against
    clouds, and its capsules otherwise. All distances have the margin of the obstacle subtracted.
    """

    def __init__(self, arm: Arm) -> None:
        self.bodies = bodies_of(arm)
        self.pairs = _checked_pairs(arm, self.bodies)
        self.nq, self.coupling = arm.robot.nq, arm.robot.coupling
        self._placements = joint_placements(arm.robot.model)
        self.geometry = PairGeometry(self.bodies, self.pairs, len(self._placements))
        joints = np.arange(1, len(self._placements) + 1)
        first, second = self.geometry.links[self.pairs].T
        # Joints of the chain (p, n) that move the second body relative to the first.
        self.joints_between = (joints > first[:, None]) & (joints <= second[:, None])

    def names(self, pair: int) -> tuple[str, str]:
        """Names of the two bodies of a pair."""
        first, second = self.pairs[pair]
        return self.bodies[first].name, self.bodies[second].name

    def frames(self, q: Array) -> Array:
        """T_base_link (n, nq + 1, 4, 4) for q (n, nq) [rad]."""
        return link_frames(self._placements, self.coupling.positions(q))

    def clearance_check(self, reserve: float) -> ClearanceCheck:
        """A check whether all pairs without clouds are at least `reserve` [m] apart, for one
        configuration or line after the other.
        """
        return self.geometry.clearance_check(self._placements, self.levers_between, reserve)

    def signed_distances(self, q: Array, within: float = np.inf) -> tuple[Array, Array]:
        """Signed distances (n, p) [m] of every pair at q (n, nq) [rad], and their gradients (n, p,
        nq) [m/rad].

        Pairs whose enclosing balls are farther apart than `within` [m] get the distance of the
        balls, a lower bound, and the gradient zero.
        """
        frames = self.frames(q)
        distances = self.pair_distances(frames, within=within)
        gradient = np.zeros((*distances.distance.shape, self.nq))
        exact = distances.configuration, distances.column
        gradient[exact] = self.gradients(frames, *exact, distances.nearest)
        return distances.distance, gradient

    def pair_distances(
        self,
        frames: Array,
        pairs: Indices | None = None,
        within: float = np.inf,
        known: Array | None = None,
    ) -> PairDistances:
        """Signed distances of pairs at n configurations.

        Exact are the distances of half-spaces, and of pairs with lower bounds of at most `within`;
        those of clouds, and of convex bodies without a closed form, only up to `within`.

        Args:
            frames: link frames.
            pairs: pairs (p,), by default every pair.
            within: limit of exact distances [m].
            known: lower bounds (n, p) [m]; balls are used only if these do not exceed `within`.
        """
        pairs = np.arange(len(self.pairs)) if pairs is None else pairs
        distance, configuration, column = self.geometry.bounds(frames, pairs, within, known)
        nearest = self.geometry.witness_points(frames, configuration, pairs[column], within)
        beyond = np.isinf(nearest.distance)
        if beyond.any():
            # These bodies are not within the limit, so the limit is the better lower bound.
            far = configuration[beyond], column[beyond]
            distance[far] = np.maximum(distance[far], np.nextafter(within, np.inf))
            configuration, column, nearest = (
                configuration[~beyond],
                column[~beyond],
                nearest[~beyond],
            )
        distance[configuration, column] = nearest.distance
        return PairDistances(distance, configuration, column, nearest)

    def distances_along(
        self, q: Array, within: float, pairs: Indices | None = None, stride: int = 6
    ) -> Array:
        """Signed distances (n, p) [m] at consecutive samples q (n, nq) [rad] of a motion, exact up
        to `within` [m].

        The distances at every `stride`-th sample bound the others from below, since a distance
        changes no faster than the levers allow. Most of the others need not be computed. The
        samples may be those of several consecutive motions.
        """
        pairs = np.arange(len(self.pairs)) if pairs is None else pairs
        frames, rows, count = self.frames(q), np.arange(len(q)), len(q)
        if count <= 2 * stride or not len(pairs):
            return self.pair_distances(frames, pairs, within).distance
        chosen = np.append(rows[:-1:stride], count - 1)
        # Half of the change between two chosen samples: the median, which ignores the jump from one
        # motion to the next.
        changes = self.greatest_changes(np.diff(q[chosen], axis=0), pairs).max(axis=1)
        reach = float(np.median(changes)) / 2
        result = np.empty((count, len(pairs)))
        result[chosen] = self.pair_distances(frames[chosen], pairs, within + reach).distance
        rest = np.delete(rows, chosen)
        before = chosen[rest // stride]
        after = np.minimum(before + stride, count - 1)
        known = np.maximum(
            *(result[at] - self.greatest_changes(q[rest] - q[at], pairs) for at in (before, after))
        )
        result[rest] = self.pair_distances(frames[rest], pairs, within, known).distance
        return result

    def greatest_changes(self, move: Array, pairs: Indices) -> Array:
        """Greatest changes (n, p) [m] of the distances of `pairs` (p,) under joint displacements
        `move` (n, nq) [rad].
        """
        return np.asarray(np.abs(self.coupling.rates(move)) @ self.levers_between[pairs].T)

    def pairs_within(self, frames: Array, within: float) -> Mask:
        """Mask (p,) of pairs less than `within` [m] apart at any of n configurations.

        Most of these pairs are that near at the configuration with their least lower bound, so few
        distances are needed.
        """
        every = np.arange(len(self.pairs))
        bound = self.geometry.bounds(frames, every, within)[0]
        closest = bound.argmin(axis=0)
        is_within = np.zeros(len(every), dtype=bool)
        (near,) = np.nonzero((bound[closest, every] < within) & ~self.geometry.is_cloud)
        is_within[near] = (
            self.geometry.witness_points(frames, closest[near], near, within).distance < within
        )
        (undecided,) = np.nonzero((bound[closest, every] < within) & ~is_within)
        is_within[undecided] = (
            self.pair_distances(frames, undecided, within, bound[:, undecided]).distance < within
        ).any(axis=0)
        return is_within

    def chosen_distances(self, frames: Array, pairs: Indices, wanted: Mask) -> PairDistances:
        """Exact signed distances of the `wanted` (n, p) among `pairs` (p,); the others are zero."""
        configuration, column = np.nonzero(wanted)
        nearest = self.geometry.witness_points(frames, configuration, pairs[column])
        distance = np.zeros(wanted.shape)
        distance[configuration, column] = nearest.distance
        return PairDistances(distance, configuration, column, nearest)

    def least_distance(self, q: Array, within: float) -> float:
        """Least signed distance [m] over all pairs and q (n, nq) [rad], or a lower bound above
        `within`.

        It is infinite if no pair is checked.
        """
        return float(
            self.pair_distances(self.frames(q), within=within).distance.min(initial=np.inf)
        )

    def closest_pairs(
        self, q: Sequence[Array] | Array, within: float = np.inf
    ) -> list[ClosestPair]:
        """Closest pair at every q (n, nq) [rad]; an empty list if no pair is checked.

        If no distance is below `within` [m], `distance` is only a lower bound, and another pair may
        be closer.
        """
        if not (len(self.pairs) and len(q)):
            return []
        frames = self.frames(np.asarray(q))
        # Configurations that differ by full turns have the same frames, and these are computed
        # once.
        rounded = np.round(frames[:, 1:, :3], 9) + 0.0
        rows: dict[bytes, int] = {}
        row_of = [rows.setdefault(frame.tobytes(), len(rows)) for frame in rounded]
        distinct = np.unique(row_of, return_index=True)[1]
        distance = self.pair_distances(frames[distinct], within=within).distance
        closest = distance.argmin(axis=1)
        pairs = [
            ClosestPair(self.names(int(k)), float(d[k]))
            for k, d in zip(closest, distance, strict=True)
        ]
        return [pairs[k] for k in row_of]

    def nearest_points(self, frames: Array, pair: int) -> tuple[list[float], list[float]]:
        """Nearest points [m] of a pair on the surfaces of its first and second body, without
        margins, at the frames (1, nq + 1, 4, 4).
        """
        witness = self.geometry.witness_points(frames, np.array([0]), np.array([pair]))
        first, second = self.geometry.surface_points(np.array([pair]), witness)[0].tolist()
        return first, second

    def gradients(
        self, frames: Array, configuration: Indices, pair: Indices, witness: WitnessPoints
    ) -> Array:
        """Gradients (k, nq) [m/rad] of signed distances: n · (axis × (point - origin)) for every
        joint between the two bodies.

        By the envelope theorem, the motion of the witness points over the bodies does not
        contribute.
        """
        return self.coupling.on_arm(self.geometry.gradients(frames, configuration, pair, witness))

    @cached_property
    def levers_between(self) -> Array:
        """Levers (p, n) [m] of the chain's joints between the bodies of a pair: greatest changes of
        the pair's distance per radian. Those of other joints are zero.
        """
        return np.asarray(self.levers() * self.joints_between)

    def levers(self) -> Array:
        """Upper bounds (p, n) [m], over all configurations, on the distance of a pair's second
        core from the axis of every joint of the chain.
        """
        offsets = self._placements[:, :3, 3]
        across = np.hypot(offsets[:, 0], offsets[:, 1])
        lengths = np.linalg.norm(offsets, axis=1)
        result = np.zeros((len(self.bodies), len(self._placements)))
        for k, body in enumerate(self.bodies):
            if body.link == 0:
                continue
            radius = body.core.disc_radius
            reach = float(np.linalg.norm(body.points, axis=1).max()) + radius
            result[k, body.link - 1] = (
                float(np.hypot(body.points[:, 0], body.points[:, 1]).max()) + radius
            )
            for joint in range(body.link - 2, -1, -1):
                # Offset of the next joint in the frame of this joint; its part along the axis is no
                # lever.
                result[k, joint] = across[joint + 1] + reach
                reach += lengths[joint + 1]
        return np.asarray(result[self.pairs[:, 1]])


def _checked_pairs(arm: Arm, bodies: Sequence[Body]) -> Indices:
    """Indices (p, 2) of the bodies of every checked pair."""
    robot = arm.robot
    links = _compared_between_links(robot, bodies)
    of_arm = [k for k, body in enumerate(bodies) if body.link > 0 or k in links]
    obstacles = [
        k
        for k, body in enumerate(bodies)
        if body.link == 0 and k >= len(robot.capsules) and not body.is_hull
    ]
    hulled, tool_has_hulls = {h.link for h in robot.hulls}, any(p.is_hull for p in arm.tool)
    pairs: list[tuple[int, int]] = []
    for k in of_arm:
        body = bodies[k]
        if k in links:
            others = [
                i
                for i in links
                if body.link - bodies[i].link > 1
                and (bodies[i].link, body.link) not in robot.never_in_collision
            ]
        elif body.is_hull or k < len(robot.capsules):
            others = []
        else:
            others = [i for i in links if bodies[i].link not in body.touches]
        if body.link > 0:
            # by numbers, since the link of the flange may be called as the tool
            is_of_link = k < len(robot.capsules)
            has_hulls = body.link in hulled if is_of_link else tool_has_hulls and body.name == TOOL
            replaced = has_hulls and not body.is_hull
            others += [
                i for i in obstacles if not (replaced if bodies[i].cloud is None else body.is_hull)
            ]
        pairs += [(i, k) for i in others]
    return np.array(pairs, dtype=np.intp).reshape(-1, 2)


def _compared_between_links(robot: Robot, bodies: Sequence[Body]) -> list[int]:
    """Indices of the bodies by which links are compared with each other, with tool and payload."""
    by_hulls = robot.links_by_hulls
    capsules = [k for k, capsule in enumerate(robot.capsules) if capsule.link not in by_hulls]
    # the hulls of links precede those of a tool
    hulls = [k for k, body in enumerate(bodies) if body.is_hull][: len(robot.hulls)]
    return capsules + [k for k in hulls if bodies[k].link in by_hulls]


def collision_model(arm: Arm) -> CollisionModel:
    """Collision model of an arm. The model of a robot without tool, payload shape and obstacles is
    cached.
    """
    bare = not (arm.tool or arm.scene.obstacles or arm.payload.shape)
    return _robot_alone(arm.robot) if bare else CollisionModel(arm)


@lru_cache(MOST_ROBOTS)
def _robot_alone(robot: Robot) -> CollisionModel:
    return CollisionModel(Arm(robot=robot))
