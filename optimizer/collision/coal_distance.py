"""Signed distances of any two convex cores by Coal (GJK and EPA), one pair at a time."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import coal
import numpy as np
import numpy.typing as npt

from joulepath.models.robot import Array
from joulepath.optimizer.collision.cores import Core
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.problem.scene import rotation_to


@dataclass(frozen=True)
class CoalSettings:
    """Settings of Coal's distances."""

    tolerances: tuple[float, ...] = (1e-10, 1e-6, 1e-4)
    """Tolerances of the distance [m] in successive attempts. Coal's default of 1e-6 is too coarse
    for the line search of the optimiser; deep inside a round body, EPA may not converge to the
    finest one.
    """
    max_iterations: int = 500
    """Largest number of iterations of GJK and of EPA."""
    skin: float = 1e-2
    """Radius [m] by which a point or a segment is grown, since Coal needs bodies with a volume; it
    is added to the distance.
    """
    largest_distance: float = 1e6
    """Distance [m] beyond which a result of Coal signals a failure."""
    pairs_per_check: int = 2048
    """Pairs between two checks of the deadline, about ten milliseconds."""


COAL = CoalSettings()


class ConvexPairs:
    """Distances between cores; Coal's shapes are built once per core."""

    def __init__(self, cores: Sequence[Core]) -> None:
        self._cores = cores
        self._shapes: dict[int, tuple[coal.CollisionGeometry, float, coal.Transform3s]] = {}
        self._requests = [_request(tolerance) for tolerance in COAL.tolerances]

    def witness_points(
        self, first: Iterable[int], second: Iterable[int], T_first: Array, T_second: Array
    ) -> tuple[Array, Array, Array]:
        """Signed distance (k,) [m], normal (k, 3) from first to second, and witness point (k, 3)
        [m] of the second core.

        If Coal does not converge, the distance is a lower bound.

        Args:
            first: indices (k,) of the first cores.
            second: indices (k,) of the second cores.
            T_first: poses (k, 4, 4) of the first cores in the base frame.
            T_second: poses (k, 4, 4) of the second cores in the base frame.
        """
        count = len(T_first)
        distance, normal, point = np.empty(count), np.empty((count, 3)), np.empty((count, 3))
        for k, (i, j) in enumerate(zip(first, second, strict=True)):
            if k % COAL.pairs_per_check == COAL.pairs_per_check - 1:
                checkpoint()
            (a, skin_a, local_a), (b, skin_b, local_b) = self._shape(int(i)), self._shape(int(j))
            pose_a, pose_b = _transform(T_first[k]) * local_a, _transform(T_second[k]) * local_b
            for request in self._requests:
                result = coal.DistanceResult()
                value = coal.distance(a, pose_a, b, pose_b, request, result)
                if (
                    abs(value) < COAL.largest_distance
                    and abs(float(result.normal @ result.normal) - 1) < 1e-6
                ):
                    distance[k], normal[k] = value + skin_a + skin_b, result.normal
                    point[k] = result.getNearestPoint2() + skin_b * result.normal
                    break
            else:
                distance[k], normal[k], point[k] = _lower_bound(
                    self._cores[i], T_first[k], self._cores[j], T_second[k]
                )
        return distance, normal, point

    def _shape(self, number: int) -> tuple[coal.CollisionGeometry, float, coal.Transform3s]:
        shape = self._shapes.get(number)
        # Two threads may both build it; all threads use the first one.
        return (
            self._shapes.setdefault(number, coal_shape(self._cores[number]))
            if shape is None
            else shape
        )


def _lower_bound(
    first: Core, T_first: Array, second: Core, T_second: Array
) -> tuple[float, Array, Array]:
    """Lower bound [m] on the signed distance, with its direction and a point of the second core.

    It is the largest separation along the line of centres and the axes of both cores.
    """
    offset = T_second[:3, :3] @ second.points.mean(axis=0) + T_second[:3, 3]
    offset = offset - T_first[:3, :3] @ first.points.mean(axis=0) - T_first[:3, 3]
    line = offset / max(float(np.linalg.norm(offset)), 1e-12)
    axes = np.vstack([T_first[:3, :3].T, T_second[:3, :3].T])
    directions = np.vstack([axes, -axes, line if np.linalg.norm(line) > 0.5 else axes[0]])
    lowest, which = _support(second, T_second, directions)
    gap = lowest + _support(first, T_first, -directions)[0]
    best = int(gap.argmax())
    return (
        float(gap[best]),
        directions[best],
        T_second[:3, :3] @ second.points[which[best]] + T_second[:3, 3],
    )


def _support(core: Core, T: Array, directions: Array) -> tuple[Array, npt.NDArray[np.intp]]:
    """Least n·x (k,) [m] over a core at T (4, 4) for directions n (k, 3), and the index (k,) of the
    attaining point.
    """
    in_core = directions @ T[:3, :3]
    heights = in_core @ core.points.T
    reach = core.disc_radius * np.hypot(in_core[:, 0], in_core[:, 1])
    return heights.min(axis=1) - reach + directions @ T[:3, 3], heights.argmin(axis=1)


def _request(tolerance: float) -> coal.DistanceRequest:
    request = coal.DistanceRequest(True, True)
    request.gjk_tolerance = request.epa_tolerance = tolerance
    request.gjk_max_iterations = request.epa_max_iterations = COAL.max_iterations
    return request


def coal_shape(core: Core) -> tuple[coal.CollisionGeometry, float, coal.Transform3s]:
    """Coal's shape of a core, its growth [m] beyond the core, and its pose in the frame of the
    core.

    A half-space has no such shape.
    """
    points, local = core.points, np.eye(4)
    if core.half_size is not None:
        return coal.Box(*(2 * core.half_size)), 0.0, _transform(local)
    if core.disc_radius:
        return coal.Cylinder(core.disc_radius, float(np.ptp(points[:, 2]))), 0.0, _transform(local)
    if len(points) <= 2:
        along = points[-1] - points[0]
        length = float(np.linalg.norm(along))
        local[:3, 3] = points.mean(axis=0)
        if length == 0:
            return coal.Sphere(COAL.skin), COAL.skin, _transform(local)
        local[:3, :3] = rotation_to(along / length)
        return coal.Capsule(COAL.skin, length), COAL.skin, _transform(local)
    vertices, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for vertex in points:
        vertices.append(vertex)
    # A triangle is a body with two faces and no volume.
    for triangle in [[0, 1, 2], [0, 2, 1]] if len(points) == 3 else core.triangles:
        triangles.append(coal.Triangle(*triangle))
    return coal.Convex(vertices, triangles), 0.0, _transform(local)


def _transform(T: Array) -> coal.Transform3s:
    return coal.Transform3s(np.ascontiguousarray(T[:3, :3]), np.ascontiguousarray(T[:3, 3]))
