"""Whitening: transformation of a QP's variables that makes the Hessian the identity."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.linalg.lapack import dpotrf, dtrtri

from joulepath.models.robot import Array
from joulepath.optimizer.solve.nlp.convex_quadratic import CONVEXITY, definite_correction


def whitened(H: Array, full_above: int = 150) -> tuple[Callable[[Array], Array], Array]:
    """Product with a symmetric matrix H, and a matrix W with Wᵀ H W = 1.

    If H is not positive definite, its eigenvalues are replaced by their absolute values, clamped
    from below.

    Args:
        H: the matrix, shape (n, n).
        full_above: number of variables n above which all eigenvalues are found: faster there than
            the negative and small eigenvalues alone.

    Returns:
        The product with a vector (n,) as a function, and W (n, n).
    """
    # LAPACK takes columns first
    L, failed = dpotrf(H.T, lower=1)
    if failed and len(H) > full_above:
        values, vectors = np.linalg.eigh(H)
        floor = CONVEXITY.eigenvalue_floor * max(1.0, float(np.abs(values).max()))
        kept = np.maximum(np.abs(values), floor)
        return lambda x: vectors @ (kept * (vectors.T @ x)), vectors / np.sqrt(kept)
    if failed:
        # the row sums bound all eigenvalues
        H = H + definite_correction(H, float(np.abs(H).sum(axis=0).max()))
        L, _ = dpotrf(H.T, lower=1)
    return H.dot, np.ascontiguousarray(dtrtri(L, lower=1)[0].T)
