"""What of an arm can hit what: bodies, pairs, and signed distances with gradients over many configurations at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from models.robot import Array, Robot
from optimizer.collision.bodies import Indices, bodies_of
from optimizer.collision.closed_form_distance import box_segment, segment_segment
from optimizer.collision.coal_distance import ConvexPairs
from optimizer.kinematics.forward import joint_placements, link_frames
from optimizer.problem.arm import Arm


@dataclass(frozen=True)
class ClosestPair:
    """The pair of bodies that is nearest: `distance` [m] less the margin asked for, below zero by how deep they are."""

    pair: tuple[str, str]
    distance: float


@dataclass(frozen=True)
class WitnessPoints:
    """Of k pairs: signed distance (k,) [m], unit normal (k, 3) from first to second, a point (k, 3) of its line."""

    distance: Array
    normal: Array
    point: Array


@dataclass(frozen=True)
class PairDistances:
    """Of p pairs at n configurations: distances (n, p) [m], and which k of them are exact: configuration and column.

    The others are the bounding balls', which are less than the bodies'.
    """

    distance: Array
    configuration: Indices
    column: Indices
    nearest: WitnessPoints


class CollisionModel:
    """An arm's bodies and the pairs of them that are compared, `pairs` (p, 2), the less moved body first.

    Links are compared unless they are neighbours or cannot meet; what the flange carries with every link but the last
    two, next to which it is; the surroundings with all that moves. Distances are less the obstacle's margin.
    """

    def __init__(self, arm: Arm) -> None:
        self.bodies = bodies_of(arm)
        self._placements = joint_placements(arm.robot.model)
        self.nq = arm.robot.nq
        own = range(len(arm.robot.capsules))
        moved = range(len(self.bodies) - len(arm.scene.obstacles))
        pairs = []
        for k in moved:
            link = self.bodies[k].link
            # next to each other, or never near each other
            apart = [i for i in own if link - self.bodies[i].link > 1]
            if k in own:
                apart = [i for i in apart if (self.bodies[i].link, link) not in arm.robot.never_in_collision]
            around = range(len(moved), len(self.bodies)) if link > 0 else ()
            pairs += [(i, k) for i in (*apart, *around)]
        self.pairs: Indices = np.array(pairs, dtype=np.intp).reshape(-1, 2)
        self._prepare()

    def _prepare(self) -> None:
        bodies, pairs = self.bodies, self.pairs
        most = max((len(body.points) for body in bodies), default=0)
        # shorter cores repeat their last point
        self._points = np.array([np.pad(b.points, ((0, most - len(b.points)), (0, 0)), mode="edge") for b in bodies])
        self._axes = np.array([body.T_link_core[:3, 2] for body in bodies])
        self._ring = np.array([body.core.ring for body in bodies])
        self._middles = np.array([body.middle for body in bodies]).reshape(-1, 3)
        self._reach = np.array([body.reach for body in bodies])
        self.links: Indices = np.array([body.link for body in bodies], dtype=np.intp)
        self._half = np.array([body.core.half if body.core.half is not None else np.zeros(3) for body in bodies])
        self._T_link_core = np.array([body.T_link_core for body in bodies])
        swelling = np.array([body.core.radius + body.margin for body in bodies])
        self._swelling = swelling[pairs].sum(axis=1)
        joints = np.arange(1, self.nq + 1)
        first, second = self.links[pairs].T
        # which joints move the second body against the first
        self.between = (joints > first[:, None]) & (joints <= second[:, None])
        segment = np.array([body.is_segment for body in bodies], dtype=bool)[pairs]
        box = np.array([body.core.half is not None for body in bodies], dtype=bool)[pairs]
        self._plane = plane = np.array([body.core.plane for body in bodies], dtype=bool)[pairs][:, 0]
        # 0: segments, 1: box and segment, 2: segment and box, 3: half-space, 4: any other
        self._kinds = np.select(
            [plane, segment.all(axis=1), box[:, 0] & segment[:, 1], segment[:, 0] & box[:, 1]], [3, 0, 1, 2], 4
        )
        self.closed_form = self._kinds < 4
        self._convex = ConvexPairs([body.core for body in bodies])

    def names(self, pair: int) -> tuple[str, str]:
        """Names of a pair's bodies."""
        first, second = self.pairs[pair]
        return self.bodies[first].name, self.bodies[second].name

    def frames(self, q: Array) -> Array:
        """T_base_link (n, nq + 1, 4, 4) for q (n, nq) [rad]."""
        return link_frames(self._placements, q)

    def distances(self, q: Array, within: float = np.inf) -> tuple[Array, Array]:
        """Signed distances (n, p) [m] of every pair at q (n, nq) and their gradients (n, p, nq) [m/rad].

        Pairs whose bounding balls are further apart than `within` [m] get the balls' distance instead, which is less.
        """
        frames = self.frames(q)
        found = self.pair_distances(frames, within=within)
        gradient = np.zeros((*found.distance.shape, self.nq))
        exact = found.configuration, found.column
        gradient[exact] = self.gradients(frames, *exact, found.nearest)
        return found.distance, gradient

    def pair_distances(self, frames: Array, pairs: Indices | None = None, within: float = np.inf) -> PairDistances:
        """Signed distances of `pairs` (p,), or of every pair, at every one of `frames` (n, nq + 1, 4, 4).

        Exact are those of the pairs whose bounding balls are at most `within` [m] apart.
        """
        pairs = np.arange(len(self.pairs)) if pairs is None else pairs
        first, second = self.pairs[pairs].T
        T = frames[:, self.links]
        middles = (T[..., :3, :3] @ self._middles[:, :, None])[..., 0] + T[..., :3, 3]
        across = middles[:, second] - middles[:, first]
        distance = np.sqrt(np.einsum("npi,npi->np", across, across))
        distance -= self._reach[first] + self._reach[second] + self._swelling[pairs]
        # no ball holds a half-space
        distance[:, self._plane[pairs]] = -np.inf
        configuration, column = np.nonzero(distance <= within)
        nearest = self.nearest(frames, configuration, pairs[column])
        distance[configuration, column] = nearest.distance
        return PairDistances(distance, configuration, column, nearest)

    def least(self, q: Array, within: float) -> float:
        """The least distance [m] over all pairs at q (n, nq), or, where it exceeds `within`, something above that."""
        return float(self.pair_distances(self.frames(q), within=within).distance.min(initial=np.inf))

    def contacts(self, q: Sequence[Array] | Array, within: float = np.inf) -> list[ClosestPair]:
        """The nearest pair at each of q (n, nq): none at all where nothing is compared.

        Where nothing is nearer than `within` [m], only a lower bound on the distance is found, and not always the pair.
        """
        if not (len(self.pairs) and len(q)):
            return []
        frames = self.frames(np.asarray(q))
        # many of them differ by full turns alone, which move nothing
        moved = (np.round(frames[:, 1:, :3], 9) + 0.0).reshape(len(frames), -1)
        _, first, which = np.unique(moved, axis=0, return_index=True, return_inverse=True)
        distance = self.pair_distances(frames[first], within=within).distance
        nearest = distance.argmin(axis=1)
        contacts = [ClosestPair(self.names(int(k)), float(d[k])) for k, d in zip(nearest, distance, strict=True)]
        return [contacts[k] for k in which.ravel()]

    def gradients(self, frames: Array, configuration: Indices, pair: Indices, found: WitnessPoints) -> Array:
        """Derivatives (k, nq) of distances by the joints: n · (axis × (point - origin)) of every joint in between.

        The nearest points' own shift over the bodies does not count: the distance is stationary in it.
        """
        axes, origins = frames[:, 1:, :3, 2], frames[:, 1:, :3, 3]
        moment = np.cross(found.point, found.normal)
        turning = np.einsum("kji,ki->kj", axes[configuration], moment)
        turning -= np.einsum("kji,ki->kj", np.cross(axes, origins)[configuration], found.normal)
        return np.asarray(turning * self.between[pair])

    def nearest(self, frames: Array, configuration: Indices, pair: Indices) -> WitnessPoints:
        """Distances of pairs (k,) at configurations (k,) of `frames`."""
        first, second = self.pairs[pair].T
        k = len(pair)
        result = WitnessPoints(np.empty(k), np.empty((k, 3)), np.empty((k, 3)))
        kinds = self._kinds[pair]
        handlers = (self._segments, self._box_first, self._box_second, self._planes, self._others)
        for kind, handler in enumerate(handlers):
            chosen = np.flatnonzero(kinds == kind)
            if chosen.size:
                found = handler(frames, configuration[chosen], first[chosen], second[chosen])
                result.distance[chosen], result.normal[chosen], result.point[chosen] = found
        result.distance[:] -= self._swelling[pair]
        return result

    def separation(self, frames: Array, configuration: Indices, pair: Indices, normal: Array) -> Array:
        """min over the second body of n·x less max over the first of n·x (k,) [m] for unit n (k, 3) in the base frame.

        Never more than the signed distance, whatever n is; for a half-space n must be its own.
        """
        first, second = self.pairs[pair].T
        gap = self._least(frames, configuration, second, normal) + self._least(frames, configuration, first, -normal)
        return np.asarray(gap - self._swelling[pair])

    def levers(self) -> Array:
        """How far any point of a pair's second core can be from each joint's axis, at any configuration (p, nq) [m]."""
        offsets = self._placements[:, :3, 3]
        across = np.hypot(offsets[:, 0], offsets[:, 1])
        lengths = np.linalg.norm(offsets, axis=1)
        result = np.zeros((len(self.bodies), self.nq))
        for k, body in enumerate(self.bodies):
            if body.link == 0:
                continue
            far = float(np.linalg.norm(body.points, axis=1).max()) + body.core.ring
            result[k, body.link - 1] = float(np.hypot(body.points[:, 0], body.points[:, 1]).max()) + body.core.ring
            for joint in range(body.link - 2, -1, -1):
                # the next joint's offset is in this joint's frame: what lies along its own axis is no lever
                result[k, joint] = across[joint + 1] + far
                far += lengths[joint + 1]
        return np.asarray(result[self.pairs[:, 1]])

    def _least(self, frames: Array, configuration: Indices, body: Indices, normal: Array) -> Array:
        T = frames[configuration, self.links[body]]
        turned = np.einsum("kij,ki->kj", T[:, :3, :3], normal)
        least = np.einsum("kmj,kj->km", self._points[body], turned).min(axis=1)
        if self._ring.any():
            along = np.einsum("kj,kj->k", self._axes[body], turned)
            least -= self._ring[body] * np.sqrt(np.maximum(1 - along**2, 0))
        return np.asarray(least + np.einsum("ki,ki->k", T[:, :3, 3], normal))

    def _ends(self, frames: Array, configuration: Indices, body: Indices) -> Array:
        if len(body) > len(frames) * len(self.bodies):
            # each body is in many pairs: placed once per configuration, not once per pair
            T = frames[:, self.links]
            placed = self._points[:, :2] @ T[..., :3, :3].swapaxes(-1, -2) + T[..., None, :3, 3]
            return np.asarray(placed[configuration, body])
        T = frames[configuration, self.links[body]]
        return np.asarray(self._points[body, :2] @ T[:, :3, :3].swapaxes(1, 2) + T[:, None, :3, 3])

    def _segments(
        self, frames: Array, configuration: Indices, first: Indices, second: Indices
    ) -> tuple[Array, Array, Array]:
        distance, normal, _, point = segment_segment(
            self._ends(frames, configuration, first), self._ends(frames, configuration, second)
        )
        return distance, normal, point

    def _box_first(
        self, frames: Array, configuration: Indices, first: Indices, second: Indices
    ) -> tuple[Array, Array, Array]:
        T = frames[configuration, self.links[first]] @ self._T_link_core[first]
        R, ends = T[:, :3, :3], self._ends(frames, configuration, second)
        distance, normal, point = box_segment(self._half[first], (ends - T[:, None, :3, 3]) @ R)
        return distance, np.einsum("kij,kj->ki", R, normal), np.einsum("kij,kj->ki", R, point) + T[:, :3, 3]

    def _box_second(
        self, frames: Array, configuration: Indices, first: Indices, second: Indices
    ) -> tuple[Array, Array, Array]:
        distance, normal, point = self._box_first(frames, configuration, second, first)
        return distance, -normal, point

    def _planes(
        self, frames: Array, configuration: Indices, first: Indices, second: Indices
    ) -> tuple[Array, Array, Array]:
        normal, origin = self._axes[first], self._points[first, 0]
        T = frames[configuration, self.links[second]]
        points = self._points[second] @ T[:, :3, :3].swapaxes(1, 2) + T[:, None, :3, 3]
        axis = np.einsum("kij,kj->ki", T[:, :3, :3], self._axes[second])
        along = np.einsum("ki,ki->k", axis, normal)
        # down the disc: the part of the normal that lies in it
        down = normal - along[:, None] * axis
        steep = np.linalg.norm(down, axis=1)
        height = np.einsum("kmi,ki->km", points - origin[:, None], normal)
        lowest = height.argmin(axis=1)
        rows = np.arange(len(lowest))
        ring = self._ring[second]
        point = points[rows, lowest] - (ring / np.maximum(steep, 1e-12))[:, None] * down
        return height[rows, lowest] - ring * steep, normal, point

    def _others(
        self, frames: Array, configuration: Indices, first: Indices, second: Indices
    ) -> tuple[Array, Array, Array]:
        T_first = frames[configuration, self.links[first]] @ self._T_link_core[first]
        T_second = frames[configuration, self.links[second]] @ self._T_link_core[second]
        return self._convex.nearest(first.tolist(), second.tolist(), T_first, T_second)


def collision_model(arm: Arm) -> CollisionModel:
    """An arm's model: one is kept for arms that carry nothing and have nothing around them, as in most requests."""
    bare = not (arm.tool or arm.scene.obstacles or arm.payload.shape)
    return _bare(arm.robot) if bare else CollisionModel(arm)


@cache
def _bare(robot: Robot) -> CollisionModel:
    return CollisionModel(Arm(robot=robot))
