"""Bodies and the pairs of them that are checked, as arrays: what distances are computed from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.collision.bodies import Body, Indices

# beads that cover a body
BEADS = 4


class PairKind(IntEnum):
    """What computes the distance of a pair, by the cores of its first and second body."""

    SEGMENT_SEGMENT = 0
    BOX_SEGMENT = 1
    SEGMENT_BOX = 2
    HALF_SPACE = 3
    CONVEX = 4
    CLOUD = 5


@dataclass(frozen=True, eq=False)
class PairArrays:
    """Arrays of b bodies, in the frames of their links, and of p pairs.

    `points` (b, m, 3) [m] are those of the cores, of which the first `counts` (b,) are their own.
    `axes` (b, 3) and `disc_radii` (b,) [m] are those of cylinders, and `half_sizes` (b, 3) [m]
    those of boxes about `T_link_core` (b, 4, 4); else zero. Balls about `ball_centres` (b, 3) [m],
    and beads about `bead_centres` (b, BEADS, 3) [m], cover the cores without their `radii` (b,)
    [m].

    `pairs` (p, 2) are indices of bodies, and `growth` (p,) [m] what radii and margins take from
    their distance. `formed` (p,) is the body of a pair whose form, of half size `form_sizes` (b, 3)
    [m] about z, is `is_cycle` (b,) or a box; `beaded` (p,) is the other one. `formed` is negative
    where beads say nothing.
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
    bead_centres: Array
    bead_radii: Array
    form_sizes: Array
    is_cycle: Mask
    pairs: Indices
    kinds: Indices
    growth: Array
    formed: Indices
    beaded: Indices

    @staticmethod
    def of(bodies: Sequence[Body], pairs: Indices) -> PairArrays:
        """The arrays of bodies and of pairs (p, 2) of them."""
        cores = [body.core for body in bodies]
        most = max((len(body.points) for body in bodies), default=1)
        radii = np.array([core.radius for core in cores])
        growth = radii + np.array([body.margin for body in bodies])
        form_sizes = np.array([_form_size(body) for body in bodies]).reshape(-1, 3)
        has_form, (first, second) = form_sizes[:, 2] >= 0, pairs.T
        # no beads cover a half-space
        unbounded = np.array([core.is_half_space for core in cores], dtype=bool)
        has_bound = (has_form[first] | has_form[second]) & ~unbounded[first]
        return PairArrays(
            links=np.array([body.link for body in bodies], dtype=np.intp),
            # cores with fewer points repeat their last point. The box around a patch of a cloud
            # stands for the patch: its separations are lower bounds
            points=np.array(
                [b.points[np.minimum(np.arange(most), len(b.points) - 1)] for b in bodies]
            ).reshape(-1, most, 3),
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
            bead_centres=np.array([_bead_centres(body) for body in bodies]).reshape(-1, BEADS, 3),
            bead_radii=np.array(
                [body.ball_radius / (BEADS if body.is_segment else 1) for body in bodies]
            ),
            form_sizes=form_sizes,
            is_cycle=np.array([core.disc_radius > 0 for core in cores], dtype=bool),
            pairs=pairs,
            kinds=_kinds(bodies, pairs),
            growth=growth[pairs].sum(axis=1),
            formed=np.where(has_bound, np.where(has_form[first], first, second), -1),
            beaded=np.where(has_form[first], second, first),
        )


def _kinds(bodies: Sequence[Body], pairs: Indices) -> Indices:
    """The PairKind of every pair."""
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


def _bead_centres(body: Body) -> Array:
    """Centres (BEADS, 3) [m] of the beads in the link frame; the beads of a body that is no segment
    coincide.
    """
    if not body.is_segment:
        return np.tile(body.ball_centre, (BEADS, 1))
    fractions = (np.arange(BEADS) + 0.5) / BEADS
    return np.asarray(body.points[0] + fractions[:, None] * (body.points[-1] - body.points[0]))


def _form_size(body: Body) -> Array:
    """Half of the size (3,) [m] of a box or a cylinder about z; negative for any other core."""
    core = body.core
    if core.half_size is not None:
        return core.half_size
    if core.disc_radius > 0 and not core.is_half_space:
        return np.array([core.disc_radius, core.disc_radius, np.ptp(core.points[:, 2]) / 2])
    return np.full(3, -1.0)
