"""Lower bounds on distances by numpy: spheres that cover one body, against the box or cylinder of
the other.
"""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.collision.pair_arrays import PairArrays
from tests.optimizer.collision.many_points import into, picked, placed, pose_columns


class CoverSpheres:
    """Distances of the spheres that cover one body to the box or cylinder of the other."""

    def __init__(self, arrays: PairArrays) -> None:
        self._arrays = arrays
        self._centres = arrays.cover_centres.transpose(1, 2, 0).copy()
        self._T_core = pose_columns(arrays.T_link_core.reshape(-1, 4, 4))
        self._half_sizes = arrays.primitive_half_sizes.T.copy()

    def distances(self, frames: Array, configuration: Indices, pair: Indices) -> Array:
        """Lower bounds (k,) [m] on the distances of the cores of pairs (k,) at configurations (k,),
        but for radii.

        The radius of the cores and the margins are not subtracted. Pairs without a box or a
        cylinder get -inf, and so do those whose cores may overlap.
        """
        arrays, result = self._arrays, np.full(len(pair), -np.inf)
        bounded = np.flatnonzero(arrays.primitive[pair] >= 0)
        if not bounded.size:
            return result
        configuration, pair = configuration[bounded], pair[bounded]
        primitive, covered = arrays.primitive[pair], arrays.covered[pair]
        T, links = pose_columns(frames), frames.shape[1]
        points = placed(
            picked(T, configuration * links + arrays.links[covered]), picked(self._centres, covered)
        )
        # obstacles are in the frame of the base, which most pairs need no step into
        moving = np.flatnonzero(arrays.links[primitive] > 0)
        if moving.size:
            T_moving = picked(T, configuration[moving] * links + arrays.links[primitive[moving]])
            points[..., moving] = into(T_moving, points[..., moving])
        local = np.abs(into(picked(self._T_core, primitive), points))
        is_cylinder = np.flatnonzero(arrays.is_cylinder[primitive])
        if is_cylinder.size:
            local[:, 0, is_cylinder] = np.hypot(local[:, 0, is_cylinder], local[:, 1, is_cylinder])
            local[:, 1, is_cylinder] = 0.0
        outside = np.maximum(local - picked(self._half_sizes, primitive), 0.0)
        square = (outside[:, 0] ** 2 + outside[:, 1] ** 2 + outside[:, 2] ** 2).min(axis=0)
        bound = np.sqrt(square) - arrays.cover_radii[covered]
        result[bounded] = np.where(bound > 0, bound, -np.inf)
        return result
