"""Tightening limits where a motion breaks them between the nodes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from models.robot import Array, Limits
from optimizer.kinematics.path_constraints import PathConstraints
from optimizer.nlp.nonlinear_program import FEASIBILITY

# the solver works within limits tightened by this share, so that its own tolerance does not break the real ones
MARGIN = 2 * FEASIBILITY


def initial_bounds(path: PathConstraints | None) -> Array:
    """How much of each limit along the path (c,) may be used at first."""
    return np.full(0 if path is None else len(path.names), 1 - MARGIN)


def tightened(limits: Limits, excess: Limits) -> Limits:
    """Limits on speed, acceleration, jerk and torque times factors per joint, and positions moved inwards."""
    inner = limits.scaled(excess)
    return replace(inner, q_min=inner.q_min + excess.q_min, q_max=inner.q_max - excess.q_max)
