"""The least-squares figures whose links are real bodies: a semidefinite program, solved by
Clarabel.

The problem is convex, so that its one solution is found, whatever the start. Clarabel (Goulart,
Chen 2024) is an interior-point solver for quadratic objectives with semidefinite cones.
"""

from __future__ import annotations

import clarabel
import numpy as np
from scipy import sparse

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.link_regressor import BODY
from joulepath.optimizer.identify.arm.pseudo_inertia import BASIS

# of the mass: a body's least eigenvalue, in m² for its extent, so that no body has none
LEAST = 1e-9
# entries of a symmetric matrix in Clarabel's order, and their factors
_ROWS, _COLUMNS = np.triu_indices(4)
_ORDER = np.lexsort((_ROWS, _COLUMNS))
_ENTRIES = (_ROWS[_ORDER], _COLUMNS[_ORDER])
_FACTORS = np.where(_ENTRIES[0] == _ENTRIES[1], 1.0, np.sqrt(2.0))


def solve_consistent(gram: Array, moment: Array, bodies: int, lower: Array) -> Array:
    """The x (p,) ≥ lower that minimises xᵀ gram x / 2 - momentᵀ x, its first 10 · bodies entries
    those of real bodies.

    Raises ArithmeticError if the solver fails, as it does for a gram that is not positive definite.
    """
    p = len(moment)
    scale = 1 / np.sqrt(np.maximum(np.diag(gram), 1e-300))
    scaled = gram * np.outer(scale, scale)
    entries = (BASIS[:, _ENTRIES[0], _ENTRIES[1]] * _FACTORS).T
    bounded = np.flatnonzero(np.isfinite(lower))
    matrix = np.zeros((len(bounded) + BODY * bodies, p))
    matrix[np.arange(len(bounded)), bounded] = -scale[bounded]
    matrix[len(bounded) :, : BODY * bodies] = (
        -np.kron(np.eye(bodies), entries) * scale[: BODY * bodies]
    )
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    solution = clarabel.DefaultSolver(
        sparse.csc_matrix(np.triu(scaled)),
        -moment * scale,
        sparse.csc_matrix(matrix),
        np.concatenate([-lower[bounded], np.tile(-LEAST * np.eye(4)[_ENTRIES], bodies)]),
        [clarabel.NonnegativeConeT(len(bounded)), *[clarabel.PSDTriangleConeT(4)] * bodies],
        settings,
    ).solve()
    if str(solution.status) not in ("Solved", "AlmostSolved"):
        raise ArithmeticError(f"The semidefinite program ended with {solution.status}.")
    return np.asarray(solution.x) * scale
