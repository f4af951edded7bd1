"""Signed distances of obstacles of many parts: balls, voxels and triangles, each exact, found by a
bounding tree.

Everything is in the frame of the obstacle's shape. A closed mesh is solid: the distance of a body
inside it is negative.
"""

from __future__ import annotations

import hashlib
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from typing import overload

import numpy as np
from cachetools import LRUCache, cached

from joulepath.models.robot import Array
from joulepath.optimizer.collision.bounding_tree import TREE, BoundingTree, point_segment
from joulepath.optimizer.collision.closed_form_distance import (
    box_segment,
    segment_segment,
    triangle_segment,
)
from joulepath.optimizer.collision.coal_distance import ConvexPairs
from joulepath.optimizer.collision.cores import Core, Indices, box_corners, least_height
from joulepath.optimizer.problem.clouds import Cloud as Shape
from joulepath.optimizer.problem.clouds import Points, TriangleMesh, Voxels, parts_of


@dataclass(frozen=True)
class CloudSettings:
    """Division of obstacles into parts, and memory for them."""

    max_kept_parts: int = 400_000
    """Largest total number of parts of the trees kept for later requests with the same obstacles. A
    part takes up to 200 bytes.
    """
    max_patches: int = 8
    """Largest number of patches of an obstacle. Every patch is a body with its own distance in the
    optimiser.
    """
    longest_edge: float = 0.05
    """Longest edge [m] of the triangles of a tree."""
    max_triangles: int = 200_000
    """Number of triangles at which their division ends."""


CLOUDS = CloudSettings()


RAY_DIRECTION = np.array([0.5657, 0.6213, 0.5422])
"""Direction of the rays for the inside test of closed meshes, parallel to no edge or face of usual
designs.
"""

Witness = tuple[Array, Array, Array]


