"""Proof that the torques at all postures in given boxes are within allowed torques.

With fixed speeds, accelerations and payload, a torque τ_i(q) deviates from its multilinear
interpolation between the corners of a box with half sides h by at most Σ_k h_k² / 2 · max
|∂²τ_i/∂q_k²|. The greatest |τ_i| over speeds and accelerations is convex in the terms of τ_i, and
an interpolated term is a mean of the terms at the corners. Hence the greatest |τ_i| in a box is at
most the greatest |τ_i| at its corners plus this deviation.

Bounds on the second derivatives of inertia and velocity terms hold for all postures
(`chain_derivatives`). The second derivative of gravity torque i by joint k is at most
|g| |z_m × S_m| with the larger m of k and i. This is small if joint m turns the links beyond it
about their centre of mass. S_m depends on the joints beyond m: by the same rule, |z_m × S_m| is at
most its value at the corners plus Σ_{l>m} h_l² / 2 · |z_l × S_l|.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.bounds.chain_derivatives import ChainDerivatives
from joulepath.optimizer.bounds.subdivide import Boxes, SearchLimits, Subdivision
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.deadline import checkpoint
from joulepath.optimizer.joint_limits.posture_set import PostureSet
from joulepath.optimizer.joint_limits.posture_terms import PostureTerms
from joulepath.optimizer.joint_limits.torque_load import Rates, greatest_torques


@dataclass(frozen=True)
class CoverSettings:
    """Settings of the subdivision."""

    boxes_per_round: int = 1000
    """Number of boxes halved in a round."""
    negligible: float = 0.01
    """Change of a torque by a joint, relative to the unit of the excess, that is added to the bound
    instead of halving boxes across the joint.
    """


COVER = CoverSettings()


@dataclass(frozen=True)
class _Boxes(Boxes):
    """Boxes of postures; their value is the negative of the bound on the excess."""

    excess: Array
    """Excess of the torques at the corners, shape (n, 2^m, nq)."""
    curvature: Array
    """|g| |z_k × S_k| at the corners, shape (n, 2^m, nq) [N·m]."""


class TorqueCover(Subdivision[_Boxes]):
    """Comparison of the torques of an arm with one payload, at all postures in boxes, with allowed
    torques.
    """

    def __init__(
        self,
        chain: ChainDerivatives,
        rates: Rates,
        allowed: Array,
        unit: Array,
        postures: PostureSet,
        enough: float,
        evaluations: int,
    ) -> None:
        """Prepare a proof.

        Args:
            chain: the arm with its payload.
            rates: limits on speeds and accelerations.
            allowed: largest torques of the bodies, shape (nq,) [N·m].
            unit: units of the excess of the torques, shape (nq,) [N·m].
            postures: the postures.
            enough: excess of a posture that ends the proof.
            evaluations: largest number of evaluated postures of a proof.
        """
        self._chain, self._rates, self._postures = chain, rates, postures
        self._allowed, self._unit, self._enough = allowed, unit, enough
        self._left = evaluations
        self.violations = np.zeros((0, chain.nq))
        """Postures with an excess above `enough`, shape (k, nq) [rad]."""
        k, v = np.arange(chain.nq), rates.v
        inertia, slopes = chain.inertia_bound(2)[k, k], chain.inertia_bound(3)[k, k]
        along = (
            np.einsum("klij,j,l->ki", slopes, v, v) + np.einsum("kijl,j,l->ki", slopes, v, v) / 2
        )
        self._motion = (inertia @ rates.a + along) / unit
        self._later = np.maximum.outer(k, k)
        gravity = chain.potential_bound(3)[k, k]
        last = chain.gravity_curvature(np.zeros((1, chain.nq)))[0, -1]
        self._gravity = np.where(self._later == chain.nq - 1, np.minimum(gravity, last), gravity)
        # A torque has the period 2π: its slope vanishes somewhere, and is at most π times the
        # largest curvature. Any two values of the torque differ by at most π² times the curvature.
        change = np.pi**2 * (self._motion + self._gravity / unit)
        self._joints = np.flatnonzero(change.max(axis=1) > COVER.negligible)
        self._still = np.setdiff1d(k, self._joints)
        self._rest = change[self._still].sum(axis=0)
        self._bits = np.array(list(product((0, 1), repeat=len(self._joints))))

    def holds(self) -> bool:
        """Whether the proof succeeds: no posture has an excess.

        Raises:
            DeadlinePassed: the watched deadline passed.
        """
        left = self.run(SearchLimits(rounds=self._left))
        return not len(left.value) and not len(self.violations)

    def first(self) -> _Boxes:
        """The boxes of the postures."""
        centre, half = self._postures.centre, self._postures.half
        return self._undecided(centre, half, *self._at(self._corners(centre, half)))

    def chosen(self, parts: _Boxes, number: int) -> Indices:
        """The boxes of largest excess."""
        checkpoint()
        ends = len(self.violations) > 0 or self._left < 0
        return np.arange(0 if ends else min(COVER.boxes_per_round, len(parts.value)))

    def divided(self, parts: _Boxes, rows: Indices) -> _Boxes:
        """Both halves of the boxes, across the joint with the largest share in a box's bound."""
        old, each = parts[rows], np.arange(len(rows))
        deviation = self._deviation(old.half, old.curvature)
        worst = (old.excess.max(axis=1) + deviation.sum(axis=1)).argmax(axis=1)
        axis = deviation[each, :, worst].argmax(axis=1)
        joint = self._joints[axis]
        # the middles of the edges along this joint are corners of both halves
        middles = self._corners(old.centre, old.half)
        middles[each, :, joint] = old.centre[each, joint][:, None]
        lower = np.argsort(self._bits[:, axis].T, axis=1, kind="stable")[:, : len(self._bits) // 2]
        upper = lower + (len(self._bits) >> 1 + axis)[:, None]
        between = self._at(np.take_along_axis(middles, lower[..., None], axis=1))
        half = old.half.copy()
        half[each, joint] /= 2
        halves = []
        for side, replaced in ((-1, upper), (1, lower)):
            centre, known = old.centre.copy(), (old.excess.copy(), old.curvature.copy())
            centre[each, joint] += side * half[each, joint]
            for values, new in zip(known, between, strict=True):
                np.put_along_axis(values, replaced[..., None], new, axis=1)
            halves.append(self._undecided(centre, half, *known))
        return halves[0].joined(halves[1])

    def _undecided(self, centre: Array, half: Array, excess: Array, curvature: Array) -> _Boxes:
        """The boxes with a bound on the excess above zero."""
        deviation = self._deviation(half, curvature).sum(axis=1)
        bound = (excess.max(axis=1) + deviation + self._rest).max(axis=1)
        return _Boxes(-bound, centre, half, excess, curvature)[np.flatnonzero(bound > 0)]

    def _deviation(self, half: Array, curvature: Array) -> Array:
        """Deviations from the interpolation by every divided joint, shape (n, m, nq)."""
        square, most = half**2 / 2, curvature.max(axis=1)
        square[:, self._still] = np.pi**2
        for k in reversed(range(most.shape[1] - 1)):
            most[:, k] += (square[:, k + 1 :] * most[:, k + 1 :]).sum(axis=1)
        gravity = np.minimum(most[:, self._later], self._gravity) / self._unit
        return np.asarray((square[..., None] * (self._motion + gravity))[:, self._joints])

    def _corners(self, centre: Array, half: Array) -> Array:
        """Corners of boxes, shape (n, 2^m, nq) [rad]."""
        q = np.repeat(centre[:, None], len(self._bits), axis=1)
        q[..., self._joints] += (2 * self._bits - 1) * half[:, None, self._joints]
        return q

    def _at(self, q: Array) -> tuple[Array, Array]:
        """Excess of the torques, and |g| |z_k × S_k|, at corners (n, k, nq) [rad] of boxes."""
        flat = q.reshape(-1, q.shape[-1])
        # adjacent boxes have corners in common
        _, index, back = np.unique(flat.round(9), axis=0, return_index=True, return_inverse=True)
        flat, back = flat[index], back.reshape(-1)
        self._left -= len(flat)
        torques = greatest_torques(PostureTerms.of(self._chain, flat), self._rates)
        excess = (torques - self._allowed) / self._unit
        if excess.max() > self._enough:
            worst = flat[np.unique(excess.argmax(axis=0))]
            self.violations = np.concatenate([self.violations, worst])
        curvature = self._chain.gravity_curvature(flat)
        return excess[back].reshape(q.shape), curvature[back].reshape(q.shape)
