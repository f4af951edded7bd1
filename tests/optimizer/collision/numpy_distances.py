"""Distances of many pairs by numpy, the reference of `CompiledDistances`."""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.collision.pair_arrays import PairArrays, PairKind
from joulepath.optimizer.kinematics.vectors import cross
from tests.optimizer.collision.cover_spheres import CoverSpheres
from tests.optimizer.collision.many_points import into, picked, placed, pose_columns, turned
from tests.optimizer.collision.numpy_closed_forms import box_segment, segment_segment


class NumpyDistances:
    """Distances of the pairs of some bodies, by the methods of `CompiledDistances`."""

    def __init__(self, arrays: PairArrays) -> None:
        self._arrays = arrays
        # ends of segments (2, 3, bodies)
        ends = [
            points[[0, count - 1]]
            for points, count in zip(arrays.points, arrays.counts, strict=True)
        ]
        self._ends = np.array(ends).reshape(-1, 2, 3).transpose(1, 2, 0).copy()
        self._half_space_first = arrays.kinds == PairKind.HALF_SPACE
        self._covers = CoverSpheres(arrays)

    def bounds(
        self, frames: Array, pairs: Indices, within: float, known: Array | None
    ) -> tuple[Array, Indices, Indices]:
        """Lower bounds (n, p) [m] on the distances of `pairs` (p,), and where (k,) they are at most
        `within`: rows and columns.

        They are those of balls, improved by covering spheres if `within` is finite, or `known`
        (n, p) bounds greater than `within`.
        """
        distance = self.ball_distances(frames, pairs) if known is None else known.copy()
        configuration, column = np.nonzero(distance <= within)
        if known is not None and configuration.size:
            near = configuration, column
            distance[near] = np.maximum(distance, self.ball_distances(frames, pairs))[near]
            configuration, column = np.nonzero(distance <= within)
        if np.isfinite(within):
            # the ball around a shelf encloses half of the cell: a second bound leaves out most of
            # these pairs
            near = configuration, column
            bound = self.cover_bounds(frames, configuration, pairs[column])
            distance[near] = np.maximum(distance[near], bound)
            chosen = bound <= within
            configuration, column = configuration[chosen], column[chosen]
        return distance, configuration, column

    def ball_distances(self, frames: Array, pairs: Indices) -> Array:
        """Signed distances (n, p) [m] of the balls that enclose the bodies of `pairs` (p,): lower
        bounds.

        A ball cannot enclose a half-space: its pairs get -inf.
        """
        arrays = self._arrays
        first, second = arrays.pairs[pairs].T
        R, origin = frames[..., :3, :3], frames[..., :3, 3]
        centres = (R[:, arrays.links] @ arrays.ball_centres[..., None])[..., 0] + origin[
            :, arrays.links
        ]
        square = 0.0
        for x in centres.transpose(2, 0, 1):
            square = square + (x[:, second] - x[:, first]) ** 2
        distance = np.sqrt(square)
        distance -= arrays.ball_radii[first] + arrays.ball_radii[second] + arrays.growth[pairs]
        distance[:, self._half_space_first[pairs]] = -np.inf
        return np.asarray(distance)

    def cover_bounds(self, frames: Array, configuration: Indices, pair: Indices) -> Array:
        """Lower bounds (k,) [m] on the signed distances of pairs (k,) at configurations (k,); -inf
        if it has none.
        """
        return np.asarray(
            self._covers.distances(frames, configuration, pair) - self._arrays.growth[pair]
        )

    def witness_points(
        self, frames: Array, configuration: Indices, pair: Indices, within: float = np.inf
    ) -> tuple[Array, Array, Array]:
        """Signed distance of the cores (k,) [m], normal and point (k, 3); NaN where there is no
        closed form.
        """
        result = (
            np.full(len(pair), np.nan),
            np.full((len(pair), 3), np.nan),
            np.full((len(pair), 3), np.nan),
        )
        for kind in (
            PairKind.SEGMENT_SEGMENT,
            PairKind.BOX_SEGMENT,
            PairKind.SEGMENT_BOX,
            PairKind.HALF_SPACE,
        ):
            chosen = np.flatnonzero(self._arrays.kinds[pair] == int(kind))
            found = self._of_kind(kind, frames, configuration[chosen], pair[chosen])
            for every, own in zip(result, found, strict=True):
                every[chosen] = own
        return result

    def _of_kind(
        self, kind: PairKind, frames: Array, configuration: Indices, pair: Indices
    ) -> tuple[Array, Array, Array]:
        first, second = self._arrays.pairs[pair].T
        match kind:
            case PairKind.SEGMENT_SEGMENT:
                ends = self._segment_ends(frames, configuration, first, second)
                distance, normal, _, point = segment_segment(*ends)
                return distance, normal, point
            case PairKind.BOX_SEGMENT:
                return self._box_segment(frames, configuration, first, second)
            case PairKind.SEGMENT_BOX:
                distance, normal, point = self._box_segment(frames, configuration, second, first)
                return distance, -normal, point
            case PairKind.HALF_SPACE:
                return self._half_space(frames, configuration, first, second)
            case _:
                raise ValueError(f"{kind} has no closed form")

    def separations(
        self,
        frames: Array,
        begin: Indices,
        end: Indices,
        pair: Indices,
        normals: tuple[Array, Array],
    ) -> Array:
        """Separations (k,) [m] of pairs (k,) that hold at the configurations `begin` and at `end`
        (k,).

        Unit `normals` (k, 3) there move with the first body: the better one counts, by the lesser
        of its separations.
        """
        best = np.full(len(pair), -np.inf)
        at_both = [
            frames[at, self._arrays.links[self._arrays.pairs[pair, 0]], :3, :3]
            for at in (begin, end)
        ]
        for normal, R_from in zip(normals, at_both, strict=True):
            in_link = np.einsum("kij,ki->kj", R_from, normal)
            found = [
                self.separation(frames, at, pair, np.einsum("kij,kj->ki", R_to, in_link))
                for at, R_to in zip((begin, end), at_both, strict=True)
            ]
            best = np.maximum(best, np.minimum(*found))
        return np.asarray(best)

    def separation(
        self, frames: Array, configuration: Indices, pair: Indices, normal: Array
    ) -> Array:
        """min n·x over the second body - max n·x over the first (k,) [m], for unit vectors n (k, 3)
        in the base frame.

        It never exceeds the signed distance, whatever n is. For a half-space, n must be its outward
        normal.
        """
        first, second = self._arrays.pairs[pair].T
        apart = self.supports(frames, configuration, second, normal)
        return np.asarray(
            apart + self.supports(frames, configuration, first, -normal) - self._arrays.growth[pair]
        )

    def supports(
        self, frames: Array, configuration: Indices, body: Indices, normal: Array
    ) -> Array:
        """min n·x (k,) [m] over the cores of bodies (k,)."""
        arrays = self._arrays
        T = frames[configuration, arrays.links[body]]
        normal_in_link = np.einsum("kij,ki->kj", T[:, :3, :3], normal)
        # links have two points, boxes eight
        points = arrays.points[body, : arrays.counts[body].max(initial=1)]
        heights = (points @ normal_in_link[:, :, None])[..., 0]
        # (m, k): numpy runs along k
        least = np.ascontiguousarray(heights.T).min(axis=0)
        if arrays.disc_radii.any():
            cosine = np.einsum("kj,kj->k", arrays.axes[body], normal_in_link)
            least -= arrays.disc_radii[body] * np.sqrt(np.maximum(1 - cosine**2, 0))
        return np.asarray(least + np.einsum("ki,ki->k", T[:, :3, 3], normal))

    def gradients(
        self, frames: Array, configuration: Indices, pair: Indices, normal: Array, point: Array
    ) -> Array:
        """Gradients (k, nq) [m/rad] of signed distances: n · (axis × (point - origin)) of every
        joint in between.
        """
        axes, origins = frames[:, 1:, :3, 2], frames[:, 1:, :3, 3]
        gradient = np.einsum("kji,ki->kj", axes[configuration], cross(point, normal))
        gradient -= np.einsum("kji,ki->kj", cross(axes, origins)[configuration], normal)
        joints = np.arange(1, frames.shape[1])
        below, last = self._arrays.links[self._arrays.pairs[pair].T][..., None]
        return np.asarray(gradient * ((joints > below) & (joints <= last)))

    def _segment_ends(self, frames: Array, configuration: Indices, *bodies: Indices) -> list[Array]:
        """Ends (k, 2, 3) [m] of segments in the base frame, of each of `bodies` (k,)."""
        T, links = pose_columns(frames), self._arrays.links
        poses = [picked(T, configuration * frames.shape[1] + links[body]) for body in bodies]
        ends = [
            placed(pose, picked(self._ends, body)) for pose, body in zip(poses, bodies, strict=True)
        ]
        return [each.transpose(2, 0, 1) for each in ends]

    def _box_segment(
        self, frames: Array, configuration: Indices, first: Indices, second: Indices
    ) -> tuple[Array, Array, Array]:
        arrays = self._arrays
        T = pose_columns(frames[configuration, arrays.links[first]] @ arrays.T_link_core[first])
        (ends,) = self._segment_ends(frames, configuration, second)
        local = into(T, ends.transpose(1, 2, 0)).transpose(2, 0, 1)
        distance, normal, point = box_segment(arrays.half_sizes[first], local)
        return distance, turned(T, normal.T).T, placed(T, point.T).T

    def _half_space(
        self, frames: Array, configuration: Indices, first: Indices, second: Indices
    ) -> tuple[Array, Array, Array]:
        arrays = self._arrays
        normal, origin = arrays.axes[first], arrays.points[first, 0]
        T = frames[configuration, arrays.links[second]]
        points = arrays.points[second] @ T[:, :3, :3].swapaxes(1, 2) + T[:, None, :3, 3]
        axis = np.einsum("kij,kj->ki", T[:, :3, :3], arrays.axes[second])
        cosine = np.einsum("ki,ki->k", axis, normal)
        # the part of the normal in the plane of the disc: the lowest point of the disc lies against
        # it
        in_disc = normal - cosine[:, None] * axis
        sine = np.linalg.norm(in_disc, axis=1)
        height = np.einsum("kmi,ki->km", points - origin[:, None], normal)
        lowest = height.argmin(axis=1)
        rows = np.arange(len(lowest))
        radius = arrays.disc_radii[second]
        point = points[rows, lowest] - (radius / np.maximum(sine, 1e-12))[:, None] * in_disc
        return height[rows, lowest] - radius * sine, normal, point
