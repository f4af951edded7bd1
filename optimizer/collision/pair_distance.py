"""Signed distances and witness points of pairs of bodies, by the C library or by Coal.

One call computes many pairs at many configurations. Index arrays (k,) select the computed cases:
`configuration` is a row of `frames` (n, nq + 1, 4, 4), the T_base_link [m] of every link, and
`pair` is a row of the pairs. All distances have the radii and the margins of both bodies
subtracted.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.models.rows import Rows
from joulepath.optimizer.collision.bodies import Body, Indices
from joulepath.optimizer.collision.cloud_pairs import CloudPairs
from joulepath.optimizer.collision.coal_distance import ConvexPairs
from joulepath.optimizer.collision.compiled_distances import ClearanceCheck, CompiledDistances
from joulepath.optimizer.collision.pair_arrays import PairArrays, PairKind


@dataclass(frozen=True)
class WitnessPoints(Rows):
    """Nearest points of k pairs: signed distance (k,) [m], unit normal (k, 3) from first to second
    body, and a point.

    `point` (k, 3) [m] lies on the line through the two nearest points, in the base frame like
    `normal`.
    """

    distance: Array
    normal: Array
    point: Array


class PairGeometry:
    """Bodies on the links of an arm of nq joints, and the `pairs` (p, 2) of them whose distances
    are computed.

    The first body of a pair is on the link nearer to the base. A half-space may only be first, and
    on link 0.
    """

    def __init__(self, bodies: Sequence[Body], pairs: Indices, nq: int) -> None:
        self._arrays = arrays = PairArrays.of(bodies, pairs)
        self.links: Indices = arrays.links
        # pairs (p,) whose first body is a patch of a cloud
        self.is_cloud = arrays.kinds == PairKind.CLOUD
        # pairs (p,) whose distance is exact, not iterated
        self.is_closed_form = (arrays.kinds != PairKind.CONVEX) & ~self.is_cloud
        self._compiled = CompiledDistances(arrays, nq)
        self._clouds = CloudPairs(bodies)
        self._convex = ConvexPairs([body.core for body in bodies])

    def bounds(
        self, frames: Array, pairs: Indices, within: float, known: Array | None = None
    ) -> tuple[Array, Indices, Indices]:
        """Lower bounds, see `CompiledDistances.bounds`."""
        return self._compiled.bounds(frames, pairs, within, known)

    def cover_bounds(self, frames: Array, configuration: Indices, pair: Indices) -> Array:
        """Lower bounds by covering spheres, see `CompiledDistances.cover_bounds`."""
        return self._compiled.cover_bounds(frames, configuration, pair)

    def witness_points(
        self,
        frames: Array,
        configuration: Indices,
        pair: Indices,
        within: float = np.inf,
        part: Indices | None = None,
    ) -> WitnessPoints:
        """Witness points of pairs (k,) at configurations (k,).

        The distance of a patch of a cloud is the distance of its nearest part, or of `part` (k,) if
        that is not negative. The distances of patches and of convex bodies without a closed form
        are infinite if they exceed `within` [m].
        """
        result = WitnessPoints(*self._compiled.witness_points(frames, configuration, pair, within))
        remaining = np.flatnonzero(np.isnan(result.distance))
        of_cloud = self.is_cloud[pair[remaining]]
        for chosen, is_cloud in ((remaining[~of_cloud], False), (remaining[of_cloud], True)):
            if not chosen.size:
                continue
            selection = frames, configuration[chosen]
            if is_cloud:
                parts = np.full(len(chosen), -1) if part is None else part[chosen]
                beyond = within + self._arrays.growth[pair[chosen]]
                witness = self._clouds.witness_points(
                    *selection, *self._bodies(pair[chosen]), beyond, parts
                )
            else:
                witness = self._by_coal(*selection, pair[chosen])
            result.distance[chosen], result.normal[chosen], result.point[chosen] = witness
        result.distance[:] -= self._arrays.growth[pair]
        return result

    def surface_points(self, pair: Indices, witness: WitnessPoints) -> Array:
        """Nearest points (k, 2, 3) [m] of the first and the second body of pairs (k,), without
        margins.
        """
        first, second = self._bodies(pair)
        gap = (witness.distance + self._arrays.growth[pair])[:, None] * witness.normal
        # The witness point is on the first core for these pairs, and on the second core for all
        # others.
        on_first = (self._arrays.kinds[pair] == PairKind.SEGMENT_BOX)[:, None]
        cores = (
            witness.point - np.where(on_first, 0.0, gap),
            witness.point + np.where(on_first, gap, 0.0),
        )
        radii = self._arrays.radii
        outward = radii[first][:, None] * witness.normal, -radii[second][:, None] * witness.normal
        return np.stack([core + out for core, out in zip(cores, outward, strict=True)], axis=1)

    def near_parts(
        self, frames: Array, configuration: Indices, pair: Indices, within: Array
    ) -> tuple[Indices, Indices]:
        """All (case, part) (m,) of clouds with distances of at most `within` (k,) [m], for pairs
        (k,) of patches.

        A few parts beyond it may be included.
        """
        return self._clouds.near(
            frames, configuration, *self._bodies(pair), within + self._arrays.growth[pair]
        )

    def separations(
        self,
        frames: Array,
        begin: Indices,
        end: Indices,
        pair: Indices,
        normals: tuple[Array, Array],
        part: Indices,
    ) -> Array:
        """Separations, see `CompiledDistances.separations`.

        If `part` (k,) is not negative, the first body is this part of a cloud, which does not move;
        otherwise it is the box around the patch.
        """
        result = self._compiled.separations(frames, begin, end, pair, normals)
        chosen = np.flatnonzero(part >= 0)
        if chosen.size:
            result[chosen] = self._of_parts(
                frames,
                (begin[chosen], end[chosen]),
                pair[chosen],
                [each[chosen] for each in normals],
                part[chosen],
            )
        return result

    def _of_parts(
        self,
        frames: Array,
        at_both: tuple[Indices, Indices],
        pair: Indices,
        normals: Sequence[Array],
        part: Indices,
    ) -> Array:
        """Separations (k,) [m] of parts of clouds."""
        first, second = self._bodies(pair)
        best = np.full(len(pair), -np.inf)
        for normal in normals:
            highest = self._clouds.highest(first, part, normal) + self._arrays.growth[pair]
            lowest = [self._compiled.supports(frames, at, second, normal) for at in at_both]
            best = np.maximum(best, np.minimum(*lowest) - highest)
        return np.asarray(best)

    def clearance_check(self, placements: Array, levers: Array, reserve: float) -> ClearanceCheck:
        """A check of all pairs without clouds, see `CompiledDistances.clearance_check`; `levers`
        (p, n) are those of all pairs.
        """
        pairs = np.flatnonzero(~self.is_cloud)
        return self._compiled.clearance_check(placements, pairs, levers[pairs], reserve)

    def gradients(
        self, frames: Array, configuration: Indices, pair: Indices, witness: WitnessPoints
    ) -> Array:
        """Gradients of signed distances, see `CompiledDistances.gradients`."""
        return self._compiled.gradients(frames, configuration, pair, witness.normal, witness.point)

    def _bodies(self, pair: Indices) -> tuple[Indices, Indices]:
        """First and second bodies of pairs (k,)."""
        first, second = self._arrays.pairs[pair].T
        return first, second

    def _by_coal(
        self, frames: Array, configuration: Indices, pair: Indices
    ) -> tuple[Array, Array, Array]:
        T_link_core, bodies = self._arrays.T_link_core, self._bodies(pair)
        T_first, T_second = (
            frames[configuration, self.links[body]] @ T_link_core[body] for body in bodies
        )
        return self._convex.witness_points(
            bodies[0].tolist(), bodies[1].tolist(), T_first, T_second
        )
