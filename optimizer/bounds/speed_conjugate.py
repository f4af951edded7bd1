"""The greatest values H of a dual bound's terms of speed, over a motion; the proof is in `dual_bound`."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from joulepath.models.robot import Array, Limits
from joulepath.optimizer.bounds.friction_conjugate import FrictionConjugate
from joulepath.optimizer.bounds.path_terms import PathTerms
from joulepath.optimizer.bounds.time_parts import TimeParts
from joulepath.optimizer.bounds.weights import Weights
from joulepath.optimizer.native.shared_library import address, shared_library

# halvings of the interval that holds the multiplier of a joint's displacement
_BISECTIONS = 9
# what a quotient's denominator is at least
_TINY = 1e-300


class _Friction(ctypes.Structure):
    """The `Friction` of the C."""

    _fields_ = [(name, ctypes.c_long) for name in ("intervals", "nq")] + [
        (name, ctypes.c_void_p) for name in ("first", "last", "constant", "slope", "sagitta", "load")
    ]


class _Path(ctypes.Structure):
    """The `Path` of the C."""

    _fields_ = [("S", ctypes.c_long)] + [
        (name, ctypes.c_void_p) for name in ("spread", "costate", "momentum", "x_rate", "omega")
    ]


class _Parts(ctypes.Structure):
    """The `Parts` of the C."""

    _fields_ = [("P", ctypes.c_long)] + [
        (name, ctypes.c_void_p) for name in ("step", "within", "length", "speed", "mean")
    ]


@dataclass(frozen=True)
class SpeedConjugate:
    """Σ_j ∫ H_j ds of motions of `duration` (E,) [s], which grow, with a path's terms; `loss` (nq,) is c."""

    friction: FrictionConjugate
    limits: Limits
    terms: PathTerms
    loss: Array
    duration: Array

    def __call__(self, weights: Weights) -> tuple[Array, Array]:
        """Bounds (E,) [W] on the integrals, and ∫ p · x' ds (E,) [N·m·rad].

        Speeds are those that a motion of the next duration may have, too. m is linear in 1 / T.
        """
        library = shared_library()
        if library is None:
            return self.by_numpy(weights)
        structures, _ = self._as_c
        stiffness, slowness = weights.confinement + weights.mixing, self._slowness(weights)
        result = np.empty_like(self.duration), np.empty_like(self.duration)
        library.speed_conjugate(
            *map(ctypes.addressof, structures), weights.scale, weights.work, _BISECTIONS, len(self.duration),
            *map(address, (stiffness, slowness, self.duration, *result)),
        )  # fmt: skip
        return result

    @cached_property
    def _as_c(self) -> tuple[tuple[ctypes.Structure, ...], list[NDArray[Any]]]:
        """What does not depend on the weights, and the arrays that it points to."""
        friction, terms, parts = self.friction, self.terms, self._parts
        path = [
            np.ascontiguousarray(each)
            for each in (terms.spread, self._costate, terms.momentum, terms.x_rate, terms.omega)
        ]
        times: list[NDArray[Any]] = [parts.step, parts.within, parts.length, parts.speed, self._mean]
        times = [np.ascontiguousarray(each) for each in times]
        load = None if friction.load is None else address(friction.load)
        structures = (
            _Friction(*friction.first.shape, *map(address, friction.by_joint), load),
            _Path(len(terms.spread), *map(address, path)),
            _Parts(len(parts.step), *map(address, times)),
        )
        return structures, [*path, *times]

    @cached_property
    def _parts(self) -> TimeParts:
        longest = np.append(self.duration[1:], self.duration[-1])
        return TimeParts.of(len(self.terms.spread), self.limits, longest)

    @cached_property
    def _mean(self) -> Array:
        """The means by step (2, S, nq) [rad/s] of the greatest speeds for the first and the last duration."""
        return self._parts.mean_speed(np.array([0, -1]))

    @cached_property
    def _costate(self) -> Array:
        """Γ / T (S + 1, nq) at the nodes, for multipliers as they are."""
        slope = self.terms.slope
        return np.concatenate([np.zeros((1, slope.shape[1])), np.cumsum(slope, axis=0) / len(slope)])

    def _slowness(self, weights: Weights) -> Array:
        """η / c (nq,)."""
        return np.asarray(weights.work / np.maximum(self.loss, _TINY))

    def by_numpy(self, weights: Weights) -> tuple[Array, Array]:
        """The same where the shared library cannot be compiled."""
        parts, duration, terms, scale = self._parts, self.duration, self.terms, weights.scale
        m_first, m_last = self._multiplier(weights, 0), self._multiplier(weights, -1)
        share = (1 / duration - 1 / duration[-1]) / max(1 / duration[0] - 1 / duration[-1], _TINY)
        m = m_last + share[:, None] * (m_first - m_last)
        T = duration[:, None, None]
        p = scale * T[..., None] * parts.ends(self._costate) + m[:, None, None]
        p = p + (scale * terms.momentum / T)[:, parts.step, None]
        b = (terms.x_rate / T)[:, parts.step, None]
        stiffness = (weights.confinement + weights.mixing + scale * terms.spread)[parts.step, None]
        omega = scale * parts.ends(terms.omega)
        height = self._greatest(weights, p, omega, b, stiffness, parts.speed[:, :, None])[0]
        along = (p.mean(axis=2) * (terms.x_rate[parts.step] * parts.length[:, None])).sum(axis=(1, 2))
        return (height.mean(axis=2) * parts.length[:, None]).sum(axis=(1, 2)), along

    def _multiplier(self, weights: Weights, which: int) -> Array:
        """m (nq,) [N·m] for the first or last duration with which the speeds of H cover the displacement: the greatest
        bound, near enough."""
        terms, duration, scale = self.terms, self.duration[which], weights.scale
        b, omega = terms.x_rate / duration, scale * (terms.omega[1:] + terms.omega[:-1]) / 2
        p = scale * (duration * (self._costate[1:] + self._costate[:-1]) / 2 + terms.momentum / duration)
        stiffness = weights.confinement + weights.mixing + scale * terms.spread
        friction, displacement = self.friction, terms.x_rate.sum(axis=0)
        torque = (friction.constant + friction.slope * friction.last)[-1]
        reach = 4 * torque + np.abs(p).max(axis=0) + stiffness.max(axis=0) * friction.last[-1]
        low, high = -reach, reach
        for _ in range(_BISECTIONS):
            m = (low + high) / 2
            v = self._greatest(weights, p + m, omega, b, stiffness, self._mean[which])[1]
            short = duration * v.sum(axis=0) < displacement
            low, high = np.where(short, m, low), np.where(short, high, m)
        return np.asarray((low + high) / 2)

    def _greatest(
        self, weights: Weights, p: Array, omega: Array, b: Array, stiffness: Array, most: Array
    ) -> tuple[Array, Array]:
        """H (..., nq) [W] for these p, ω, speeds b of the path, κ + μ + ν and greatest speeds, and where it is."""
        more, slowness = 1 + 2 * weights.work, self._slowness(weights)
        linear = p - stiffness * b + slowness * omega
        square = stiffness / 2 + weights.work * slowness
        # (1 + 2 η) v + ω is more · (v + ω / more)
        value, v = self.friction.greatest(linear / more, omega / more, square / more, most)
        return more * value - p * b + stiffness * b * b / 2, v
