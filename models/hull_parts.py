"""Division of the surfaces of bent links by planes into nearly convex parts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.spatial import ConvexHull, QhullError, cKDTree

from joulepath.models.hull_cover import heights
from joulepath.models.meshes import sampled
from joulepath.models.robot import Array, Mask
from joulepath.models.uploads.limits import Checkpoint, unwatched

Inside = Callable[[Array], Mask]
"""Whether points (k, 3) [m] lie in places out of reach of obstacles."""


def nowhere(points: Array) -> Mask:
    """The `Inside` of a surface without such places: false for all points."""
    return np.zeros(len(points), dtype=bool)


@dataclass(frozen=True)
class PartSettings:
    """Settings of the division."""

    most: int = 8
    """Largest number of parts of a link. Every part adds one distance computation per obstacle."""
    p99: float = 0.8
    """Limit on the 99th percentile of the excess, relative to the radius by which the hulls are
    grown [1]: larger hulls fill shallow hollows anyway. The excess of a point on the hull of a
    part, before the hull is grown, is its distance from the surface of the link. The division ends
    when this limit and `maximum` hold."""
    maximum: float = 3.0
    """Limit on the largest excess, relative to the same radius [1]."""
    free: float = 0.5e-3
    """Excess [m] without cost: about the distance between neighbouring points of the surface."""
    overlap: float = 1e-4
    """Distance [m] by which the parts on both sides extend beyond the dividing plane. The proof
    that the hulls cover the link then ends at triangles of this size."""
    gain: float = 0.0
    """Smallest decrease of the cost of a part at which it is divided, relative to this cost."""
    surface: int = 200_000
    """Number of points sampled on every mesh, to measure distances from the surface."""
    points: int | None = None
    """Number of random points that represent a part in the choice of its plane; None: triangles."""
    density: float = 12_000.0
    """Density of the points on a hull at which the excess is measured [1/m²]."""
    offsets: int = 9
    """Number of planes per direction; `DIRECTIONS` has thirteen directions."""
    trials: int = 40
    """Number of random planes near the best plane, per entry of `spreads`."""
    spreads: tuple[float, ...] = (0.3, 0.1)
    """Standard deviations of the random normals from the best normal [rad]."""
    shift: float = 0.03
    """Standard deviation of the random offsets per rad of spread [m/rad]: some tenths of a link's
    width."""


PARTS = PartSettings()
QUICK = PartSettings(
    most=4,
    p99=3.7,
    maximum=5.6,
    free=0.003,
    gain=0.3,
    surface=10_000,
    density=1_000.0,
    points=2_000,
    offsets=4,
    spreads=(),
)
"""Settings for the upload of a user's arm: a bent link takes about one second.

In random configurations, these hulls rarely give another collision result than the meshes.
"""
DIRECTIONS = [
    np.array(each) / np.linalg.norm(each)
    for each in product((-1.0, 0.0, 1.0), repeat=3)
    if each > (0.0, 0.0, 0.0)
]
"""Normals of the first planes: along axes and diagonals of the link frame."""


def below(triangles: Array, normal: Array, offset: float) -> Array:
    """Cut triangles or points to the half-space `normal · x <= offset`.

    Args:
        triangles: triangles, shape (t, 3, 3), or points, shape (t, 1, 3) [m].
        normal: unit normal of the plane, shape (3,).
        offset: offset of the plane along the normal [m].

    Returns:
        Triangles (k, 3, 3) that cover the cut surface, or the points (k, 1, 3) in the half-space.
    """
    height = triangles @ normal - offset
    if triangles.shape[1] == 1:
        return np.asarray(triangles[height[:, 0] <= 0])
    is_below = height <= 0
    count = is_below.sum(axis=1)
    pieces = [triangles[count == 3]]
    for corners in (1, 2):
        cut, h = triangles[count == corners], height[count == corners]
        is_lone = is_below[count == corners] == (corners == 1)
        rows, first = np.arange(len(cut)), is_lone.argmax(axis=1)
        (a, b, c), (ha, hb, hc) = (
            [each[rows, (first + k) % 3] for k in range(3)] for each in (cut, h)
        )
        to_b = a + (b - a) * (ha / (ha - hb))[:, None]
        to_c = a + (c - a) * (ha / (ha - hc))[:, None]
        if corners == 1:
            pieces.append(np.stack([a, to_b, to_c], axis=1))
        else:
            pieces += [np.stack([to_b, b, c], axis=1), np.stack([to_b, c, to_c], axis=1)]
    return np.concatenate(pieces)


@dataclass(frozen=True, eq=False)
class _Part:
    """A part of the surface of a link, with its convex hull."""

    triangles: Array
    """Triangles of the part, shape (t, 3, 3) [m]."""
    chosen: Array
    """Triangles or random points (c, 1, 3) [m] that represent the part in the choice of a plane."""
    planes: Array
    """Normals and offsets of the hull's faces, shape (f, 4), outward normals."""
    points: Array
    """Points on the hull (k, 3) [m], in order of decreasing distance from the link's surface."""
    distances: Array
    """Distances of the points from the link's surface, shape (k,) [m]."""
    far: int
    """Number of points with a distance above `PartSettings.free`; they come first."""
    area: float
    """Area of the hull per sampled point [m²]."""

    def above(self, points: Array) -> Array:
        """Heights (k,) [m] of points above the hull."""
        return heights(points, self.planes)


