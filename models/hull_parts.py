"""Surfaces of bent links, divided by planes into parts that are nearly convex."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.spatial import ConvexHull, QhullError, cKDTree

from joulepath.models.meshes import sampled
from joulepath.models.robot import Array, Mask
from joulepath.models.uploads.limits import Checkpoint, unwatched

Inside = Callable[[Array], Mask]
"""Whether points (k, 3) [m] lie where no obstacle can be."""


def nowhere(points: Array) -> Mask:
    """No point lies where no obstacle can be."""
    return np.zeros(len(points), dtype=bool)


@dataclass(frozen=True)
class PartSettings:
    """Settings of the division."""

    most: int = 8
    """Largest number of parts of a link. Every part adds a distance per obstacle."""
    p99: float = 1.2e-3
    """99th percentile of the excess of the parts' hulls, before they are grown, over the surface
    [m] from which on no part is divided."""
    maximum: float = 4.5e-3
    """Largest such excess [m]."""
    free: float = 0.5e-3
    """Excess [m] that costs nothing: about the distance between the points of the surface."""
    overlap: float = 1e-4
    """Distance [m] by which both parts reach beyond the plane. The proof of the cover then ends at
    triangles of this size."""
    gain: float = 0.0
    """Least decrease of the cost of a part by its division, relative to this cost."""
    surface: int = 200_000
    """Points of every mesh, from which distances are measured."""
    points: int | None = None
    """Random points of a part, from which its planes are chosen; None for its triangles."""
    density: float = 12_000.0
    """Points of a hull per m², at which its excess is measured."""
    offsets: int = 9
    """Planes per direction, of thirteen directions."""
    trials: int = 40
    """Random planes around the best plane, per entry of `spreads`."""
    spreads: tuple[float, ...] = (0.3, 0.1)
    """Standard deviations of the normal [rad]."""
    shift: float = 0.03
    """Standard deviation of the offset per spread [m]: some tenths of the width of a link."""


PARTS = PartSettings()
QUICK = PartSettings(
    most=4,
    p99=0.010,
    maximum=0.015,
    free=0.003,
    gain=0.3,
    surface=10_000,
    density=1_000.0,
    points=2_000,
    offsets=4,
    spreads=(),
)
"""For an arm of a user, who waits: a bent link takes about a second, and random configurations
rarely collide other than on the meshes."""
DIRECTIONS = [
    np.array(each) / np.linalg.norm(each)
    for each in product((-1.0, 0.0, 1.0), repeat=3)
    if each > (0.0, 0.0, 0.0)
]
"""Normals of the first planes: along axes and diagonals of the link frame."""


def below(triangles: Array, normal: Array, offset: float) -> Array:
    """The pieces (k, 3, 3) of triangles (t, 3, 3) with `normal · x <= offset`; of points (t, 1, 3),
    those (k, 1, 3) that meet it.
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
    """A part of a surface: its triangles, those or points from which planes are chosen, planes of
    the hull, points on the hull in order of decreasing distance from the surface of the link, and
    the area [m²] per point. The first `far` points are farther away than `PartSettings.free`.
    """

    triangles: Array
    chosen: Array
    planes: Array
    points: Array
    distances: Array
    far: int
    area: float

    def above(self, points: Array) -> Array:
        """Heights (k,) [m] of points above the hull."""
        return np.asarray((points @ self.planes[:, :3].T + self.planes[:, 3]).max(axis=1))


@dataclass(frozen=True, eq=False)
class Division:
    """A division of the surface of one link.

    Attributes:
        tree: points of the surface.
        inside: the places that do not count.
        radius: radius by which the hulls are grown [m].
        settings: settings of the division.
        checkpoint: called for every plane; may raise to interrupt.
        rng: of the random planes.
    """

    tree: cKDTree
    inside: Inside
    radius: float
    settings: PartSettings
    checkpoint: Checkpoint
    rng: np.random.Generator

    def part(self, triangles: Array) -> _Part:
        """A part of these triangles. Raises QhullError for flat ones."""
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
        """Distances (k,) [m] of the first `most` points of a part, but those inside the others."""
        counts = np.ones(len(part.points[:most]), dtype=bool)
        for other in others:
            counts[counts] = other.above(part.points[:most][counts]) >= self.radius
        return np.asarray(part.distances[:most][counts])

    def cost(self, part: _Part, others: Sequence[_Part]) -> float:
        """Integral of the fourth power of the excess over the surface [m⁶]: deep hollows cost most,
        and are divided first.
        """
        excess = self.distances(part, others, part.far) - self.settings.free
        return float(part.area * (excess**4).sum())

    def halves(self, part: _Part, others: Sequence[_Part]) -> tuple[_Part, _Part] | None:
        """Divide a part into two, by the best plane found; None if that would gain too little."""
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
                attempt(turned, middle @ turned + spread * self.settings.shift * self.rng.normal())
        if best is None or best[0] > (1 - self.settings.gain) * self.cost(part, others):
            return None
        return self._sides(part.triangles, *best[1:])

    def _sides(self, triangles: Array, normal: Array, offset: float) -> tuple[_Part, _Part]:
        """The parts below and above a plane. Raises QhullError for a flat one, ValueError for one
        without a triangle.
        """
        overlap = self.settings.overlap
        return (
            self.part(below(triangles, normal, offset + overlap)),
            self.part(below(triangles, -normal, overlap - offset)),
        )


@dataclass(frozen=True)
class Rim:
    """The rim of a hollow in the face of a flange. No single plane opens such a hollow."""

    floor: float
    """Height z in the link frame [m] beyond its floor by more than the overlap of parts, with the
    sign of the side that the face is on."""
    sectors: int
    """Number of equal sectors about the z axis into which it is divided."""

    def parts(self, triangles: Array) -> list[Array]:
        """Triangles (k, 3, 3) [m] of the link behind the floor, then those of each sector."""
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
        inside: the places where the excess does not count.
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
        p99, maximum = np.percentile(
            np.concatenate([division.distances(*pair) for pair in pairs]), [99, 100]
        )
        if p99 <= settings.p99 and maximum <= settings.maximum:
            break
        worst = int(np.argmax([division.cost(*pair) for pair in pairs]))
        halves = division.halves(*pairs[worst])
        if halves is None:
            break
        parts = [*rest[worst], *halves]
    return [part.triangles for part in parts]
