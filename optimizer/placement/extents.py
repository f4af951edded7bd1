"""Boxes in the world around a moving point, for all places of its body."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.placement.mounts import about_z
from joulepath.optimizer.placement.region import COORDINATES, Group
from joulepath.optimizer.placement.space import Space


@dataclass(frozen=True, eq=False)
class Extent:
    """A box in the world from `low` to `high`, shape (3,) [m]."""

    low: Array
    high: Array

    @classmethod
    def around(cls, extents: Sequence[Extent]) -> Extent:
        """The smallest box around several."""
        return cls(
            np.stack([each.low for each in extents]).min(axis=0),
            np.stack([each.high for each in extents]).max(axis=0),
        )

    def along(self, direction: Array) -> tuple[float, float]:
        """Least and greatest component along a direction (3,) of the points of the box."""
        ends = np.sort([direction * self.low, direction * self.high], axis=0)
        return float(ends[0].sum()), float(ends[1].sum())

    def distance(self, other: Extent) -> float:
        """Least distance between points of two boxes [m]."""
        gap = np.maximum(self.low - other.high, other.low - self.high)
        return float(np.linalg.norm(np.maximum(gap, 0.0)))


class Extents:
    """Boxes around the points of the movable bodies of a placement.

    Args:
        space: the places.
    """

    def __init__(self, space: Space) -> None:
        self.space = space
        moved = space.placement.moved
        self._of_stop = {
            name: k
            for k, each in enumerate(moved)
            if isinstance(each.moves, Group)
            for name in each.moves.stops
        }

    def body_of_stop(self, stop: str) -> int | None:
        """Number of the body of a stop; None for a stop fixed in the world."""
        return self._of_stop.get(stop)

    def of_base(self, point: Array) -> Extent:
        """The box of a point (3,) [m] of the base frame."""
        if self.space.base_body < 0:
            T = self.space.placement.base
            at = T[:3, :3] @ point + T[:3, 3]
            return Extent(at, at)
        return self._of_body(self.space.base_body, point)

    def of_stop(self, stop: str, point: Array) -> Extent:
        """The box of a point (3,) [m], given in the world, on the body of a stop."""
        body = self._of_stop.get(stop)
        return Extent(point, point) if body is None else self._of_body(body, point)

    def _of_body(self, k: int, point: Array) -> Extent:
        body = self.space.bodies[k]
        axes = {axis.name: axis for axis in self.space.axes if axis.body == k}
        if body.places is not None:
            at = np.array([pose[:3, :3] @ point + pose[:3, 3] for pose in body.places])
            return Extent(at.min(axis=0), at.max(axis=0))
        ranges = [
            (axes[name].low, axes[name].high) if name in axes else (value, value)
            for name, value in zip(COORDINATES, body.nominal.tolist(), strict=True)
        ]
        low, high = np.array(ranges[:3]).T
        boxes = list[Extent]()
        for tilt in body.tilts or ():
            arm = tilt @ (point - body.pivot)
            offset = about_z(ranges[3][0]) @ arm
            spread = np.zeros(3)
            if "yaw" in axes:
                # any yaw: the point may be anywhere on its circle about the vertical
                offset, radius = np.array([0.0, 0.0, arm[2]]), float(np.hypot(arm[0], arm[1]))
                spread = np.array([radius, radius, 0.0])
            at = body.pivot + offset
            boxes.append(Extent(low + at - spread, high + at + spread))
        return Extent.around(boxes)
