"""Signed distances between patches of clouds and moving bodies, for many pairs at many
configurations at once.

Index arrays (k,) select the cases: a row `configuration` of `frames` (n, nq + 1, 4, 4), and the
bodies `first` (the patch, on link 0) and `second`. Radii and margins are not subtracted.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.collision.bodies import Body, Indices
from joulepath.optimizer.collision.clouds import Cloud, ConvexAgainstCloud, Witness


@dataclass(frozen=True)
class _Batch:
    """Cases (m,) of one obstacle, and of one moving body or of all segments.

    `chosen` (m,) are indices of the cases, `root` (m,) their patches. Either `segments` (m, 2, 3)
    or the poses T (m, 4, 4) of the core are given, in the frame of the cloud.
    """

    chosen: Indices
    cloud: Cloud
    root: Indices
    T_base_cloud: Array
    segments: Array | None = None
    convex: ConvexAgainstCloud | None = None
    T: Array | None = None


class CloudPairs:
    """Patches and moving bodies of a collision model."""

    def __init__(self, bodies: Sequence[Body]) -> None:
        self._bodies = bodies
        # Obstacles of equal shape share a cloud, but every obstacle has its own pose.
        keys = [
            None if body.cloud is None else (body.cloud, body.T_link_core.tobytes())
            for body in bodies
        ]
        known = list(dict.fromkeys(key for key in keys if key is not None))
        self._group = np.array(
            [-1 if key is None else known.index(key) for key in keys], dtype=np.intp
        )
        self._patch = np.array([body.patch for body in bodies], dtype=np.intp)
        self._is_segment = np.array([body.is_segment for body in bodies], dtype=bool)
        self._links = np.array([body.link for body in bodies], dtype=np.intp)
        self._ends = np.array([body.points[[0, -1]] for body in bodies]).reshape(-1, 2, 3)
        self._convex: dict[tuple[int, int], ConvexAgainstCloud] = {}

    def witness_points(
        self,
        frames: Array,
        configuration: Indices,
        first: Indices,
        second: Indices,
        within: Array,
        part: Indices,
    ) -> Witness:
        """Distance (k,), normal (k, 3) and point (k, 3) of the nearest part, or of `part` (k,) if
        it is not negative.

        The distance of a nearest part is infinite if it exceeds `within` (k,) [m].
        """
        count = len(first)
        distance, normal, point = np.empty(count), np.empty((count, 3)), np.empty((count, 3))
        for has_part in (True, False):
            cases = np.flatnonzero((part >= 0) == has_part)
            for batch in self._batches(frames, configuration, first, second, cases):
                k = batch.chosen
                if batch.segments is not None:
                    witness = (
                        batch.cloud.to_segments(part[k], batch.segments)
                        if has_part
                        else batch.cloud.nearest(batch.segments, batch.root, within[k])
                    )
                else:
                    assert batch.convex is not None and batch.T is not None
                    witness = (
                        batch.convex.to_cores(part[k], batch.T)
                        if has_part
                        else batch.convex.nearest(batch.T, batch.root, within[k])
                    )
                R, origin = batch.T_base_cloud[:3, :3], batch.T_base_cloud[:3, 3]
                distance[k], normal[k] = witness[0], witness[1] @ R.T
                point[k] = witness[2] @ R.T + origin
        return distance, normal, point

    def near(
        self, frames: Array, configuration: Indices, first: Indices, second: Indices, within: Array
    ) -> tuple[Indices, Indices]:
        """All (case, part) (m,) with a distance that may be at most `within` (k,) [m]."""
        none: Indices = np.zeros(0, dtype=np.intp)
        cases, parts = [none], [none]
        for batch in self._batches(frames, configuration, first, second, np.arange(len(first))):
            if batch.segments is not None:
                segments, reach = batch.segments, np.zeros(len(batch.chosen))
            else:
                assert batch.convex is not None and batch.T is not None
                segments, reach = batch.convex.balls(batch.T)
            query, part = batch.cloud.tree.near(segments, reach, within[batch.chosen], batch.root)
            cases.append(batch.chosen[query])
            parts.append(part)
        return np.concatenate(cases), np.concatenate(parts)

    def highest(self, first: Indices, part: Indices, direction: Array) -> Array:
        """Greatest n·x (k,) [m] over parts (k,) for n (k, 3) in the base frame."""
        result = np.empty(len(first))
        for group in np.unique(self._group[first]).tolist():
            k = np.flatnonzero(self._group[first] == group)
            cloud, T = self._obstacle(int(first[k[0]]))
            result[k] = cloud.highest(part[k], direction[k] @ T[:3, :3]) + direction[k] @ T[:3, 3]
        return result

    def _batches(
        self, frames: Array, configuration: Indices, first: Indices, second: Indices, cases: Indices
    ) -> Iterator[_Batch]:
        group, is_segment = self._group[first[cases]], self._is_segment[second[cases]]
        # One batch per obstacle for all segments, and one per obstacle and body for other bodies.
        body = np.where(is_segment, -1, second[cases])
        for number, moving in dict.fromkeys(zip(group.tolist(), body.tolist(), strict=True)):
            k = cases[(group == number) & (body == moving)]
            cloud, T_base_cloud = self._obstacle(int(first[k[0]]))
            R, origin = T_base_cloud[:3, :3], T_base_cloud[:3, 3]
            T_link = frames[configuration[k], self._links[second[k]]]
            batch = _Batch(k, cloud, self._patch[first[k]], T_base_cloud)
            if moving < 0:
                ends = (
                    self._ends[second[k]] @ T_link[:, :3, :3].swapaxes(1, 2)
                    + T_link[:, None, :3, 3]
                )
                yield replace(batch, segments=(ends - origin) @ R)
            else:
                T = T_link @ self._bodies[moving].T_link_core
                T[:, :3, 3] = (T[:, :3, 3] - origin) @ R
                T[:, :3, :3] = R.T @ T[:, :3, :3]
                yield replace(batch, convex=self._against(number, moving, cloud), T=T)

    def _obstacle(self, body: int) -> tuple[Cloud, Array]:
        """Cloud of a patch, and its pose (4, 4) in the base frame."""
        cloud = self._bodies[body].cloud
        assert cloud is not None
        return cloud, self._bodies[body].T_link_core

    def _against(self, group: int, moving: int, cloud: Cloud) -> ConvexAgainstCloud:
        key = group, moving
        if key not in self._convex:
            self._convex.setdefault(key, ConvexAgainstCloud(cloud, self._bodies[moving].core))
        return self._convex[key]
