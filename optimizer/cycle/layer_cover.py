"""Cover of all configurations of a stop that leaves the angle of the tool free.

The cover consists of boxes of joint positions, one for every branch of the arm and every cell of
the angle (`kinematics.covers.turned_pose_boxes`). At first a box holds the configurations of its
cell up to full turns. Cells are halved where it matters. A small cell is replaced by one cell for
every full turn of its joints that brings part of the box within the limits; its joints are then
"placed". A joint that is nearly free in the box, as in a stretched wrist, is never placed: any of
its full turns counts.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.models.rows import Rows
from joulepath.optimizer.bounds.least_displacement import LIMIT_TOLERANCE
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.cycle.layers import Layer
from joulepath.optimizer.kinematics.angles import nearest_turn, wrapped
from joulepath.optimizer.kinematics.covers.pose_boxes import PoseBoxes
from joulepath.optimizer.kinematics.covers.turned_pose_boxes import BRANCHES, TurnedPose
from joulepath.optimizer.prepared_problem import PreparedProblem


@dataclass(frozen=True)
class LayerCoverSettings:
    """Settings of the cells that cover the angle of the tool."""

    first_cells: int = 48
    """Number of cells of the angle at first."""
    least_width: float = 1e-5
    """Half width below which a cell is not halved [rad]."""
    least_side: float = 0.003
    """Half side of a box below which its cell is not halved [rad]."""
    turn_width: float = 0.04
    """Half width of a cell below which it is divided by the full turns of its joints [rad]."""
    narrow_side: float = 1.0
    """Half side of a box below which the full turn of a joint is definite [rad]."""


COVER = LayerCoverSettings()


@dataclass(frozen=True)
class CoverCells(Rows):
    """Cells of the angle of the tool, with the boxes of their configurations.

    Attributes:
        angle: middle of every cell, shape (n,) [rad].
        width: half width of every cell, shape (n,) [rad].
        branch: branch of the arm, shape (n,).
        centre: middle of every box, shape (n, nq) [rad].
        half: half sides of every box, shape (n, nq) [rad].
        levels: least and greatest potential energy in every box for several arms, shape (n, arms,
            2) [J].
        placed: joints with a definite full turn, shape (n, nq); others may have any full turn.
        turned: whether a cell has been divided by full turns, shape (n,).
    """

    angle: Array
    width: Array
    branch: Indices
    centre: Array
    half: Array
    levels: Array
    placed: Mask
    turned: Mask


class LayerCover:
    """Cells of a pose turned about its free axis; their boxes hold all configurations of the pose.

    Args:
        turned: pose with its free axis.
        prepared: problems of the moves to the pose and from it, with different payloads perhaps;
            the levels of the cells are those of their arms.
        nearest: whether only joint positions within half a turn of the middle of the range count.
        is_turned: whether the angle is free; otherwise there is one cell at angle 0.
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
        # the highest potential energy is the lowest one under reversed gravity
        upside_down = [replace(arm, gravity=-np.asarray(arm.gravity)) for arm in arms]
        self._shapes = [
            [PoseBoxes(arm, turned.pose) for arm in both]
            for both in zip(arms, upside_down, strict=True)
        ]
        count, half = (COVER.first_cells, np.pi / COVER.first_cells) if is_turned else (1, 0.0)
        number, branch = (each.ravel() for each in np.indices((count, BRANCHES)))
        self.cells, _ = self._held(
            np.asarray(half * 2.0 * number), np.full(number.shape, half), branch
        )

    @staticmethod
    def of(layer: Layer, prepared: Sequence[PreparedProblem], nearest: bool) -> LayerCover | None:
        """Cover of a layer with a free pose; None if not all configurations of arm or pose can be
        covered.
        """
        if layer.free_pose is None:
            return None
        turned = TurnedPose.of(prepared[0].arm, layer.free_pose, layer.fixed_pose)
        return (
            None
            if turned is None
            else LayerCover(turned, prepared, nearest, layer.fixed_pose is None)
        )

    def _held(self, angle: Array, width: Array, branch: Indices) -> tuple[CoverCells, Indices]:
        """The given cells without empty ones, and their indices among the given cells."""
        centre, half, held = self._turned.boxes(angle, width, branch)
        centre[held], half[held], held[held] = self._shapes[0][0].narrowed(centre[held], half[held])
        rows = np.flatnonzero(held)
        centre, half = centre[rows], half[rows]
        levels = [
            [up.least_potential(centre, half), -down.least_potential(centre, half)]
            for up, down in self._shapes
        ]
        flags = np.zeros(centre.shape, dtype=bool), np.zeros(len(centre), dtype=bool)
        return CoverCells(
            angle[rows],
            width[rows],
            branch[rows],
            centre,
            half,
            np.array(levels).transpose(2, 0, 1),
            *flags,
        ), rows

    def keep(self, rows: Indices) -> None:
        """Discard all cells but those of the given indices."""
        self.cells = self.cells[rows]

    def split(self, chosen: Mask) -> tuple[Indices, Indices]:
        """Replace the chosen cells (n,) by their parts: both halves, or one part for every full
        turn.

        The smallest cells stay as they are.

        Returns:
            For every new cell the index of its former cell, and the indices of the cells that
            changed.
        """
        cells = self.cells
        turns = chosen & ~cells.turned & (cells.width < COVER.turn_width)
        wide = (cells.width > COVER.least_width) & (cells.half.max(axis=1) > COVER.least_side)
        halves = chosen & ~turns & wide
        kept = np.flatnonzero(~turns & ~halves)
        parts = [self._halves(np.flatnonzero(halves)), self._with_turns(np.flatnonzero(turns))]
        self.cells = cells[kept]
        for new, _ in parts:
            self.cells = self.cells.joined(new)
        return np.concatenate([kept, *(of for _, of in parts)]), np.arange(
            len(kept), len(self.cells.angle)
        )

    def _halves(self, split: Indices) -> tuple[CoverCells, Indices]:
        """Both halves of some cells, and the index of the former cell of every half."""
        part_of = np.tile(split, 2)
        whole = self.cells[part_of]
        step = np.repeat([0.5, -0.5], len(split)) * whole.width
        new, rows = self._held(whole.angle + step, whole.width / 2, whole.branch)
        whole = whole[rows]
        # the boxes of a placed joint are narrow: one full turn alone brings them together
        centre = np.where(whole.placed, nearest_turn(new.centre, whole.centre), new.centre)
        return replace(new, centre=centre, placed=whole.placed, turned=whole.turned), part_of[rows]

    def _with_turns(self, split: Indices) -> tuple[CoverCells, Indices]:
        """Some cells with every full turn within the limits, and the index of the former cell."""
        cells, (lowest, highest) = self.cells[split], self._range
        placed = cells.half < COVER.narrow_side
        centre = np.where(placed, wrapped(cells.centre), cells.centre)
        part, shift = np.arange(len(split)), np.zeros_like(centre)
        for j in range(centre.shape[1]):
            # boxes are narrower than a turn: one more turn on either side of the range suffices
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
        flags = np.ones(len(part), dtype=bool)
        return replace(
            cells[part], centre=centre[part] + shift, placed=placed[part], turned=flags
        ), split[part]
