"""Variables in which a QP's Hessian, made positive definite, is the identity."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.linalg.lapack import dpotrf, dsyevr, dtrtri

from models.robot import Array

# smallest eigenvalue that the QP's Hessian may have, relative to a bound on the largest or to 1, the scale of the cost
EIGENVALUE_FLOOR = 1e-7
# variables of a QP beyond which all eigenvalues are found faster than those that change
MOST_IN_PART = 150


def whitened(H: Array) -> tuple[Callable[[Array], Array], Array]:
    """What multiplies by the symmetric H (n, n) if it is positive definite, else by H with the absolute values of its
    eigenvalues, clamped from below; and W with Wᵀ H W = 1."""
    # H.T: LAPACK takes columns first
    L, failed = dpotrf(H.T, lower=1)
    if failed and len(H) > MOST_IN_PART:
        values, vectors = np.linalg.eigh(H)
        kept = np.maximum(np.abs(values), EIGENVALUE_FLOOR * max(1.0, float(np.abs(values).max())))
        return lambda x: vectors @ (kept * (vectors.T @ x)), vectors / np.sqrt(kept)
    if failed:
        # a bound on all eigenvalues. Those that change are few: finding them takes half the time of finding all
        most = float(np.abs(H).sum(axis=0).max())
        floor = EIGENVALUE_FLOOR * max(1.0, most)
        values, vectors, count, _, _ = dsyevr(H.T, range="V", vl=-2 * most, vu=floor, lower=1)
        low, vectors = values[:count], vectors[:, :count]
        H = H + (vectors * (np.maximum(np.abs(low), floor) - low)) @ vectors.T
        L, _ = dpotrf(H.T, lower=1)
    return H.dot, np.ascontiguousarray(dtrtri(L, lower=1)[0].T)
