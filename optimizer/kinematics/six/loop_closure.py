"""All configurations of a pose of a six-joint arm with any axes, by eigenvalues.

The base, the six joints and the flange at its pose form a closed loop. With the fixed transforms
D_k from joint k to the next one, the loop may be cut at any joint a:

    D_b Rz(q_c) D_c Rz(q_d) D_d Rz(q_e) D_e = Rz(-q_b) D_a⁻¹ Rz(-q_a) D_f⁻¹ Rz(-q_f).       (1)

Let p be the origin and l the axis of joint f in the frame of joint b, which q_f does not change.
The fourteen quantities p, l, p·p, p·l, p × l and (p·p) l - 2 (p·l) p of the right-hand side are
linear in eight products of cosines and sines of q_a and q_b, and those of the left-hand side are
trilinear in (1, cos, sin) of q_c, q_d, q_e (Raghavan and Roth, "Inverse kinematics of the general
6R manipulator and related linkages", 1993). Eliminating the eight products leaves six equations
without q_a and q_b. In half tangents, these and their multiples by that of q_d are twelve equations
in twelve power products of those of q_d and q_e, with coefficients quadratic in x, the half tangent
of q_c: its values are eigenvalues, and the eigenvectors have q_d and q_e (Manocha and Canny,
"Efficient inverse kinematics for general 6R manipulators", 1994). Eight of the 24 eigenvalues are
±i, the other sixteen belong to the configurations, which are real or complex.

For axes that are parallel or meet, most cuts lead to singular matrices. Of the six cuts, each with
x of c, d or e, one has been regular for every pattern of such axes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
import numpy.typing as npt

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.vectors import cross


@dataclass(frozen=True)
class LoopClosureSettings:
    """Settings of the eigenvalue problem."""

    samples: int = 3
    """Poses at which cuts of the loop are compared."""
    cuts: int = 4
    """Cuts that are tried in turn where one is not regular, or its roots are not all reached. Of
    300 poses of arms with random patterns of axes, 254 needed one cut and 4 needed four."""
    least_length: float = 1e-9
    """Length [m] of an arm of no length."""
    worst_condition: float = 1e7
    """Condition number above which eigenvalues are not trusted."""
    real: float = 1e-3
    """Imaginary part of an eigenvalue, over 1 + its squared size, up to which it leads to a start
    of Newton's method: that of the two configurations beside a fold is due to rounding."""
    certainly_real: float = 1e-7
    """The same measure up to which an eigenvalue is that of a real configuration."""
    same: float = 1e-5
    """Difference of eigenvalues, over 1 + their square, up to which they count as one."""
    mixed: float = 0.7
    """Weight of one half tangent in a sum with another one that tells configurations apart."""


SETTINGS = LoopClosureSettings()
JOINTS = 6
CUTS = tuple(product(range(6), range(3)))
"""Every cut, after so many joints, with the number of the joint c, d or e with half tangent x."""
_THIRDS: Array = 2 * np.pi / 3 * np.arange(3.0)
_FROM_THIRDS = np.linalg.inv(np.stack([np.ones(3), np.cos(_THIRDS), np.sin(_THIRDS)], axis=1))
"""Coefficients of 1, cosine and sine from the values at thirds of a turn."""
_HALF_TANGENTS = np.array([[1.0, 0.0, 1.0], [1.0, 0.0, -1.0], [0.0, 2.0, 0.0]])
"""Coefficients of 1, x, x² in 1, cosine and sine, times 1 + x²."""
_TO_PRODUCTS = np.kron(_FROM_THIRDS, _FROM_THIRDS)
_POWERS = _HALF_TANGENTS.T @ _FROM_THIRDS
_TO_POWERS = np.kron(_POWERS, np.kron(_POWERS, _POWERS))
_OFFSETS = np.array([0.86, -1.43, 2.21])
"""Zeros of q_c, q_d, q_e [rad] for half tangents: at a half turn from one of them, a half tangent
is infinite. Any angles will do but those of symmetric configurations."""


@dataclass(frozen=True, eq=False)
class Roots:
    """Approximate configurations q (n, 6) [rad] of a pose, of which `certain` many are real beyond
    doubt; beside the others there may be none.
    """

    q: Array
    certain: int