class Cloud:
    """Parts of an obstacle, without the radius of its points, and their tree."""

    def __init__(self, shape: Shape) -> None:
        self.count = parts_of(shape)
        self.corners: Array | None = None
        self.half_size: Array | None = None
        self.is_solid = False
        match shape:
            case Points():
                centres, radii = shape.points, np.zeros(self.count)
            case Voxels():
                centres = np.asarray((shape.cells + 0.5) * shape.size, dtype=float)
                self.half_size = np.full(3, shape.size / 2)
                radii = np.full(self.count, float(np.linalg.norm(self.half_size)))
            case TriangleMesh():
                self.corners, self.is_solid = divided(shape.corners), shape.is_closed
                self.count = len(self.corners)
                centres = (self.corners.min(axis=1) + self.corners.max(axis=1)) / 2
                radii = np.linalg.norm(self.corners - centres[:, None], axis=2).max(axis=1)
        self.tree = BoundingTree(centres, radii)
        # The inside of a solid has no parts, so only the root accounts for it.
        self.patches = [0] if self.is_solid else self.tree.patches(CLOUDS.max_patches)
        self._low, self._high = self._box(self.tree.parts(0))

    def box(self, patch: int) -> Array:
        """Corners (8, 3) [m] of the box around a patch."""
        return box_corners(*self._box(self.tree.parts(patch)))

    def nearest(self, segments: Array, root: Indices, within: Array) -> Witness:
        """Distance (k,), normal (k, 3) and point (k, 3) of segments (k, 2, 3) from their nearest
        parts.

        The normal points to the segment, and the point lies on it. `root` (k,) are patches. A
        distance above `within` (k,) [m] is infinite, except inside a solid.
        """
        may_be_inside = ((segments[:, 0] >= self._low) & (segments[:, 0] <= self._high)).all(
            axis=1
        ) & self.is_solid
        within = np.where(may_be_inside, np.inf, within)
        query, part = self.tree.near(segments, np.zeros(len(segments)), within, root, nearest=True)
        query, part = self._promising(segments, query, part)
        witness = _least(self.to_segments(part, segments[query]), query, len(segments), within)
        if self.is_solid:
            outside = np.flatnonzero(may_be_inside & (witness[0] > 0))
            inside = outside[self.inside(segments[outside, 0])]
            witness[0][inside] *= -1
            witness[1][inside] *= -1
        return witness

    def _promising(self, segments: Array, query: Indices, part: Indices) -> tuple[Indices, Indices]:
        """The (query, part) that may be nearer than the part with the nearest ball of the same
        query.
        """
        if not self.tree.radii.any():
            return query, part
        least = point_segment(self.tree.centres[part], segments[query]) - self.tree.radii[part]
        order = np.lexsort((least, query))
        first = order[np.unique(query[order], return_index=True)[1]]
        reached = np.full(len(segments), np.inf)
        reached[query[first]] = (
            self.to_segments(part[first], segments[query[first]])[0] + TREE.rounding
        )
        is_candidate = least <= np.maximum(reached[query], 0.0)
        return query[is_candidate], part[is_candidate]

    def to_segments(self, part: Indices, segments: Array) -> Witness:
        """Signed distance (k,), normal (k, 3) and point (k, 3) of segments (k, 2, 3) from parts
        (k,).
        """
        if self.corners is not None:
            return triangle_segment(self.corners[part], segments)
        centres = self.tree.centres[part]
        if self.half_size is None:
            return segment_segment(np.repeat(centres[:, None], 2, axis=1), segments)
        half_size = np.broadcast_to(self.half_size, centres.shape)
        distance, normal, point = box_segment(half_size, segments - centres[:, None])
        return distance, normal, point + centres

    def highest(self, part: Indices, direction: Array) -> Array:
        """Greatest n·x (k,) [m] over parts (k,) for n (k, 3)."""
        if self.corners is not None:
            return np.asarray(np.einsum("kci,ki->kc", self.corners[part], direction).max(axis=1))
        height = np.einsum("ki,ki->k", self.tree.centres[part], direction)
        return np.asarray(
            height if self.half_size is None else height + np.abs(direction) @ self.half_size
        )

    def inside(self, points: Array) -> Indices:
        """Indices of the points (k, 3) inside a closed mesh: the signed crossings of a ray do not
        cancel out.
        """
        assert self.corners is not None
        rays = np.stack(
            [points, points + RAY_DIRECTION * 2 * np.linalg.norm(self._high - self._low)], axis=1
        )
        none = np.zeros(len(points))
        query, part = self.tree.near(rays, none, none, np.zeros(len(points), dtype=np.intp))
        triangles, ray = self.corners[part], rays[query]
        sides = [
            _volume(ray[:, 0], ray[:, 1], triangles[:, i], triangles[:, i - 2]) for i in range(3)
        ]
        forward, backward = (
            np.all([sign * side > 0 for side in sides], axis=0) for sign in (1, -1)
        )
        ends = [
            _volume(ray[:, e], triangles[:, 0], triangles[:, 1], triangles[:, 2]) for e in range(2)
        ]
        crosses = ends[0] * ends[1] < 0
        turns = np.zeros(len(points))
        np.add.at(turns, query, crosses * (forward.astype(float) - backward))
        return np.flatnonzero(turns != 0)

    def _box(self, parts: Indices) -> tuple[Array, Array]:
        if self.corners is not None:
            points = self.corners[parts].reshape(-1, 3)
            return points.min(axis=0), points.max(axis=0)
        grow = 0.0 if self.half_size is None else self.half_size
        centres = self.tree.centres[parts]
        return centres.min(axis=0) - grow, centres.max(axis=0) + grow


class ConvexAgainstCloud:
    """Distances of one convex core other than a segment, part by part, by Coal."""

    def __init__(self, cloud: Cloud, core: Core) -> None:
        self._cloud, self._core = cloud, core
        # A ball around the core, with its centre inside the core.
        self._centre = core.points.mean(axis=0)
        self._radius = (
            float(np.linalg.norm(core.points - self._centre, axis=1).max()) + core.disc_radius
        )
        self._pairs = ConvexPairs(_Cores(cloud, core))

    def nearest(self, T: Array, root: Indices, within: Array) -> Witness:
        """Distances as of `Cloud.nearest`, for the core at T (k, 4, 4) in the frame of the
        cloud.
        """
        cloud = self._cloud
        balls, reach = self.balls(T)
        if cloud.is_solid:
            within = np.full(len(T), np.inf)
        query, part = cloud.tree.near(balls, reach, within, root, nearest=True)
        R, origin = T[query, :3, :3], T[query, :3, 3]
        in_core = np.einsum("kij,ki->kj", R, cloud.tree.centres[part] - origin)
        least = least_height(self._core, in_core) - cloud.tree.radii[part]
        order = np.lexsort((least, query))
        distance, normal, point = (
            np.full(len(T), np.inf),
            np.tile([0.0, 0.0, 1.0], (len(T), 1)),
            balls[:, 0].copy(),
        )
        for k in order.tolist():
            q = int(query[k])
            # The parts of a query are ordered by their lower bounds.
            if least[k] < min(distance[q], within[q]):
                d, n, p = self.to_cores(part[k : k + 1], T[q : q + 1])
                if d[0] < distance[q] and d[0] <= within[q]:
                    distance[q], normal[q], point[q] = d[0], n[0], p[0]
        if cloud.is_solid:
            outside = np.flatnonzero(distance > 0)
            inside = outside[cloud.inside(balls[outside, 0])]
            distance[inside] *= -1
            normal[inside] *= -1
        return distance, normal, point

    def balls(self, T: Array) -> tuple[Array, Array]:
        """Balls around the core at T (k, 4, 4), as segments (k, 2, 3) of zero length and radii (k,)
        [m].
        """
        centres = T[:, :3, :3] @ self._centre + T[:, :3, 3]
        return np.repeat(centres[:, None], 2, axis=1), np.full(len(T), self._radius)

    def to_cores(self, part: Indices, T: Array) -> Witness:
        """Distances as of `Cloud.to_segments`, for the core at T (k, 4, 4)."""
        T_part = np.tile(np.eye(4), (len(part), 1, 1))
        if self._cloud.corners is None:
            T_part[:, :3, 3] = self._cloud.tree.centres[part]
        return self._pairs.witness_points((part + 1).tolist(), [0] * len(part), T_part, T)


