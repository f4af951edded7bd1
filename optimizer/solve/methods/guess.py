"""Initial guess of a solve by the SQP."""

from __future__ import annotations

from dataclasses import dataclass

from joulepath.models.robot import Array
from joulepath.optimizer.motion.bspline import Basis
from joulepath.optimizer.solve.nlp.sqp_state import SQP


@dataclass(frozen=True, eq=False)
class Guess:
    """A motion to start from, and how far to solve from it."""

    space: Basis
    """Spline space of the motion."""

    points: Array
    """All control points in the candidate's coordinates, shape (n, r)."""

    duration: float
    """Initial duration if `nearly_feasible`, else a lower bound on the initial duration [s]."""

    collision_free: bool = False
    """Whether the NLP has clearance constraints from the start. Otherwise it gets them after a
    collision."""

    coarse: bool = False
    """Whether a further solve refines the motion: with clearance constraints, the solve then ends
    at a larger decrease of the cost."""

    progress: float = SQP.progress
    """Relative decrease of the cost below which the SQP ends."""

    nearly_feasible: bool = False
    """Whether the solve starts with this duration, even if jerk exceeds its limit next to knots
    that have moved."""

    unchecked: bool = False
    """Whether the motion only serves as a guess of another solve: it may exceed limits between the
    nodes, and collide."""