@dataclass(frozen=True, eq=False)
class LoopClosure:
    """Closed loop of a chain of six joints; `cuts` are the best of CUTS, the very best first."""

    chain: Chain
    cuts: tuple[tuple[int, int], ...]

    @classmethod
    def of(cls, chain: Chain) -> LoopClosure | None:
        """The loop of a chain; None for one of another number of joints, or whose joints follow
        others.
        """
        if chain.nq != JOINTS or chain.coupling.follows:
            return None
        loop, rng = cls(chain, CUTS), np.random.default_rng(0)
        poses = chain.flange(rng.uniform(-np.pi, np.pi, (SETTINGS.samples, chain.nq)))
        conditions = [[loop._opened(cut, T).condition for T in poses] for cut in CUTS]
        order = np.argsort(np.median(conditions, axis=1))[: SETTINGS.cuts]
        return cls(chain, tuple(CUTS[k] for k in order))

    def roots(self, T: Array) -> Iterator[Roots]:
        """Approximations of all configurations of the flange pose T (4, 4), by each regular cut."""
        for chosen in self.cuts:
            cut = self._opened(chosen, T)
            if cut.condition < SETTINGS.worst_condition:
                roots = cut.roots()
                yield Roots(np.roll(roots.q, chosen[0], axis=1), roots.certain)

    def _opened(self, chosen: tuple[int, int], T: Array) -> _Cut:
        """The loop, closed at the flange pose T (4, 4) and cut, with the length of the chain as the
        unit.
        """
        number, hidden = chosen
        placements, last = self.chain.placements, self.chain.T_last_flange
        loop = np.array([*placements[1:], last @ np.linalg.inv(T) @ placements[0]])
        loop[:, :3, 3] /= max(self.chain.length, SETTINGS.least_length)
        return _Cut.of([*loop[number:], *loop[:number]], hidden)


@dataclass(frozen=True, eq=False)
class _Cut:
    """Equations of a cut loop with transforms `D` of a to f, in x of the joint c, d or e with the
    number `hidden`.

    `left` (8, 14) maps the fourteen quantities to the eight products, `constant` (14,) are the
    quantities' parts without a product, and `matrices` (3, 12, 12) the coefficients of 1, x, x².
    """

    D: Sequence[Array]
    hidden: int
    left: Array
    constant: Array
    matrices: Array
    condition: float

    @classmethod
    def of(cls, D: Sequence[Array], hidden: int) -> _Cut:
        """Equations of a loop."""
        three = D[1] @ _turns(_THIRDS + _OFFSETS[0])
        after = D[2] @ _turns(_THIRDS + _OFFSETS[1])
        last = D[3] @ _turns(_THIRDS + _OFFSETS[2]) @ D[4]
        frames = three[:, None, None] @ (after[:, None] @ last)
        trilinear = (_TO_POWERS @ _quantities(frames).reshape(27, 14)).T.reshape(14, 3, 3, 3)
        turns = _turns(-_THIRDS)
        # the first index is that of q_b
        frames = turns[:, None] @ np.linalg.inv(D[0]) @ turns @ np.linalg.inv(D[5])
        products = _TO_PRODUCTS @ _quantities(frames).reshape(9, 14)
        u, s, vt = np.linalg.svd(products[1:].T)
        rest, one = u[:, 8:].T, _HALF_TANGENTS[0]
        six = np.tensordot(rest, trilinear, 1)
        six -= np.multiply.outer(rest @ products[0], np.einsum("a,b,c->abc", one, one, one))
        shifted = np.zeros((3, 12, 4, 3))
        shifted[:, :6, :3] = shifted[:, 6:, 1:] = np.moveaxis(six, 1 + hidden, 0)
        matrices = shifted.reshape(3, 12, 12)
        condition = max(float(np.linalg.cond(matrices[2])), float(s[0] / max(s[-1], 1e-300)))
        left = vt.T @ (u[:, :8] / np.maximum(s, 1e-300)).T
        return cls(D, hidden, left, products[0], matrices, condition)

    def roots(self) -> Roots:
        """Approximate configurations, in the order of the joints a to f."""
        none, once, twice = self.matrices
        companion = np.zeros((24, 24))
        companion[:12, 12:] = np.eye(12)
        companion[12:] = -np.linalg.solve(twice, np.hstack([none, once]))
        x, vectors = np.linalg.eig(companion)
        off = np.abs(x.imag) / (1 + np.abs(x) ** 2)
        real = np.flatnonzero(off < SETTINGS.real)
        real = real[np.argsort(x[real].real)]
        tangents = _tangents(x[real].real, vectors[:12, real])
        ordered = np.insert(tangents[1:], self.hidden, tangents[0], axis=0)
        c, d, e = 2 * np.arctan(ordered) + _OFFSETS[:, None]
        D = self.D
        frames = D[1] @ _turns(c) @ D[2] @ _turns(d) @ D[3] @ _turns(e) @ D[4]
        products = (_quantities(frames) - self.constant) @ self.left.T
        a = np.arctan2(products[:, 1], products[:, 0])
        b = np.arctan2(products[:, 5], products[:, 2])
        whole = _turns(a) @ D[0] @ _turns(b) @ frames
        R = whole[:, :3, :3].transpose(0, 2, 1) @ np.linalg.inv(D[5])[:3, :3]
        f = np.arctan2(R[:, 1, 0] - R[:, 0, 1], R[:, 0, 0] + R[:, 1, 1])
        certain = int((off[real] < SETTINGS.certainly_real).sum())
        return Roots(np.stack([a, b, c, d, e, f], axis=1), certain)


