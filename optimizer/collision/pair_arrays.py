"""Bodies and their checked pairs as arrays, the input of distance computations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.collision.bodies import COVER_SPHERES, Body, Indices


class PairKind(IntEnum):
    """Method that computes the distance of a pair, by the cores of its first and second body."""

    SEGMENT_SEGMENT = 0
    BOX_SEGMENT = 1
    SEGMENT_BOX = 2
    HALF_SPACE = 3
    CONVEX = 4
    CLOUD = 5


@dataclass(frozen=True, eq=False)
class PairArrays:
    """Arrays of b bodies, in the frames of their links, and of p pairs.

    `points` (b, m, 3) [m] are the points of the cores; the first `counts` (b,) of them are
    distinct. `axes` (b, 3) and `disc_radii` (b,) [m] describe cylinders, and `half_sizes` (b, 3)
    [m] boxes about `T_link_core` (b, 4, 4); they are zero for other cores. Balls about
    `ball_centres` (b, 3) [m], and spheres about `cover_centres` (b, COVER_SPHERES, 3) [m], cover
    the cores without their `radii` (b,) [m].

    `pairs` (p, 2) are indices of bodies, and `growth` (p,) [m] is the sum of radii and margins to
    subtract from their distance. `primitive` (p,) is the body of a pair that is a cylinder
    (`is_cylinder` (b,)) or a box, of half size `primitive_half_sizes` (b, 3) [m] about z; `covered`
    (p,) is the other body. `primitive` is negative for pairs without a useful bound by covering
    spheres.
    """

    links: Indices
    points: Array
    counts: Indices
    axes: Array
    disc_radii: Array
    half_sizes: Array
    T_link_core: Array
    radii: Array
    ball_centres: Array
    ball_radii: Array
    cover_centres: Array
    cover_radii: Array
    primitive_half_sizes: Array
    is_cylinder: Mask
    pairs: Indices
    kinds: Indices
    growth: Array
    primitive: Indices
    covered: Indices

    @staticmethod
    def of(bodies: Sequence[Body], pairs: Indices) -> PairArrays:
        """Arrays of bodies, and of pairs (p, 2) of them."""
        cores = [body.core for body in bodies]
        max_points = max((len(body.points) for body in bodies), default=1)
        radii = np.array([core.radius for core in cores])
        covers = [body.cover for body in bodies]
        growth = radii + np.array([body.margin for body in bodies])
        primitive_half_sizes = np.array([_primitive_half_size(body) for body in bodies]).reshape(
            -1, 3
        )
        is_primitive, (first, second) = primitive_half_sizes[:, 2] >= 0, pairs.T
        # No spheres cover a half-space.
        unbounded = np.array([core.is_half_space for core in cores], dtype=bool)
        has_bound = (is_primitive[first] | is_primitive[second]) & ~unbounded[first]
        return PairArrays(
            links=np.array([body.link for body in bodies], dtype=np.intp),
            # Cores with fewer points repeat their last point. A patch of a cloud is represented by
            # the box around it, whose separations are lower bounds.
            points=np.array(
                [b.points[np.minimum(np.arange(max_points), len(b.points) - 1)] for b in bodies]
            ).reshape(-1, max_points, 3),
            counts=np.array([len(body.points) for body in bodies], dtype=np.intp),
            axes=np.array([body.T_link_core[:3, 2] for body in bodies]),
            disc_radii=np.array([core.disc_radius for core in cores]),
            half_sizes=np.array(
                [np.zeros(3) if core.half_size is None else core.half_size for core in cores]
            ),
            T_link_core=np.array([body.T_link_core for body in bodies]),
            radii=radii,
            ball_centres=np.array([body.ball_centre for body in bodies]).reshape(-1, 3),
            ball_radii=np.array([body.ball_radius for body in bodies]),
            cover_centres=np.array([centres for centres, _ in covers]).reshape(
                -1, COVER_SPHERES, 3
            ),
            cover_radii=np.array([radius for _, radius in covers]),
            primitive_half_sizes=primitive_half_sizes,
            is_cylinder=np.array([core.disc_radius > 0 for core in cores], dtype=bool),
            pairs=pairs,
            kinds=_kinds(bodies, pairs),
            growth=growth[pairs].sum(axis=1),
            primitive=np.where(has_bound, np.where(is_primitive[first], first, second), -1),
            covered=np.where(is_primitive[first], second, first),
        )


def _kinds(bodies: Sequence[Body], pairs: Indices) -> Indices:
    """PairKind of every pair."""
    half_space = np.array([body.core.is_half_space for body in bodies], dtype=bool)[pairs]
    segment = np.array([body.is_segment for body in bodies], dtype=bool)[pairs]
    box = np.array([body.core.half_size is not None for body in bodies], dtype=bool)[pairs]
    of_cloud = np.array([body.cloud is not None for body in bodies], dtype=bool)[pairs]
    conditions = {
        PairKind.HALF_SPACE: half_space[:, 0],
        PairKind.SEGMENT_SEGMENT: segment.all(axis=1),
        PairKind.BOX_SEGMENT: box[:, 0] & segment[:, 1],
        PairKind.SEGMENT_BOX: segment[:, 0] & box[:, 1],
        PairKind.CLOUD: of_cloud[:, 0],
    }
    return np.select(
        list(conditions.values()), [int(kind) for kind in conditions], int(PairKind.CONVEX)
    ).astype(np.intp)


def _primitive_half_size(body: Body) -> Array:
    """Half of the size (3,) [m] of a box or of a cylinder about z; negative for any other core."""
    core = body.core
    if core.half_size is not None:
        return core.half_size
    if core.disc_radius > 0 and not core.is_half_space:
        return np.array([core.disc_radius, core.disc_radius, np.ptp(core.points[:, 2]) / 2])
    return np.full(3, -1.0)
