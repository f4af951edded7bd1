"""Hessians made positive definite, and quadratics of banded ones: negative eigenvalues change
sign."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg.blas import dsbmv, dsymv
from scipy.linalg.lapack import dpbtrf, dpbtrs, dpotrf, dpotrs, dsyevr

from joulepath.models.robot import Array

# smallest eigenvalue, relative to a bound on the largest or to 1
EIGENVALUE_FLOOR = 1e-7
# variables up to which eigenvalues are found again for each Hessian
MOST_AGAIN = 60


@dataclass(frozen=True, eq=False)
class ConvexQuadratic:
    """A positive definite matrix (n, n): its lower band (n, width), column by column, or its upper
    triangle.
    """

    matrix: Array
    banded: bool

    def least(self, gradient: Array, added: tuple[Array, Array] | None = None) -> Array:
        """The least (n,) of ½ xᵀ H x + gradientᵀ x. `added` to H is a matrix as a band and as an
        upper triangle.
        """
        matrix = self.matrix if added is None else self.matrix + added[0 if self.banded else 1]
        if self.banded:
            return np.asarray(dpbtrs(dpbtrf(matrix.T, lower=1)[0], -gradient, lower=1)[0])
        return np.asarray(dpotrs(dpotrf(matrix.T, lower=1)[0], -gradient, lower=1)[0])

    def bend(self, x: Array) -> float:
        """xᵀ H x."""
        if self.banded:
            return float(x @ dsbmv(self.matrix.shape[1] - 1, 1.0, self.matrix.T, x, lower=1))
        return float(x @ dsymv(1.0, self.matrix.T, x, lower=1))


class Convexity:
    """Makes the Hessians along the way of one motion positive definite.

    What the last one lacked for it is tried again first: to find eigenvalues takes several times as
    long as to factorise.
    """

    def __init__(self) -> None:
        self._lacking: Array | None = None

    def of(self, band: Array) -> ConvexQuadratic:
        """The quadratic of a Hessian by its lower band (n, width), column by column."""
        if not dpbtrf(band.T, lower=1)[1]:
            return ConvexQuadratic(band, banded=True)
        H = _upper(band)
        if self._lacking is not None:
            again = H + self._lacking
            if not dpotrf(again.T, lower=1)[1]:
                return ConvexQuadratic(again, banded=False)
        # a bound on all eigenvalues
        most = float(np.abs(H).sum(axis=1).max() + np.abs(H).sum(axis=0).max())
        lacking = what_lacks(H, most)
        if len(H) > MOST_AGAIN:
            self._lacking = lacking
        return ConvexQuadratic(H + lacking, banded=False)


def what_lacks(H: Array, most: float) -> Array:
    """The matrix (n, n) that makes a symmetric one, by its upper triangle H (n, n), positive
    definite: negative eigenvalues change sign, and small ones grow to EIGENVALUE_FLOOR. `most` is a
    bound on the size of all.

    Those that change are few: finding them takes half the time of finding all.
    """
    floor = EIGENVALUE_FLOOR * max(1.0, most)
    values, vectors, count, _, _ = dsyevr(H.T, range="V", vl=-2 * most, vu=floor, lower=1)
    low, vectors = values[:count], vectors[:, :count]
    return np.asarray((vectors * (np.maximum(np.abs(low), floor) - low)) @ vectors.T)


def _upper(band: Array) -> Array:
    """The upper triangle (n, n) of a symmetric matrix by its lower band (n, width), whose columns
    are the rows here.
    """
    n, width = band.shape
    H = np.zeros((n, n + 1))
    # the diagonal of the matrix is the first column here
    H[:, :width] = band
    return H.ravel()[: n * n].reshape(n, n)
