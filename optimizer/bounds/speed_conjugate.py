"""Maxima H of the speed terms of a dual bound, integrated over a motion; proof in `dual_bound`."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from joulepath.models.robot import Array, Limits
from joulepath.optimizer.bounds.cruise import TINY
from joulepath.optimizer.bounds.friction_conjugate import FrictionConjugate
from joulepath.optimizer.bounds.path_terms import PathTerms
from joulepath.optimizer.bounds.reference import greatest_speed
from joulepath.optimizer.bounds.weights import Weights
from joulepath.optimizer.collision.bodies import Indices
from joulepath.optimizer.native.shared_library import address, library

BISECTIONS = 9
"""Number of bisections in the search for the multiplier m of a joint's displacement."""


class _Friction(ctypes.Structure):
    """The struct `Friction` of the C library."""

    _fields_ = [(name, ctypes.c_long) for name in ("intervals", "nq")] + [
        (name, ctypes.c_void_p)
        for name in ("first", "last", "constant", "slope", "sagitta", "load")
    ]


class _Path(ctypes.Structure):
    """The struct `Path` of the C library."""

    _fields_ = [("S", ctypes.c_long)] + [
        (name, ctypes.c_void_p) for name in ("spread", "costate", "momentum", "x_rate", "omega")
    ]


class _Parts(ctypes.Structure):
    """The struct `Parts` of the C library."""

    _fields_ = [("P", ctypes.c_long)] + [
        (name, ctypes.c_void_p) for name in ("step", "within", "length", "speed", "mean")
    ]


@dataclass(frozen=True)
class SpeedConjugate:
    """Upper bounds on Σ_j ∫ H_j ds, where H_j is the maximum of the speed terms of joint j."""

    friction: FrictionConjugate
    limits: Limits
    terms: PathTerms
    loss: Array
    """Copper loss c, shape (nq,) [W/(N·m)²]."""
    duration: Array
    """Durations in ascending order, shape (E,) [s]."""

    def __call__(self, weights: Weights) -> tuple[Array, Array]:
        """Bound the integral of H at every duration.

        The speed limits at a duration are the speed limits at the next greater duration, so that a
        bound also holds in between. The multiplier m is linear in 1 / T.

        Args:
            weights: weights of the dual bound.

        Returns:
            Bounds, shape (E,) [W], and ∫ p · x' ds, shape (E,) [N·m·rad].
        """
        structures, _ = self._as_c
        stiffness, slowness = weights.confinement + weights.mixing, self._slowness(weights)
        result = np.empty_like(self.duration), np.empty_like(self.duration)
        library.speed_conjugate(
            *map(ctypes.addressof, structures),
            weights.scale,
            weights.work,
            BISECTIONS,
            len(self.duration),
            *map(address, (stiffness, slowness, self.duration, *result)),
        )
        return result

    @cached_property
    def _as_c(self) -> tuple[tuple[ctypes.Structure, ...], list[NDArray[Any]]]:
        """Structs of the C function that do not depend on the weights, and their arrays."""
        friction, terms, parts = self.friction, self.terms, self._parts
        path = [
            np.ascontiguousarray(each)
            for each in (terms.spread, self._costate, terms.momentum, terms.x_rate, terms.omega)
        ]
        times: list[NDArray[Any]] = [
            parts.step,
            parts.within,
            parts.length,
            parts.speed,
            self._mean,
        ]
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
        """Means over every step of the speed bounds at the first and the last duration.

        The shape is (2, S, nq) [rad/s].
        """
        return self._parts.mean_speed(np.array([0, -1]))

    @cached_property
    def _costate(self) -> Array:
        """Γ / T at the nodes (S + 1, nq), for multipliers with the factor 1."""
        slope = self.terms.slope
        return np.concatenate(
            [np.zeros((1, slope.shape[1])), np.cumsum(slope, axis=0) / len(slope)]
        )

    def _slowness(self, weights: Weights) -> Array:
        """η / c (nq,)."""
        return np.asarray(weights.work / np.maximum(self.loss, TINY))


@dataclass(frozen=True)
class PartSettings:
    """Settings of the division of a path's steps into parts."""

    longest: float = 0.015
    """Longest part [s] near the ends, while the acceleration and jerk limits bound the speed."""
    most_parts: int = 24
    """Largest number of parts of a step."""


PARTS = PartSettings()


@dataclass(frozen=True)
class TimeParts:
    """Parts of the steps of a path."""

    step: Indices
    """Index of the step of a part, shape (P,)."""
    within: Array
    """First and last instant of a part as shares of its step, shape (P, 2)."""
    length: Array
    """Length of a part as a share of the motion, shape (P,); the sum is 1."""
    speed: Array
    """Bounds on the speed in a part for B durations, shape (B, P, nq) [rad/s]."""

    @classmethod
    def of(cls, steps: int, limits: Limits, duration: Array) -> TimeParts:
        """The parts of the steps of motions.

        Args:
            steps: number of steps.
            limits: limits on speed, acceleration and jerk.
            duration: greatest durations, shape (B,) [s].
        """
        longest = float(duration.max())
        build_up = float((limits.v_max / limits.a_max + limits.a_max / limits.j_max).max())
        k = np.arange(steps)
        left = np.minimum(k, steps - 1 - k) * longest / steps
        count = np.where(
            left < build_up,
            np.clip(np.ceil(longest / steps / PARTS.longest), 1, PARTS.most_parts),
            1,
        ).astype(int)
        step = np.repeat(k, count)
        part = np.arange(len(step)) - np.repeat(np.cumsum(count) - count, count)
        within = np.stack([part, part + 1], axis=1) / count[step][:, None]
        share = (step[:, None] + within) / steps
        # instant of the part at the greatest distance from the nearer end of the motion
        inner = np.where(
            (share[:, 0] < 0.5) & (share[:, 1] > 0.5), 0.5, np.minimum(share[:, 1], 1 - share[:, 0])
        )
        return cls(
            step,
            within,
            1 / (steps * count[step]),
            greatest_speed(limits, duration[:, None] * inner),
        )

    def mean_speed(self, which: Indices) -> Array:
        """Mean of the speed bounds over every step, shape (k, S, nq) [rad/s].

        Args:
            which: indices of durations, shape (k,).
        """
        first = np.flatnonzero(np.diff(self.step, prepend=-1))
        weight = self.length[:, None] * len(first)
        return np.asarray(np.add.reduceat(self.speed[which] * weight, first, axis=1))
