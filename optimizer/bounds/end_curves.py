"""Curves of configurations at one end of a motion, cut into cells with boxes of joint positions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from joulepath.models.robot import Array, Mask
from joulepath.models.rows import Rows
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.kinematics.covers.branch_covers import BranchCover, boxes_on
from joulepath.optimizer.kinematics.end_configuration import EndConfiguration
from joulepath.optimizer.kinematics.self_motion import SelfMotion
from joulepath.optimizer.kinematics.seven.redundant_curve import CurveStack, RedundantCurve
from joulepath.optimizer.prepared_problem import PreparedProblem

FIRST_HALF_WIDTH = np.pi / 24
"""Largest half width of the first cells of a curve [rad]."""

Curve = Array | SelfMotion | BranchCover
"""An isolated configuration (nq,) [rad], a self-motion, or a cover of one branch of a pose."""

BoxesOfCells = Callable[[Indices, Array, Array], tuple[Array, Array]]
"""Boxes from rows in a group of curves (n,), parameters (n,) and half widths (n,) [rad]."""


@dataclass(frozen=True)
class Cells(Rows):
    """Intervals of the parameter of curves; a cell of an isolated configuration has no extent."""

    curve: Indices
    """Index of the curve, shape (n,)."""
    parameter: Array
    """Middle of the interval, shape (n,) [rad]."""
    half: Array
    """Half width of the interval, shape (n,) [rad]."""

    def halved(self, chosen: Mask) -> tuple[Cells, Cells]:
        """The lower and the upper halves of chosen cells (n,); both times the other cells whole."""
        half = np.where(chosen, self.half / 2, self.half)
        step = np.where(chosen, half, 0.0)
        lower = Cells(self.curve, self.parameter - step, half)
        return lower, Cells(self.curve, self.parameter + step, half)

    def middles(self) -> Cells:
        """Cells without extent at the middles of these cells."""
        return Cells(self.curve, self.parameter, np.zeros_like(self.half))


@dataclass(frozen=True)
class EndCurves:
    """All configurations of the targets at one end of a motion."""

    joints: int
    """Number of joints."""
    curves: Sequence[Curve]
    given: bool
    """Whether targets give all configurations as joint positions, without other full turns."""

    @staticmethod
    def of(ends: Sequence[EndConfiguration]) -> EndCurves:
        """The curves of end configurations, each curve once."""
        curves: dict[bytes | SelfMotion, Curve] = {}
        for end in ends:
            if end.self_motion is None:
                curves[end.q.tobytes()] = end.q
            else:
                curves[end.self_motion] = end.self_motion
        return EndCurves(len(ends[0].q), list(curves.values()), all(end.fixed for end in ends))

    def first(self) -> Cells:
        """Cells that together cover all curves."""
        curve, parameter, half = list[int](), list[float](), list[float]()
        for k, each in enumerate(self.curves):
            for lower, upper in [(0.0, 0.0)] if isinstance(each, np.ndarray) else each.arcs:
                count = max(1, int(np.ceil((upper - lower) / 2 / FIRST_HALF_WIDTH)))
                side = (upper - lower) / 2 / count
                curve += [k] * count
                parameter += [lower + side * (2 * n + 1) for n in range(count)]
                half += [side] * count
        return Cells(np.array(curve, dtype=np.intp), np.array(parameter), np.array(half))

    def boxes(self, cells: Cells) -> tuple[Array, Array]:
        """Boxes around the configurations of cells.

        Returns:
            Middles and half sides, shape (n, nq) [rad].
        """
        shape = (len(cells.curve), self.joints)
        centre, half = np.zeros(shape), np.zeros(shape)
        for members, boxes in self._groups:
            row_in_group = np.full(len(self.curves), -1)
            row_in_group[members] = np.arange(len(members))
            rows = row_in_group[cells.curve]
            own = np.flatnonzero(rows >= 0)
            if len(own):
                centre[own], half[own] = boxes(rows[own], cells.parameter[own], cells.half[own])
        return centre, half

    def potentials(self, prepared: PreparedProblem, cells: Cells, q: Array) -> Array:
        """Potential energies at the middles of the boxes of cells, shape (n,) [J].

        Args:
            prepared: problem of the motions.
            cells: cells of the curves.
            q: middles of their boxes, shape (n, nq) [rad].
        """
        isolated = [curve for curve in self.curves if isinstance(curve, np.ndarray)]
        if len(isolated) == len(self.curves):
            return np.array([prepared.potential(each) for each in isolated])[cells.curve]
        return np.array([prepared.potential(each) for each in q])

    @cached_property
    def _groups(self) -> list[tuple[list[int], BoxesOfCells]]:
        """Groups of curves, by index, with one computation of boxes per group.

        All curves of one type and one pose form a group. All isolated configurations form a group.
        """
        groups: dict[tuple[type, object], list[int]] = {}
        for k, curve in enumerate(self.curves):
            if isinstance(curve, RedundantCurve | BranchCover):
                key: object = curve.pose
            else:
                key = None if isinstance(curve, np.ndarray) else curve
            groups.setdefault((type(curve), key), []).append(k)
        return [
            (members, _boxes_of([self.curves[k] for k in members])) for members in groups.values()
        ]


def _boxes_of(curves: Sequence[Curve]) -> BoxesOfCells:
    """The computation of boxes for a group of curves."""
    one = curves[0]
    if isinstance(one, RedundantCurve):
        return CurveStack.of([each for each in curves if isinstance(each, RedundantCurve)]).boxes
    if isinstance(one, BranchCover):
        return partial(boxes_on, [each for each in curves if isinstance(each, BranchCover)])
    if isinstance(one, np.ndarray):
        q = np.array(curves)
        return lambda rows, _, half: (q[rows], np.zeros((len(half), q.shape[1])))
    return lambda _, parameter, half: one.boxes(parameter, half)
