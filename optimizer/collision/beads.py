"""Lower bounds on distances to large bodies: beads that cover one body, against the box or cylinder of the other.

The ball around a board is as large as the board is long, and much of a cell lies within it. The distance from a point
to a box or a cylinder has a closed form; so many beads, a few on a segment and one around any other core, bound the
distance from below almost as well as the exact one, for a fraction of the time.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from models.robot import Array
from optimizer.collision.bodies import Body, Indices
from optimizer.collision.many_points import into, picked, placed, pose_columns

# beads of a body
COUNT = 4


class Beads:
    """Beads of all bodies, and the distances of those of one body to the box or cylinder of the other."""

    def __init__(self, bodies: Sequence[Body], pairs: Indices) -> None:
        self._links: Indices = np.array([body.link for body in bodies], dtype=np.intp)
        self._centres = np.array([_centres(body) for body in bodies]).reshape(-1, COUNT, 3).transpose(1, 2, 0).copy()
        self._radii = np.array([_radius(body) for body in bodies])
        self._T_core = pose_columns(np.array([body.T_link_core for body in bodies]).reshape(-1, 4, 4))
        # half sizes of boxes; cylinders have their radius for x and y
        self._half_sizes = np.array([_half_size(body) for body in bodies]).reshape(-1, 3).T.copy()
        self._round = np.array([body.core.disc_radius > 0 for body in bodies], dtype=bool)
        has_form = self._half_sizes[2] >= 0
        first, second = pairs.T
        # no beads cover a half-space
        unbounded = np.array([body.core.is_half_space for body in bodies], dtype=bool)
        self._has_bound = (has_form[first] | has_form[second]) & ~unbounded[first]
        self._formed = np.where(has_form[first], first, second)
        self._beaded = np.where(has_form[first], second, first)

    def distances(self, frames: Array, configuration: Indices, pair: Indices) -> Array:
        """Lower bounds (k,) [m] on the distances of the cores of pairs (k,) at configurations (k,), but for radii.

        The radius of the cores and the margins are not subtracted. Pairs without a box or a cylinder get -inf, and so
        do those whose cores may overlap.
        """
        result = np.full(len(pair), -np.inf)
        bounded = np.flatnonzero(self._has_bound[pair])
        if not bounded.size:
            return result
        configuration, pair = configuration[bounded], pair[bounded]
        formed, beaded = self._formed[pair], self._beaded[pair]
        T, links = pose_columns(frames), frames.shape[1]
        points = placed(picked(T, configuration * links + self._links[beaded]), picked(self._centres, beaded))
        # obstacles are in the frame of the base, which most pairs need no step into
        moving = np.flatnonzero(self._links[formed] > 0)
        if moving.size:
            T_moving = picked(T, configuration[moving] * links + self._links[formed[moving]])
            points[..., moving] = into(T_moving, points[..., moving])
        local = np.abs(into(picked(self._T_core, formed), points))
        is_round = np.flatnonzero(self._round[formed])
        if is_round.size:
            local[:, 0, is_round] = np.hypot(local[:, 0, is_round], local[:, 1, is_round])
            local[:, 1, is_round] = 0.0
        outside = np.maximum(local - picked(self._half_sizes, formed), 0.0)
        square = (outside[:, 0] ** 2 + outside[:, 1] ** 2 + outside[:, 2] ** 2).min(axis=0)
        bound = np.sqrt(square) - self._radii[beaded]
        result[bounded] = np.where(bound > 0, bound, -np.inf)
        return result


def _centres(body: Body) -> Array:
    """Centres (COUNT, 3) [m] of the beads in the link frame; the beads of a body that is no segment coincide."""
    if not body.is_segment:
        return np.tile(body.ball_centre, (COUNT, 1))
    fractions = (np.arange(COUNT) + 0.5) / COUNT
    return np.asarray(body.points[0] + fractions[:, None] * (body.points[-1] - body.points[0]))


def _radius(body: Body) -> float:
    """Radius [m] of the beads: they cover the core, without its own radius."""
    return body.ball_radius / COUNT if body.is_segment else body.ball_radius


def _half_size(body: Body) -> Array:
    """Half of the size (3,) [m] of a box or a cylinder about z; negative for any other core."""
    core = body.core
    if core.half_size is not None:
        return core.half_size
    if core.disc_radius > 0 and not core.is_half_space:
        return np.array([core.disc_radius, core.disc_radius, np.ptp(core.points[:, 2]) / 2])
    return np.full(3, -1.0)