def _tangents(x: Array, vectors: npt.NDArray[np.complex128]) -> Array:
    """Half tangents (3, n) of the hidden joint and of the other two, from sorted eigenvalues x (n,)
    and their eigenvectors (12, n).

    Configurations with one value of x share an eigenvalue, and its eigenvectors are any basis of
    those of the configurations. A basis V of k vectors has V_next = V G, where `next` is one power
    of a half tangent more and G (k, k) has the k values of this half tangent as eigenvalues.
    """
    largest = vectors[np.abs(vectors).argmax(axis=0), range(len(x))]
    powers = (vectors / largest).real.reshape(4, 3, -1)
    pairs = [(powers[:-1], powers[1:]), (powers[:, :-1], powers[:, 1:])]
    ratios = [(low * high).sum(axis=(0, 1)) / (low * low).sum(axis=(0, 1)) for low, high in pairs]
    tangents = np.array([x, *ratios])
    apart = np.diff(x) > SETTINGS.same * (1 + x[1:] ** 2)
    for group in np.split(np.arange(len(x)), 1 + np.flatnonzero(apart)):
        if len(group) > 1:
            tangents[1:, group] = _shared(vectors[:, group])
    return tangents


def _shared(vectors: npt.NDArray[np.complex128]) -> Array:
    """Half tangents (2, k) of the other two joints in k configurations with one value of x, from
    eigenvectors (12, k).
    """
    k = vectors.shape[1]
    basis = np.linalg.svd(np.hstack([vectors.real, vectors.imag]))[0][:, :k].reshape(4, 3, k)
    pairs = [(basis[:-1], basis[1:]), (basis[:, :-1], basis[:, 1:])]
    d, e = (
        np.linalg.lstsq(low.reshape(-1, k), high.reshape(-1, k), rcond=None)[0]
        for low, high in pairs
    )
    W = np.linalg.eig(d + SETTINGS.mixed * e)[1]
    return np.array([np.diag(np.linalg.pinv(W) @ each @ W).real for each in (d, e)])


def _quantities(frames: Array) -> Array:
    """The fourteen quantities (..., 14) of the origins and z axes of frames (..., 4, 4)."""
    p, axis = frames[..., :3, 3], frames[..., :3, 2]
    pp, pl = ((p * each).sum(axis=-1, keepdims=True) for each in (p, axis))
    return np.concatenate([p, axis, pp, pl, cross(p, axis), pp * axis - 2 * pl * p], axis=-1)


def _turns(angles: Array) -> Array:
    """Turns (n, 4, 4) about z by angles (n,) [rad]."""
    turns = np.zeros((len(angles), 4, 4))
    turns[:, 0, 0] = turns[:, 1, 1] = np.cos(angles)
    turns[:, 1, 0] = np.sin(angles)
    turns[:, 0, 1] = -turns[:, 1, 0]
    turns[:, 2, 2] = turns[:, 3, 3] = 1.0
    return turns
