"""All configurations of a stop that leaves the angle of the tool free, known or not, in boxes of
joint positions.

There is a box for each branch of the arm and each cell of the angle
(`kinematics.turned_pose_boxes`). At first it holds the configurations of the cell but for full
turns. Where it matters, a cell is halved; and once it is small, it is replaced by one for every
full turn of its joints that brings a part of the box within the limits. Then the boxes have their
places. Of a joint that is nearly free in the box, like those of a stretched wrist, any full turn
counts for good.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.optimizer.bounds.least_displacement import LIMIT_TOLERANCE
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.cycle.layers import Layer
from joulepath.optimizer.kinematics.angles import nearest_turn, wrapped
from joulepath.optimizer.kinematics.covers.pose_boxes import PoseBoxes
from joulepath.optimizer.kinematics.covers.turned_pose_boxes import BRANCHES, TurnedPose
from joulepath.optimizer.prepared_problem import PreparedProblem

# cells of the angle at first, and the half width [rad] below which one is not halved; nor if no
# side of its box is longer than another one
CELLS, SMALLEST, SMALL_BOX = 48, 1e-5, 0.003
# half width [rad] of a cell from which on the full turns of its joints are told apart, and half
# side of the box [rad] of a joint that has them
TURNED, NARROW = 0.04, 1.0


@dataclass(frozen=True)
class Cells:
    """Cells (n,) of the angle, of half `width` about `angle` [rad], on a `branch`; the boxes that
    hold their configurations, of middles `centre` and half sides `half` (n, nq) [rad]; and for each
    of some arms the least and the greatest potential energy in them, `levels` (n, arms, 2) [J].
    Joints that are `placed` (n, nq) are within the box, others with any full turns; `turned` (n,):
    whether full turns have been told apart."""

    angle: Array
    width: Array
    branch: Indices
    centre: Array
    half: Array
    levels: Array
    placed: Mask
    turned: Mask

    def __getitem__(self, chosen: Indices) -> Cells:
        return Cells(*(getattr(self, each.name)[chosen] for each in fields(self)))

    def joined(self, other: Cells) -> Cells:
        """These cells, then the others."""
        return Cells(
            *(
                np.concatenate([getattr(b, each.name) for b in (self, other)])
                for each in fields(self)
            )
        )


class CoveredLayer:
    """The `cells` of a pose that is turned about its free axis, with boxes that hold all of its
    configurations.

    Their levels are those of the arms of `prepared`, the problems of the moves to it and from it,
    which may carry different payloads.
    """

    def __init__(
        self,
        turned: TurnedPose,
        prepared: Sequence[PreparedProblem],
        nearest: bool = False,
        is_turned: bool = True,
    ) -> None:
        self._turned, limits = turned, prepared[0].arm.active_limits
        middle, reach = (limits.q_min + limits.q_max) / 2, np.pi if nearest else np.inf
        self._range = (
            np.maximum(limits.q_min, middle - reach),
            np.minimum(limits.q_max, middle + reach),
        )
        arms = [each.arm for each in prepared]
        # the highest that an arm can be is the lowest under gravity turned cycle
        upside_down = [replace(arm, gravity=-np.asarray(arm.gravity)) for arm in arms]
        self._shapes = [
            [PoseBoxes(arm, turned.pose) for arm in both]
            for both in zip(arms, upside_down, strict=True)
        ]
        count, half = (CELLS, np.pi / CELLS) if is_turned else (1, 0.0)
        number, branch = (each.ravel() for each in np.indices((count, BRANCHES)))
        self.cells, _ = self._held(
            np.asarray(half * 2.0 * number), np.full(number.shape, half), branch
        )

    @staticmethod
    def of(layer: Layer, prepared: Sequence[PreparedProblem], nearest: bool) -> CoveredLayer | None:
        """The cells of a layer that is around a pose; None for an arm, or a pose, of which not all
        configurations can be covered."""
        if layer.around is None:
            return None
        turned = TurnedPose.of(prepared[0].arm, layer.around, layer.given)
        return (
            None if turned is None else CoveredLayer(turned, prepared, nearest, layer.given is None)
        )

    def _held(self, angle: Array, width: Array, branch: Indices) -> tuple[Cells, Indices]:
        """Those of some cells that may hold any configuration, and their numbers."""
        centre, half, held = self._turned.boxes(angle, width, branch)
        centre[held], half[held], held[held] = self._shapes[0][0].narrowed(centre[held], half[held])
        rows = np.flatnonzero(held)
        centre, half = centre[rows], half[rows]
        levels = [
            [up.least_potential(centre, half), -down.least_potential(centre, half)]
            for up, down in self._shapes
        ]
        told = np.zeros(centre.shape, dtype=bool), np.zeros(len(centre), dtype=bool)
        return Cells(
            angle[rows],
            width[rows],
            branch[rows],
            centre,
            half,
            np.array(levels).transpose(2, 0, 1),
            *told,
        ), rows

    def keep(self, rows: Indices) -> None:
        """Leave out all other cells."""
        self.cells = self.cells[rows]

    def split(self, chosen: Mask) -> tuple[Indices, Indices]:
        """Put parts of the cells that are `chosen` (n,) in their place: both halves, but of the
        smallest; or one for every full turn.

        The number (n,) of the cell that each cell was, or was part of; and the numbers of those
        that are new.
        """
        cells = self.cells
        turns = chosen & ~cells.turned & (cells.width < TURNED)
        wide = (cells.width > SMALLEST) & (cells.half.max(axis=1) > SMALL_BOX)
        halves = chosen & ~turns & wide
        kept = np.flatnonzero(~turns & ~halves)
        parts = [self._halves(np.flatnonzero(halves)), self._with_turns(np.flatnonzero(turns))]
        self.cells = cells[kept]
        for new, _ in parts:
            self.cells = self.cells.joined(new)
        return np.concatenate([kept, *(of for _, of in parts)]), np.arange(
            len(kept), len(self.cells.angle)
        )

    def _halves(self, split: Indices) -> tuple[Cells, Indices]:
        """Both halves of some cells, and the number of the cell that each is part of."""
        part_of = np.tile(split, 2)
        whole = self.cells[part_of]
        step = np.repeat([0.5, -0.5], len(split)) * whole.width
        new, rows = self._held(whole.angle + step, whole.width / 2, whole.branch)
        whole = whole[rows]
        # both boxes of a joint that is placed are narrow: only one full turn brings them together
        centre = np.where(whole.placed, nearest_turn(new.centre, whole.centre), new.centre)
        return replace(new, centre=centre, placed=whole.placed, turned=whole.turned), part_of[rows]

    def _with_turns(self, split: Indices) -> tuple[Cells, Indices]:
        """Some cells with every full turn within the limits, and the number of the cell that each
        was.
        """
        cells, (lowest, highest) = self.cells[split], self._range
        placed = cells.half < NARROW
        centre = np.where(placed, wrapped(cells.centre), cells.centre)
        part, shift = np.arange(len(split)), np.zeros_like(centre)
        for j in range(centre.shape[1]):
            # boxes are narrower than a turn: so much around the range is enough
            least, most = lowest[j] - LIMIT_TOLERANCE, highest[j] + LIMIT_TOLERANCE
            reach = int(np.ceil(max(-least, most) / (2 * np.pi))) + 1
            turns = 2 * np.pi * np.arange(-reach, reach + 1)
            at, half = (
                (centre[part, j] + shift[:, j])[:, None] + turns,
                cells.half[part, j][:, None],
            )
            inside = (at - half <= most) & (at + half >= least)
            inside = np.where(placed[part, j][:, None], inside, turns == 0)
            row, turn = np.nonzero(inside)
            part, shift = part[row], shift[row]
            shift[:, j] = turns[turn]
        told = np.ones(len(part), dtype=bool)
        return replace(
            cells[part], centre=centre[part] + shift, placed=placed[part], turned=told
        ), split[part]
