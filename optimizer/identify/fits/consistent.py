"""Least squares over physically consistent bodies: a semidefinite program, solved by Clarabel.

The problem is convex, so its only solution is found from any start. Clarabel (Goulart, Chen 2024)
is an interior-point solver for quadratic objectives with semidefinite cones.
"""

from __future__ import annotations

from dataclasses import dataclass

import clarabel
import numpy as np
from scipy import sparse

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.link_regressor import PARAMETERS_PER_BODY
from joulepath.optimizer.exceptions import InvalidProblem
from joulepath.optimizer.identify.arm.pseudo_inertia import BASIS

# entries of a symmetric matrix in Clarabel's order, and their factors
_UPPER = np.triu_indices(4)
_ORDER = np.lexsort(_UPPER)
_ENTRIES = (_UPPER[0][_ORDER], _UPPER[1][_ORDER])
_FACTORS = np.where(_ENTRIES[0] == _ENTRIES[1], 1.0, np.sqrt(2.0))


@dataclass(frozen=True)
class ConsistentSettings:
    """Settings of the semidefinite program."""

    min_eigenvalue: float = 1e-9
    """Smallest eigenvalue of a pseudo-inertia, so that no body is without mass or extent
    [kg, kg·m²]."""
    max_step_fraction: float = 0.95
    """Largest step as a share of the distance to the boundary of the cone [1]. With the solver's
    default of 0.99, iterates may stall near the boundary, far from the solution."""


CONSISTENT = ConsistentSettings()


def solve_consistent(gram: Array, moment: Array, bodies: int, lower: Array) -> Array:
    """Minimise xᵀ gram x / 2 - momentᵀ x over x ≥ lower with consistent bodies.

    Args:
        gram: positive definite normal matrix (p, p).
        moment: right-hand side (p,).
        bodies: number of bodies; their parameters are the first 10 · bodies entries of x.
        lower: lower bounds (p,), -inf for none.

    Returns:
        The minimiser x (p,).

    Raises:
        InvalidProblem: the solver fails, as it does if `gram` is not positive definite.
    """
    p = len(moment)
    scale = 1 / np.sqrt(np.maximum(np.diag(gram), 1e-300))
    scaled = gram * np.outer(scale, scale)
    entries = (BASIS[:, _ENTRIES[0], _ENTRIES[1]] * _FACTORS).T
    bounded = np.flatnonzero(np.isfinite(lower))
    matrix = np.zeros((len(bounded) + PARAMETERS_PER_BODY * bodies, p))
    matrix[np.arange(len(bounded)), bounded] = -scale[bounded]
    matrix[len(bounded) :, : PARAMETERS_PER_BODY * bodies] = (
        -np.kron(np.eye(bodies), entries) * scale[: PARAMETERS_PER_BODY * bodies]
    )
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    settings.max_step_fraction = CONSISTENT.max_step_fraction
    smallest = CONSISTENT.min_eigenvalue * np.eye(4)[_ENTRIES]
    solution = clarabel.DefaultSolver(
        sparse.csc_matrix(np.triu(scaled)),
        -moment * scale,
        sparse.csc_matrix(matrix),
        np.concatenate([-lower[bounded], np.tile(-smallest, bodies)]),
        [clarabel.NonnegativeConeT(len(bounded)), *[clarabel.PSDTriangleConeT(4)] * bodies],
        settings,
    ).solve()
    solved = (clarabel.SolverStatus.Solved, clarabel.SolverStatus.AlmostSolved)
    if solution.status not in solved:
        raise InvalidProblem(
            "inertials",
            "No links with positive masses and inertias fit these logs: the solver ended with "
            f"{solution.status}. Keep the inertials, or log more motions.",
        )
    return np.asarray(solution.x) * scale