class _Cores(Sequence[Core]):
    """The moving core, then the cores of the parts, each in its own frame and built on demand."""

    def __init__(self, cloud: Cloud, core: Core) -> None:
        self._cloud, self._core = cloud, core

    def __len__(self) -> int:
        return self._cloud.count + 1

    @overload
    def __getitem__(self, index: int) -> Core: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Core]: ...
    def __getitem__(self, index: int | slice) -> Core | Sequence[Core]:
        if isinstance(index, slice):
            return [self[k] for k in range(*index.indices(len(self)))]
        if index == 0:
            return self._core
        if self._cloud.corners is not None:
            return Core(self._cloud.corners[index - 1])
        half_size = self._cloud.half_size
        if half_size is None:
            return Core(np.zeros((1, 3)))
        return Core(box_corners(-half_size, half_size), half_size=half_size)


def divided(triangles: Array) -> Array:
    """Triangles (m, 3, 3) [m] with the same union as triangles (k, 3, 3), without edges longer than
    `longest_edge`.

    Balls around long triangles would be mostly empty. The longest edges are halved until
    `max_triangles` triangles are reached.
    """
    while True:
        edges = np.linalg.norm(triangles - np.roll(triangles, -1, axis=1), axis=2)
        long = edges.max(axis=1) > CLOUDS.longest_edge
        if not long.any() or len(triangles) + long.sum() > CLOUDS.max_triangles:
            return triangles
        # The corners are rotated so that the longest edge is from corner 0 to corner 1.
        turn = (edges[long].argmax(axis=1)[:, None] + np.arange(3)) % 3
        a, b, c = (triangles[long][np.arange(len(turn)), turn[:, i]] for i in range(3))
        middle = (a + b) / 2
        halves = [np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)]
        triangles = np.concatenate([triangles[~long], *halves])


def _digest(shape: Shape) -> bytes:
    """Digest of the parts; the radius of points is not included."""
    match shape:
        case Points():
            content = [b"points", shape.points.tobytes()]
        case Voxels():
            content = [b"voxels", np.float64(shape.size).tobytes(), shape.cells.tobytes()]
        case TriangleMesh():
            content = [b"triangles", shape.corners.tobytes()]
    return hashlib.blake2b(b"".join(content)).digest()


@cached(
    LRUCache(CLOUDS.max_kept_parts, getsizeof=lambda cloud: cloud.count),
    key=_digest,
    lock=threading.Lock(),
)
def cloud_of(shape: Shape) -> Cloud:
    """Parts of an obstacle and their tree. Those of recent requests are kept, by content."""
    return Cloud(shape)


def _least(witness: Witness, query: Indices, count: int, within: Array) -> Witness:
    """Nearest part of every query; infinitely far if no part is within its limit."""
    distance, normal, point = (
        np.full(count, np.inf),
        np.tile([0.0, 0.0, 1.0], (count, 1)),
        np.zeros((count, 3)),
    )
    order = np.lexsort((witness[0], query))
    first = order[np.unique(query[order], return_index=True)[1]]
    first = first[witness[0][first] <= within[query[first]]]
    distance[query[first]], normal[query[first]], point[query[first]] = (
        each[first] for each in witness
    )
    return distance, normal, point


def _volume(a: Array, b: Array, c: Array, d: Array) -> Array:
    """Six times the signed volumes (k,) [m³] of tetrahedra."""
    return np.asarray(np.einsum("ki,ki->k", np.cross(b - a, c - a), d - a))
