"""Signed distances and witness points of pairs of bodies: closed forms where they exist, Coal for the other pairs.

Bodies are held as arrays, so that one call computes many pairs at many configurations. Index arrays (k,) select the
computed cases: `configuration` is a row of `frames` (n, nq + 1, 4, 4), the T_base_link [m] of every link, and `pair` is
a row of the pairs. All distances have the radii and the margins of both bodies subtracted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from models.robot import Array
from optimizer.collision.beads import Beads
from optimizer.collision.bodies import Body, Indices
from optimizer.collision.closed_form_distance import box_segment, segment_segment
from optimizer.collision.cloud_pairs import CloudPairs
from optimizer.collision.coal_distance import ConvexPairs
from optimizer.collision.many_points import into, picked, placed, pose_columns, turned


class PairKind(IntEnum):
    """What computes the distance of a pair, by the cores of its first and second body."""

    SEGMENT_SEGMENT = 0
    BOX_SEGMENT = 1
    SEGMENT_BOX = 2
    HALF_SPACE = 3
    CONVEX = 4
    CLOUD = 5


@dataclass(frozen=True)
class WitnessPoints:
    """Nearest points of k pairs: signed distance (k,) [m], unit normal (k, 3) from first to second body, and a point.

    `point` (k, 3) [m] lies on the line through the two nearest points, in the base frame like `normal`.
    """

    distance: Array
    normal: Array
    point: Array

    def __getitem__(self, chosen: Indices) -> WitnessPoints:
        return WitnessPoints(self.distance[chosen], self.normal[chosen], self.point[chosen])

    def with_more(self, more: WitnessPoints) -> WitnessPoints:
        """These and others."""
        return WitnessPoints(
            *(np.concatenate([getattr(self, name), getattr(more, name)]) for name in ("distance", "normal", "point"))
        )


class PairGeometry:
    """Cores of bodies, and the `pairs` (p, 2) of them whose distances are computed.

    The first body of a pair is on the link nearer to the base. A half-space may only be first, and on link 0.
    """

    def __init__(self, bodies: Sequence[Body], pairs: Indices) -> None:
        self.pairs = pairs
        cores = [body.core for body in bodies]
        most = max((len(body.points) for body in bodies), default=0)
        # cores with fewer points repeat their last point
        # the box around a patch of a cloud stands for the patch: its separations are lower bounds
        self._points = np.array([b.points[np.minimum(np.arange(most), len(b.points) - 1)] for b in bodies])
        self._counts = np.array([len(body.points) for body in bodies], dtype=np.intp)
        self._axes = np.array([body.T_link_core[:3, 2] for body in bodies])
        self._disc_radii = np.array([core.disc_radius for core in cores])
        self._ball_centres = np.array([body.ball_centre for body in bodies]).reshape(-1, 3)
        self._ball_radii = np.array([body.ball_radius for body in bodies])
        self.links: Indices = np.array([body.link for body in bodies], dtype=np.intp)
        self._half_sizes = np.array([np.zeros(3) if core.half_size is None else core.half_size for core in cores])
        self._T_link_core = np.array([body.T_link_core for body in bodies])
        # ends of segments (2, 3, bodies)
        self._ends = np.array([b.points[[0, -1]] for b in bodies]).reshape(-1, 2, 3).transpose(1, 2, 0).copy()
        self._radii = np.array([core.radius for core in cores])
        growth = self._radii + np.array([body.margin for body in bodies])
        self._growth = growth[pairs].sum(axis=1)
        self._half_space_first = np.array([core.is_half_space for core in cores], dtype=bool)[pairs][:, 0]
        segment = np.array([body.is_segment for body in bodies], dtype=bool)[pairs]
        box = np.array([core.half_size is not None for core in cores], dtype=bool)[pairs]
        of_cloud = np.array([body.cloud is not None for body in bodies], dtype=bool)[pairs][:, 0]
        kinds = np.select(
            [
                self._half_space_first,
                segment.all(axis=1),
                box[:, 0] & segment[:, 1],
                segment[:, 0] & box[:, 1],
                of_cloud,
            ],
            [PairKind.HALF_SPACE, PairKind.SEGMENT_SEGMENT, PairKind.BOX_SEGMENT, PairKind.SEGMENT_BOX, PairKind.CLOUD],
            PairKind.CONVEX,
        )
        self._kinds = kinds
        # pairs (p,) whose distance is exact, not iterated
        self.is_closed_form = (kinds != PairKind.CONVEX) & ~of_cloud
        # pairs (p,) whose first body is a patch of a cloud
        self.is_cloud = of_cloud
        self._clouds = CloudPairs(bodies)
        self._convex = ConvexPairs(cores)
        self._beads = Beads(bodies, pairs)

    def ball_distances(self, frames: Array, pairs: Indices) -> Array:
        """Signed distances (n, p) [m] of the balls that enclose the bodies of `pairs` (p,): lower bounds.

        A ball cannot enclose a half-space: its pairs get -inf.
        """
        first, second = self.pairs[pairs].T
        R, origin = frames[..., :3, :3], frames[..., :3, 3]
        centres = (R[:, self.links] @ self._ball_centres[..., None])[..., 0] + origin[:, self.links]
        square = 0.0
        for x in centres.transpose(2, 0, 1):
            square = square + (x[:, second] - x[:, first]) ** 2
        distance = np.sqrt(square)
        distance -= self._ball_radii[first] + self._ball_radii[second] + self._growth[pairs]
        distance[:, self._half_space_first[pairs]] = -np.inf
        return np.asarray(distance)

    def bead_distances(self, frames: Array, configuration: Indices, pair: Indices) -> Array:
        """Lower bounds (k,) [m] on the signed distances of pairs (k,) at configurations (k,); -inf if it has none."""
        return np.asarray(self._beads.distances(frames, configuration, pair) - self._growth[pair])

    def witness_points(
        self, frames: Array, configuration: Indices, pair: Indices, within: float = np.inf, part: Indices | None = None
    ) -> WitnessPoints:
        """Witness points of pairs (k,) at configurations (k,).

        The distance of a patch of a cloud is that of its nearest part, infinite if above `within` [m]. Where `part`
        (k,) is not negative, it is that of this part.
        """
        first, second = self.pairs[pair].T
        k = len(pair)
        result = WitnessPoints(np.empty(k), np.empty((k, 3)), np.empty((k, 3)))
        kinds = self._kinds[pair]
        # in the order of PairKind
        solvers = (self._segment_segment, self._box_segment, self._segment_box, self._half_space, self._by_coal)
        # plain integers: comparing an array with a member of an enumeration takes five times as long
        for kind, solver in enumerate(solvers):
            chosen = np.flatnonzero(kinds == kind)
            if chosen.size:
                found = solver(frames, configuration[chosen], first[chosen], second[chosen])
                result.distance[chosen], result.normal[chosen], result.point[chosen] = found
        chosen = np.flatnonzero(kinds == PairKind.CLOUD)
        if chosen.size:
            case = frames, configuration[chosen], first[chosen], second[chosen]
            parts = np.full(len(chosen), -1) if part is None else part[chosen]
            found = self._clouds.witness_points(*case, within + self._growth[pair[chosen]], parts)
            result.distance[chosen], result.normal[chosen], result.point[chosen] = found
        result.distance[:] -= self._growth[pair]
        return result

    def surface_points(self, pair: Indices, found: WitnessPoints) -> Array:
        """Nearest points (k, 2, 3) [m] of the first and the second body of pairs (k,), without margins."""
        first, second = self.pairs[pair].T
        gap = (found.distance + self._growth[pair])[:, None] * found.normal
        # the witness point is on the second core, apart from these pairs
        on_first = (self._kinds[pair] == PairKind.SEGMENT_BOX)[:, None]
        cores = found.point - np.where(on_first, 0.0, gap), found.point + np.where(on_first, gap, 0.0)
        outward = self._radii[first][:, None] * found.normal, -self._radii[second][:, None] * found.normal
        return np.stack([core + out for core, out in zip(cores, outward, strict=True)], axis=1)

    def near_parts(
        self, frames: Array, configuration: Indices, pair: Indices, within: Array
    ) -> tuple[Indices, Indices]:
        """All (case, part) (m,) of clouds with distances of at most `within` (k,) [m], for pairs (k,) of patches.

        A few that are farther away are among them.
        """
        first, second = self.pairs[pair].T
        return self._clouds.near(frames, configuration, first, second, within + self._growth[pair])

    def separation(
        self, frames: Array, configuration: Indices, pair: Indices, normal: Array, part: Indices | None = None
    ) -> Array:
        """min n·x over the second body - max n·x over the first (k,) [m], for unit vectors n (k, 3) in the base frame.

        It never exceeds the signed distance, whatever n is. For a half-space, n must be its outward normal. Where
        `part` (k,) is not negative, the first body is this part of a cloud; else it is the box around the patch.
        """
        first, second = self.pairs[pair].T
        lowest = self._support(frames, configuration, first, -normal)
        chosen = np.zeros(0, dtype=np.intp) if part is None else np.flatnonzero(part >= 0)
        if part is not None and chosen.size:
            lowest[chosen] = -self._clouds.highest(first[chosen], part[chosen], normal[chosen])
        gap = self._support(frames, configuration, second, normal) + lowest
        return np.asarray(gap - self._growth[pair])

    def _support(self, frames: Array, configuration: Indices, body: Indices, normal: Array) -> Array:
        """min n·x (k,) [m] over the cores of bodies (k,)."""
        T = frames[configuration, self.links[body]]
        normal_in_link = np.einsum("kij,ki->kj", T[:, :3, :3], normal)
        # links have two points, boxes eight
        points = self._points[body, : self._counts[body].max(initial=1)]
        heights = (points @ normal_in_link[:, :, None])[..., 0]
        # (m, k): numpy runs along k
        least = np.ascontiguousarray(heights.T).min(axis=0)
        if self._disc_radii.any():
            cosine = np.einsum("kj,kj->k", self._axes[body], normal_in_link)
            least -= self._disc_radii[body] * np.sqrt(np.maximum(1 - cosine**2, 0))
        return np.asarray(least + np.einsum("ki,ki->k", T[:, :3, 3], normal))

    def _segment_ends(self, frames: Array, configuration: Indices, *bodies: Indices) -> list[Array]:
        """Ends (k, 2, 3) [m] of segments in the base frame, of each of `bodies` (k,)."""
        T = pose_columns(frames)
        poses = [picked(T, configuration * frames.shape[1] + self.links[body]) for body in bodies]
        ends = [placed(pose, picked(self._ends, body)) for pose, body in zip(poses, bodies, strict=True)]
        return [each.transpose(2, 0, 1) for each in ends]

    def _segment_segment(
        self, frames: Array, configuration: Indices, first: Indices, second: Indices
    ) -> tuple[Array, Array, Array]:
        distance, normal, _, point = segment_segment(*self._segment_ends(frames, configuration, first, second))
        return distance, normal, point

    def _box_segment(
        self, frames: Array, configuration: Indices, first: Indices, second: Indices
    ) -> tuple[Array, Array, Array]:
        T = pose_columns(frames[configuration, self.links[first]] @ self._T_link_core[first])
        (ends,) = self._segment_ends(frames, configuration, second)
        local = into(T, ends.transpose(1, 2, 0)).transpose(2, 0, 1)
        distance, normal, point = box_segment(self._half_sizes[first], local)
        return distance, turned(T, normal.T).T, placed(T, point.T).T

    def _segment_box(
        self, frames: Array, configuration: Indices, first: Indices, second: Indices
    ) -> tuple[Array, Array, Array]:
        distance, normal, point = self._box_segment(frames, configuration, second, first)
        return distance, -normal, point

    def _half_space(
        self, frames: Array, configuration: Indices, first: Indices, second: Indices
    ) -> tuple[Array, Array, Array]:
        normal, origin = self._axes[first], self._points[first, 0]
        T = frames[configuration, self.links[second]]
        points = self._points[second] @ T[:, :3, :3].swapaxes(1, 2) + T[:, None, :3, 3]
        axis = np.einsum("kij,kj->ki", T[:, :3, :3], self._axes[second])
        cosine = np.einsum("ki,ki->k", axis, normal)
        # the part of the normal in the plane of the disc: the lowest point of the disc lies against it
        in_disc = normal - cosine[:, None] * axis
        sine = np.linalg.norm(in_disc, axis=1)
        height = np.einsum("kmi,ki->km", points - origin[:, None], normal)
        lowest = height.argmin(axis=1)
        rows = np.arange(len(lowest))
        radius = self._disc_radii[second]
        point = points[rows, lowest] - (radius / np.maximum(sine, 1e-12))[:, None] * in_disc
        return height[rows, lowest] - radius * sine, normal, point

    def _by_coal(
        self, frames: Array, configuration: Indices, first: Indices, second: Indices
    ) -> tuple[Array, Array, Array]:
        T_first = frames[configuration, self.links[first]] @ self._T_link_core[first]
        T_second = frames[configuration, self.links[second]] @ self._T_link_core[second]
        return self._convex.witness_points(first.tolist(), second.tolist(), T_first, T_second)