@dataclass(frozen=True, eq=False)
class Division:
    """A division of the surface of one link.

    Attributes:
        tree: points of the surface.
        inside: tells which points lie in places where the excess does not count.
        radius: radius by which the hulls are grown [m].
        settings: settings of the division.
        checkpoint: called for every plane; may raise to interrupt.
        rng: generator of the random planes.
    """

    tree: cKDTree
    inside: Inside
    radius: float
    settings: PartSettings
    checkpoint: Checkpoint
    rng: np.random.Generator

    def part(self, triangles: Array) -> _Part:
        """The part with the given triangles or points. Raises QhullError if they are flat."""
        chosen, few = triangles, self.settings.points
        if few is not None and triangles.shape[1] == 3 and len(triangles) > few:
            chosen = sampled(triangles, few, np.random.default_rng(0))[:, None]
        hull = ConvexHull(chosen.reshape(-1, 3))
        count = int(self.settings.density * hull.area) + 1
        points = sampled(hull.points[hull.simplices], count, np.random.default_rng(0))
        distances = np.asarray(self.tree.query(points)[0])
        order = (-distances).argsort()
        points, distances = points[order], distances[order]
        far = int((distances > self.settings.free).sum())
        counts = np.ones(count, dtype=bool)
        counts[:far] = ~self.inside(points[:far])
        return _Part(
            triangles,
            chosen,
            hull.equations,
            points[counts],
            distances[counts],
            int(counts[:far].sum()),
            hull.area / count,
        )

    def distances(self, part: _Part, others: Sequence[_Part], most: int | None = None) -> Array:
        """Distances (k,) [m] of the first `most` points that no grown hull of `others` contains."""
        counts = np.ones(len(part.points[:most]), dtype=bool)
        for other in others:
            counts[counts] = other.above(part.points[:most][counts]) >= self.radius
        return np.asarray(part.distances[:most][counts])

    def cost(self, part: _Part, others: Sequence[_Part]) -> float:
        """Integral of the fourth power of the excess over the hull of a part [m⁶].

        The fourth power makes the deepest hollows the most expensive, so they are divided first.
        """
        excess = self.distances(part, others, part.far) - self.settings.free
        return float(part.area * (excess**4).sum())

    def halves(self, part: _Part, others: Sequence[_Part]) -> tuple[_Part, _Part] | None:
        """Divide a part by the best plane; None if the cost would decrease by less than `gain`."""
        corners = part.chosen.reshape(-1, 3)
        best: tuple[float, Array, float] | None = None

        def attempt(normal: Array, offset: float) -> None:
            nonlocal best
            self.checkpoint()
            try:
                first, second = self._sides(part.chosen, normal, offset)
            except (QhullError, ValueError):
                return  # flat, or without a triangle
            cost = self.cost(first, [second, *others]) + self.cost(second, [first, *others])
            if best is None or cost < best[0]:
                best = cost, normal, offset

        for normal in DIRECTIONS:
            ends = np.quantile(corners @ normal, [0, 1])
            for share in np.linspace(0.0, 1.0, self.settings.offsets + 2)[1:-1]:
                attempt(normal, float(ends[0] + share * (ends[1] - ends[0])))
        for spread in self.settings.spreads:
            assert best is not None, "a body with a volume has a plane through it"
            _, normal, offset = best
            middle = corners[np.abs(corners @ normal - offset).argsort()[:20]].mean(axis=0)
            for _ in range(self.settings.trials):
                turned = normal + spread * self.rng.normal(size=3)
                turned /= np.linalg.norm(turned)
                shift = spread * self.settings.shift * self.rng.normal()
                attempt(turned, float(middle @ turned) + shift)
        if best is None or best[0] > (1 - self.settings.gain) * self.cost(part, others):
            return None
        return self._sides(part.triangles, *best[1:])

    def _sides(self, triangles: Array, normal: Array, offset: float) -> tuple[_Part, _Part]:
        """The parts below and above a plane.

        Raises:
            QhullError: a part is flat.
            ValueError: a part has no triangle.
        """
        overlap = self.settings.overlap
        return (
            self.part(below(triangles, normal, offset + overlap)),
            self.part(below(triangles, -normal, overlap - offset)),
        )


