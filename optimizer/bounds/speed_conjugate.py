"""Greatest values H of a dual bound's terms of speed, over a motion; proof in `dual_bound`."""

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
from joulepath.optimizer.bounds.time_parts import TimeParts
from joulepath.optimizer.bounds.weights import Weights
from joulepath.optimizer.native.shared_library import address, library

BISECTIONS = 9
"""Halvings of the interval of the multiplier m of a joint's displacement."""


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
    """Σ_j ∫ H_j ds with the terms of a path."""

    friction: FrictionConjugate
    limits: Limits
    terms: PathTerms
    loss: Array
    """Copper loss c, shape (nq,) [W/(N·m)²]."""
    duration: Array
    """Durations in ascending order, shape (E,) [s]."""

    def __call__(self, weights: Weights) -> tuple[Array, Array]:
        """Bounds on the integrals at each duration.

        Speeds are bounded by those of the next greater duration. m is linear in 1 / T.

        Returns:
            Bounds (E,) [W], and ∫ p · x' ds (E,) [N·m·rad].
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
        """The structs, which do not depend on the weights, and the arrays that they point to."""
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
        """Means by step (2, S, nq) [rad/s] of the greatest speeds for the first and the last
        duration.
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
