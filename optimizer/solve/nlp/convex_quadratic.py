"""Hessians made positive definite, and quadratics of banded Hessians."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg.blas import dsbmv, dsymv
from scipy.linalg.lapack import dpbtrf, dpbtrs, dpotrf, dpotrs, dsyevr

from joulepath.models.robot import Array


@dataclass(frozen=True)
class ConvexitySettings:
    """How Hessians are made positive definite."""

    eigenvalue_floor: float = 1e-7
    """Smallest eigenvalue, relative to the larger of 1 and a bound on all eigenvalues."""

    reuse_above: int = 60
    """Number of variables above which the correction of the last Hessian is tried first: finding
    eigenvalues takes several times as long as a factorisation."""


CONVEXITY = ConvexitySettings()


@dataclass(frozen=True, eq=False)
class ConvexQuadratic:
    """A positive definite matrix H (n, n)."""

    matrix: Array
    """Lower band (n, width) with the columns of H as rows if `banded`, else the upper triangle."""

    banded: bool

    def least(self, gradient: Array, added: tuple[Array, Array] | None = None) -> Array:
        """Minimiser of ½ xᵀ H x + gradientᵀ x.

        Args:
            gradient: the gradient, shape (n,).
            added: matrix added to H, as a band and as an upper triangle; None for zero.

        Returns:
            The minimiser, shape (n,).
        """
        matrix = self.matrix if added is None else self.matrix + added[0 if self.banded else 1]
        if self.banded:
            return np.asarray(dpbtrs(dpbtrf(matrix.T, lower=1)[0], -gradient, lower=1)[0])
        return np.asarray(dpotrs(dpotrf(matrix.T, lower=1)[0], -gradient, lower=1)[0])

    def curvature(self, x: Array) -> float:
        """xᵀ H x."""
        if self.banded:
            return float(x @ dsbmv(self.matrix.shape[1] - 1, 1.0, self.matrix.T, x, lower=1))
        return float(x @ dsymv(1.0, self.matrix.T, x, lower=1))


class Convexity:
    """Makes the successive Hessians of one solve positive definite.

    The correction of the last Hessian is tried first.
    """

    def __init__(self) -> None:
        self._correction: Array | None = None

    def of(self, band: Array) -> ConvexQuadratic:
        """The quadratic of a Hessian, by its lower band (n, width) with the columns as rows."""
        if not dpbtrf(band.T, lower=1)[1]:
            return ConvexQuadratic(band, banded=True)
        H = _upper(band)
        if self._correction is not None:
            again = H + self._correction
            if not dpotrf(again.T, lower=1)[1]:
                return ConvexQuadratic(again, banded=False)
        # bound on all eigenvalues
        most = float(np.abs(H).sum(axis=1).max() + np.abs(H).sum(axis=0).max())
        correction = definite_correction(H, most)
        if len(H) > CONVEXITY.reuse_above:
            self._correction = correction
        return ConvexQuadratic(H + correction, banded=False)


def definite_correction(H: Array, most: float) -> Array:
    """Matrix to add to a symmetric matrix so that the sum is positive definite.

    Negative eigenvalues change sign, and small eigenvalues grow to `eigenvalue_floor`. Few
    eigenvalues change: finding these takes half the time of finding all.

    Args:
        H: upper triangle of the matrix, shape (n, n).
        most: bound on the absolute values of all eigenvalues.

    Returns:
        The matrix to add, shape (n, n).
    """
    floor = CONVEXITY.eigenvalue_floor * max(1.0, most)
    values, vectors, count, _, _ = dsyevr(H.T, range="V", vl=-2 * most, vu=floor, lower=1)
    low, vectors = values[:count], vectors[:, :count]
    return np.asarray((vectors * (np.maximum(np.abs(low), floor) - low)) @ vectors.T)


def _upper(band: Array) -> Array:
    """Upper triangle (n, n) of a symmetric matrix, from its lower band (n, width)."""
    n, width = band.shape
    H = np.zeros((n, n + 1))
    # the first column of the band is the diagonal of the matrix
    H[:, :width] = band
    return H.ravel()[: n * n].reshape(n, n)
