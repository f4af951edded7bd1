"""Variables in which a QP's Hessian, made positive definite, is the identity."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.linalg.lapack import dpotrf, dtrtri

from joulepath.models.robot import Array
from joulepath.optimizer.solve.nlp.convex_quadratic import EIGENVALUE_FLOOR, what_lacks

# variables of a QP beyond which all eigenvalues are found faster than those that change
MOST_IN_PART = 150


def whitened(H: Array) -> tuple[Callable[[Array], Array], Array]:
    """The product with H as a function of a vector (n,), and W (n, n) with Wᵀ H W = 1, for a
    symmetric H (n, n).

    If H is not positive definite, both are those of H with the absolute values of its eigenvalues,
    clamped from below.
    """
    # H.T: LAPACK takes columns first
    L, failed = dpotrf(H.T, lower=1)
    if failed and len(H) > MOST_IN_PART:
        values, vectors = np.linalg.eigh(H)
        kept = np.maximum(np.abs(values), EIGENVALUE_FLOOR * max(1.0, float(np.abs(values).max())))
        return lambda x: vectors @ (kept * (vectors.T @ x)), vectors / np.sqrt(kept)
    if failed:
        # with a bound on all eigenvalues
        H = H + what_lacks(H, float(np.abs(H).sum(axis=0).max()))
        L, _ = dpotrf(H.T, lower=1)
    return H.dot, np.ascontiguousarray(dtrtri(L, lower=1)[0].T)