@dataclass(frozen=True)
class Rim:
    """The rim around a hollow in the face of a flange. A single plane cannot open such a hollow."""

    floor: float
    """Coordinate z of the dividing plane in the link frame [m].

    The plane lies beyond the floor of the hollow by more than the overlap of parts. The sign of z
    is the side of the face.
    """
    sectors: int
    """Number of equal sectors about the z axis into which the rim is divided."""

    def parts(self, triangles: Array) -> list[Array]:
        """Triangles (k, 3, 3) [m] of the link behind the plane, followed by one part per sector."""
        z = np.array([0.0, 0.0, np.sign(self.floor)])
        rim = below(triangles, -z, PARTS.overlap - abs(self.floor))
        found = [below(triangles, z, abs(self.floor))]
        for begin in 2 * np.pi * np.arange(self.sectors) / self.sectors:
            end = begin + 2 * np.pi / self.sectors
            after = np.array([np.sin(begin), -np.cos(begin), 0.0])
            before = np.array([-np.sin(end), np.cos(end), 0.0])
            found.append(below(below(rim, after, PARTS.overlap), before, PARTS.overlap))
        return found


def divided(
    surfaces: Sequence[Array],
    radius: float,
    inside: Inside,
    settings: PartSettings = PARTS,
    checkpoint: Checkpoint = unwatched,
) -> list[Array]:
    """Divide the surfaces of a link into parts; the hulls of the parts cover the link.

    The part of the largest cost is divided again, until the excess is within the limits.

    Args:
        surfaces: triangles (t, 3, 3) [m] of every mesh.
        radius: radius by which the hulls will be grown [m].
        inside: tells which points lie in places where the excess does not count.
        settings: settings of the division.
        checkpoint: called in every iteration; may raise to interrupt.

    Returns:
        The triangles (k, 3, 3) [m] of every part.

    Raises:
        QhullError: the surfaces are flat.
    """
    rng = np.random.default_rng(0)
    near = np.concatenate([sampled(each, settings.surface, rng) for each in surfaces])
    division = Division(cKDTree(near), inside, radius, settings, checkpoint, rng)
    parts = [division.part(np.concatenate(surfaces))]
    while len(parts) < settings.most:
        rest = [[each for each in parts if each is not part] for part in parts]
        pairs = list(zip(parts, rest, strict=True))
        excess = np.concatenate([division.distances(*pair) for pair in pairs])
        # Every hull of a body smaller than their growth may contain all points of the others.
        p99, maximum = np.percentile(excess, [99, 100]) if len(excess) else (0.0, 0.0)
        if p99 <= settings.p99 * radius and maximum <= settings.maximum * radius:
            break
        worst = int(np.argmax([division.cost(*pair) for pair in pairs]))
        halves = division.halves(*pairs[worst])
        if halves is None:
            break
        parts = [*rest[worst], *halves]
    return [part.triangles for part in parts]
