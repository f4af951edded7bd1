"""Signed distances of any two convex cores by Coal (GJK and EPA), a pair at a time."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import coal
import numpy as np
import numpy.typing as npt
from scipy.spatial import ConvexHull

from models.robot import Array
from optimizer.problem.scene import Core

# of the distance [m], which Coal's own default of 1e-6 would leave to the optimiser's line search to stumble over
# Deep inside a round body its search for the depth may not end that sharply, and takes the next.
TOLERANCES = (1e-10, 1e-6, 1e-4)
MOST_ITERATIONS = 500
# a core that is a point or a segment is handed to Coal grown by this [m], since it takes nothing that thin
SKIN = 1e-2
# a distance beyond this [m] is Coal's way to say that it found none
BEYOND = 1e6


class ConvexPairs:
    """Distances between cores, by their number."""

    def __init__(self, cores: Sequence[Core]) -> None:
        self._cores = cores
        self._shapes: dict[int, tuple[coal.CollisionGeometry, float, coal.Transform3s]] = {}
        self._requests = [_request(tolerance) for tolerance in TOLERANCES]

    def nearest(
        self, first: Iterable[int], second: Iterable[int], T_first: Array, T_second: Array
    ) -> tuple[Array, Array, Array]:
        """Signed distance (k,), normal (k, 3) from first to second, and a point (k, 3) on the line of the two nearest.

        `first`, `second` (k,) number cores that stand at T_first, T_second (k, 4, 4).
        """
        count = len(T_first)
        distance, normal, point = np.empty(count), np.empty((count, 3)), np.empty((count, 3))
        for k, (i, j) in enumerate(zip(first, second, strict=True)):
            (a, skin_a, local_a), (b, skin_b, local_b) = self._shape(int(i)), self._shape(int(j))
            stand_a, stand_b = _pose(T_first[k]) * local_a, _pose(T_second[k]) * local_b
            for request in self._requests:
                result = coal.DistanceResult()
                found = coal.distance(a, stand_a, b, stand_b, request, result)
                if abs(found) < BEYOND and abs(float(result.normal @ result.normal) - 1) < 1e-6:
                    distance[k], normal[k], point[k] = found + skin_a + skin_b, result.normal, result.getNearestPoint2()
                    break
            else:
                distance[k], normal[k], point[k] = _rough(self._cores[i], T_first[k], self._cores[j], T_second[k])
        return distance, normal, point

    def _shape(self, number: int) -> tuple[coal.CollisionGeometry, float, coal.Transform3s]:
        shape = self._shapes.get(number)
        # two threads may both make it; all of them go on with the first
        return self._shapes.setdefault(number, coal_shape(self._cores[number])) if shape is None else shape


def _rough(first: Core, T_first: Array, second: Core, T_second: Array) -> tuple[float, Array, Array]:
    """The most that the line of centres or an axis of either body parts them by: never more than the distance."""
    centres = T_second[:3, :3] @ second.points.mean(axis=0) + T_second[:3, 3]
    centres = centres - T_first[:3, :3] @ first.points.mean(axis=0) - T_first[:3, 3]
    line = centres / max(float(np.linalg.norm(centres)), 1e-12)
    axes = np.vstack([T_first[:3, :3].T, T_second[:3, :3].T])
    directions = np.vstack([axes, -axes, line if np.linalg.norm(line) > 0.5 else axes[0]])
    lowest, which = _lowest(second, T_second, directions)
    gap = lowest + _lowest(first, T_first, -directions)[0]
    best = int(gap.argmax())
    return float(gap[best]), directions[best], T_second[:3, :3] @ second.points[which[best]] + T_second[:3, 3]


def _lowest(core: Core, T: Array, directions: Array) -> tuple[Array, npt.NDArray[np.intp]]:
    """How low (k,) a core at T (4, 4) reaches along directions (k, 3), and by which of its points."""
    turned = directions @ T[:3, :3]
    heights = turned @ core.points.T
    reach = core.ring * np.hypot(turned[:, 0], turned[:, 1])
    return heights.min(axis=1) - reach + directions @ T[:3, 3], heights.argmin(axis=1)


def _request(tolerance: float) -> coal.DistanceRequest:
    request = coal.DistanceRequest(True, True)
    request.gjk_tolerance = request.epa_tolerance = tolerance
    request.gjk_max_iterations = request.epa_max_iterations = MOST_ITERATIONS
    return request


def coal_shape(core: Core) -> tuple[coal.CollisionGeometry, float, coal.Transform3s]:
    """A core as Coal has it, how much thicker that is [m], and where it stands in the core's frame."""
    points, local = core.points, np.eye(4)
    if core.half is not None:
        return coal.Box(*(2 * core.half)), 0.0, _pose(local)
    if core.ring:
        return coal.Cylinder(core.ring, float(np.ptp(points[:, 2]))), 0.0, _pose(local)
    if len(points) <= 2:
        along = points[-1] - points[0]
        length = float(np.linalg.norm(along))
        local[:3, 3] = points.mean(axis=0)
        if length == 0:
            return coal.Sphere(SKIN), SKIN, _pose(local)
        z = along / length
        x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
        x /= np.linalg.norm(x)
        local[:3, :3] = np.column_stack([x, np.cross(z, x), z])
        return coal.Capsule(SKIN, length), SKIN, _pose(local)
    vertices, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    for vertex in points:
        vertices.append(vertex)
    for triangle in _outward(points):
        triangles.append(coal.Triangle(*triangle))
    return coal.Convex(vertices, triangles), 0.0, _pose(local)


def _outward(points: Array) -> list[list[int]]:
    """Triangles of the hull, their corners counterclockwise from outside."""
    hull = ConvexHull(points)
    corners = points[hull.simplices]
    faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    inward = np.einsum("ki,ki->k", faces, hull.equations[:, :3]) < 0
    triangles = hull.simplices.copy()
    triangles[inward] = triangles[inward][:, ::-1]
    result: list[list[int]] = triangles.tolist()
    return result


def _pose(T: Array) -> coal.Transform3s:
    return coal.Transform3s(np.ascontiguousarray(T[:3, :3]), np.ascontiguousarray(T[:3, 3]))
