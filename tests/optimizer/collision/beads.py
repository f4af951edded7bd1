"""Lower bounds on distances by numpy: beads that cover one body, against the box or cylinder of the
other.
"""

from __future__ import annotations

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.collision.pair_arrays import PairArrays
from tests.optimizer.collision.many_points import into, picked, placed, pose_columns


class Beads:
    """Distances of the beads of one body to the box or cylinder of the other."""

    def __init__(self, arrays: PairArrays) -> None:
        self._arrays = arrays
        self._centres = arrays.bead_centres.transpose(1, 2, 0).copy()
        self._T_core = pose_columns(arrays.T_link_core.reshape(-1, 4, 4))
        self._half_sizes = arrays.form_sizes.T.copy()

    def distances(self, frames: Array, configuration: Indices, pair: Indices) -> Array:
        """Lower bounds (k,) [m] on the distances of the cores of pairs (k,) at configurations (k,),
        but for radii.

        The radius of the cores and the margins are not subtracted. Pairs without a box or a
        cylinder get -inf, and so do those whose cores may overlap.
        """
        arrays, result = self._arrays, np.full(len(pair), -np.inf)
        bounded = np.flatnonzero(arrays.formed[pair] >= 0)
        if not bounded.size:
            return result
        configuration, pair = configuration[bounded], pair[bounded]
        formed, beaded = arrays.formed[pair], arrays.beaded[pair]
        T, links = pose_columns(frames), frames.shape[1]
        points = placed(
            picked(T, configuration * links + arrays.links[beaded]), picked(self._centres, beaded)
        )
        # obstacles are in the frame of the base, which most pairs need no step into
        moving = np.flatnonzero(arrays.links[formed] > 0)
        if moving.size:
            T_moving = picked(T, configuration[moving] * links + arrays.links[formed[moving]])
            points[..., moving] = into(T_moving, points[..., moving])
        local = np.abs(into(picked(self._T_core, formed), points))
        is_cycle = np.flatnonzero(arrays.is_cycle[formed])
        if is_cycle.size:
            local[:, 0, is_cycle] = np.hypot(local[:, 0, is_cycle], local[:, 1, is_cycle])
            local[:, 1, is_cycle] = 0.0
        outside = np.maximum(local - picked(self._half_sizes, formed), 0.0)
        square = (outside[:, 0] ** 2 + outside[:, 1] ** 2 + outside[:, 2] ** 2).min(axis=0)
        bound = np.sqrt(square) - arrays.bead_radii[beaded]
        result[bounded] = np.where(bound > 0, bound, -np.inf)
        return result
