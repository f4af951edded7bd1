"""Lower bound over boxes of places, by all configurations that reach the stops from a box.

It is known for six-joint arms of the forms of `pose_cells`, and for cycles whose stops are poses or
joint positions, reached without lines or paths.

**Configurations.** While the base, or a group, is anywhere in a box of places, a point of the
flange at a stop is within a cylinder about its position for the middle of the box, and the
directions of the tool turn by no more than the yaw does. `PoseCells` has eight boxes of joint
positions that hold all configurations of such poses.

**Moves.** Between two boxes, each joint travels at least their distance, up to full turns. The move
needs at least `FixedCopperEnergy` of this displacement, plus 1 + 2 η per joule of potential gain.
The gains of all moves add up to that of the cycle, which `region_bound` bounds: with configurations
in boxes, the gains of single moves would be uncertain by far more.

**Places.** The least chain of boxes through all stops bounds the box of places. The boxes of least
bound are split first.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.bounds.net_energy import FixedCopperEnergy, most_copper
from joulepath.optimizer.bounds.subdivide import Boxes, SearchLimits, Subdivision
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.deadline import Deadline, end_if_stopped
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.covers.pose_cells import PoseCells, pose_cells_of
from joulepath.optimizer.kinematics.tcp import flange_pose
from joulepath.optimizer.motion.seven_segment import shortest_duration
from joulepath.optimizer.placement.extents import Extents
from joulepath.optimizer.placement.region import COORDINATES
from joulepath.optimizer.placement.region_bound import CycleBound
from joulepath.optimizer.placement.space import Place, Space
from joulepath.optimizer.problem.cycle import START, Cycle
from joulepath.optimizer.problem.pose import Pose
from joulepath.optimizer.problem.problem import DURATIONS
from joulepath.optimizer.problem.stops import PlannedMove
from joulepath.optimizer.problem.targets import Single, members


@dataclass(frozen=True)
class BoxBoundSettings:
    """Settings of the bound; any values give a valid bound."""

    split: int = 64
    """Number of boxes of places split in a round."""
    rounds: int = 24
    """Most rounds."""
    smallest: float = 0.002
    """Half side below which a box is not split [m]."""
    copper: float = 0.4
    """Share of the greatest η."""
    most_targets: int = 4
    """Most targets of a stop; the pairs of boxes grow with their square."""
    first_axis: float = 1e-9
    """Difference of directions, and distance [m], of the first axis from the vertical through the
    base up to which they are the same."""


BOX_BOUND = BoxBoundSettings()


def box_bound(space: Space, end: Deadline) -> float | None:
    """Lower bound on the objective of all cycles, times their weights, at every place.

    Args:
        space: the places.
        end: instant at which the bound so far is returned.

    Returns:
        The bound [J]; None where none is known.
    """
    cells = pose_cells_of(space.placement.cycles[0].cycle.arm.robot.model)
    if cells is None or not all(_is_known(each.cycle) for each in space.placement.cycles):
        return None
    parts = _PlaceBoxBound(space, cells).run(SearchLimits(BOX_BOUND.rounds, end))
    least = float(parts.value.min(initial=np.inf))
    return least if np.isfinite(least) else None


def _is_known(cycle: Cycle) -> bool:
    law = cycle.arm.friction_law
    targets = [members(to) for to in (cycle.start, *(stop.target for stop in cycle.stops))]
    return (
        cycle.objective == "electrical"
        and cycle.order is None
        and not cycle.has_passes
        and all(move.tool_path is None for move in cycle.moves)
        and all(len(to) <= BOX_BOUND.most_targets for to in targets)
        and all(isinstance(each, Pose | np.ndarray) for to in targets for each in to)
        and bool(min(law.coulomb.min(), law.curved.min(), law.viscous.min()) >= 0)
    )


@dataclass(frozen=True)
class _PlaceBoxes(Boxes):
    """Boxes of places; `centre` and `half` (b, n) [m, rad] are along the axes."""

    choice: Indices
    """Number of the discrete choice, shape (b,)."""


@dataclass(frozen=True)
class _Ends:
    """Boxes of configurations at a stop for b boxes of places.

    Attributes:
        centre: middles, shape (b, n, nq) [rad].
        half: half sides, shape (b, n, nq) [rad].
        held: mask (b, n) of the boxes that may hold a configuration.
    """

    centre: Array
    half: Array
    held: Mask


class _PlaceBoxBound(Subdivision[_PlaceBoxes]):
    """Boxes of places with the bounds of all cycles."""

    def __init__(self, space: Space, cells: PoseCells) -> None:
        self.space = space
        self.scale = np.array([axis.scale for axis in space.axes])
        extents, count = Extents(space), len(space.placement.cycles)
        self.cycles = [_CycleBoxes(space, cells, extents, k) for k in range(count)]

    def first(self) -> _PlaceBoxes:
        """The whole region, for every discrete choice."""
        count, axes = len(self.space.choices), self.space.axes
        low, high = (np.array([getattr(axis, end) for axis in axes]) for end in ("low", "high"))
        middle, half = (np.tile(each, (count, 1)) for each in ((low + high) / 2, (high - low) / 2))
        return self._bounded(middle, half, np.arange(count))

    def chosen(self, parts: _PlaceBoxes, number: int) -> Indices:
        """The boxes of least bound that are not too small."""
        size = (parts.half / self.scale).max(axis=1, initial=0.0)
        return np.flatnonzero(size > BOX_BOUND.smallest)[: BOX_BOUND.split]

    def divided(self, parts: _PlaceBoxes, rows: Indices) -> _PlaceBoxes:
        """Both halves of boxes, split along the widest side."""
        boxes = parts[rows]
        step = np.zeros_like(boxes.half)
        widest = (boxes.half / self.scale).argmax(axis=1)
        step[np.arange(len(rows)), widest] = boxes.half[np.arange(len(rows)), widest] / 2
        halves = self._bounded(
            np.concatenate([boxes.centre - step, boxes.centre + step]),
            np.tile(boxes.half - step, (2, 1)),
            np.tile(boxes.choice, 2),
        )
        value = np.maximum(halves.value, np.tile(boxes.value, 2))
        return _PlaceBoxes(value, halves.centre, halves.half, halves.choice)

    def _bounded(self, centre: Array, half: Array, choice: Indices) -> _PlaceBoxes:
        value = np.zeros(len(centre))
        for k in range(0, len(centre), BOX_BOUND.split):
            end_if_stopped()
            rows = slice(k, k + BOX_BOUND.split)
            at = zip(choice[rows], centre[rows], strict=True)
            places = [self.space.place(self.space.choices[c], x) for c, x in at]
            for weighted, cycle in zip(self.space.placement.cycles, self.cycles, strict=True):
                value[rows] += weighted.weight * cycle.bounds(places, half[rows])
        return _PlaceBoxes(value, centre, half, choice)


class _CycleBoxes:
    """Bounds of one cycle in boxes of places.

    Args:
        space: the places.
        cells: boxes of configurations of the arm.
        extents: boxes of points in the world.
        number: number of the cycle.
    """

    def __init__(self, space: Space, cells: PoseCells, extents: Extents, number: int) -> None:
        self.space, self.cells, self.number = space, cells, number
        self.cycle = cycle = space.placement.cycles[number].cycle
        self.body_of_stop = extents.body_of_stop
        bound = CycleBound(cycle, extents)
        self.eta = BOX_BOUND.copper * min(most_copper(move.arm) for move in cycle.moves)
        self.fixed = bound.dwells + (1 + 2 * self.eta) * bound.gain
        self.targets: dict[str, tuple[Single, ...]] = {START: members(cycle.start)}
        self.targets |= {stop.name: members(stop.target) for stop in cycle.stops}
        self.tool = float(np.linalg.norm(cells.point - cycle.arm.T_flange_tcp[:3, 3]))
        # whether a yaw of an upright base turns the first joint alone
        aside = np.append(cells.up[:2], cells.origin[:2])
        self.is_first_axis_upright = bool(np.abs(aside).max() < BOX_BOUND.first_axis)
        self.is_posed = all(isinstance(t, Pose) for each in self.targets.values() for t in each)

    def bounds(self, places: Sequence[Place], half: Array) -> Array:
        """Bounds (b,) [J] of boxes with given middles and half sides (b, n) [m, rad]; inf for a box
        from which a stop is out of reach.
        """
        seen = [self.space.stops(place)[self.number] for place in places]
        ends = {
            name: self._ends(name, np.array([each[name] for each in seen]), places, half)
            for name in self.targets
        }
        count = ends[START].held.shape[1]
        through = np.where(ends[START].held[:, None], 0.0, np.inf)
        if self.cycle.closed:
            through = np.where(np.eye(count, dtype=bool), through, np.inf)
        for move in self.cycle.moves:
            cost = self._costs(move, ends[move.start], ends[move.goal])
            through = (through[:, :, :, None] + cost[:, None]).min(axis=2)
        least = np.diagonal(through, axis1=1, axis2=2) if self.cycle.closed else through[:, 0]
        return np.asarray(least.min(axis=1) + self.fixed)

    def _costs(self, move: PlannedMove, start: _Ends, goal: _Ends) -> Array:
        """Bounds (b, s, g) [J] of a move without its potential gain."""
        apart = np.abs(wrapped(goal.centre[:, None] - start.centre[:, :, None]))
        apart = np.maximum(apart - goal.half[:, None] - start.half[:, :, None], 0.0)
        possible = start.held[:, :, None] & goal.held[:, None]
        displacement, arm = apart[possible], move.arm
        shortest = shortest_duration(displacement, arm.active_limits)
        costs = np.full(possible.shape, np.inf)
        costs[possible] = FixedCopperEnergy.without_gain(arm, displacement, self.eta).least(
            np.maximum(shortest, DURATIONS.least), np.full(len(shortest), DURATIONS.longest)
        )
        return costs

    def _ends(self, name: str, T: Array, places: Sequence[Place], half: Array) -> _Ends:
        """Boxes of configurations at a stop; T (b, 4, 4) is the pose of its body seen from the
        base.
        """
        b, cells = len(places), list[_Ends]()
        for target in self.targets[name]:
            if not isinstance(target, Pose):
                assert isinstance(target, np.ndarray)
                q = np.tile(target, (b, 1, 1))
                cells.append(_Ends(q, np.zeros_like(q), np.ones((b, 1), dtype=bool)))
                continue
            tcp = T @ target.T
            spread = [
                self._spread(name, target, *each)
                for each in zip(places, half, tcp[:, :3, 3], strict=True)
            ]
            flange = flange_pose(tcp, self.cycle.arm.T_flange_tcp)
            cells.append(_Ends(*self.cells.boxes(flange, *np.array(spread).T)))
        return _Ends(
            np.concatenate([each.centre for each in cells], axis=1),
            np.concatenate([each.half for each in cells], axis=1),
            np.concatenate([each.held for each in cells], axis=1),
        )

    def _spread(
        self, name: str, target: Pose, place: Place, half: Array, position: Array
    ) -> tuple[float, float, float]:
        """How far the pose of a stop changes within a box of places with half sides (n,) [m, rad].

        Args:
            name: name of the stop.
            target: its pose in the world.
            place: middle of the box.
            half: half sides of the box, shape (n,) [m, rad].
            position: position (3,) [m] of the TCP seen from the base.

        Returns:
            `h` [rad], `across` and `above` [m] of `PoseCells`.
        """
        space, sides = self.space, np.zeros((len(self.space.bodies) + 1, 4))
        for axis, side in zip(space.axes, half, strict=True):
            sides[axis.body, COORDINATES.index(axis.name)] = side
        # the row of zeros is that of a body that does not move
        base, body = space.base_body, self.body_of_stop(name)
        k = -1 if body is None else body
        shift, turns = sides[base, :3] + sides[k, :3], [sides[base, 3], sides[k, 3]]
        R_world_base = space.base(place)[:3, :3]
        upright = np.hypot(*R_world_base[:2, 2]) < BOX_BOUND.first_axis
        if upright and self.is_first_axis_upright:
            across, above = float(np.hypot(*shift[:2])), float(shift[2])
            # a yaw of the base turns the first joint, alike at all stops that are poses
            turns[0] *= not self.is_posed
        else:
            across = float(np.linalg.norm(shift))
            above = float(np.abs(R_world_base @ self.cells.up) @ shift)
        levers = float(np.linalg.norm(position) + np.linalg.norm(shift)), 0.0
        if body is not None:
            levers = levers[0], float(np.linalg.norm(target.T[:3, 3] - space.bodies[k].pivot))
        swung = sum(turn * (lever + self.tool) for turn, lever in zip(turns, levers, strict=True))
        return sum(turns), across + swung, above + swung
