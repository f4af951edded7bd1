"""The joint-space inertia as a trigonometric polynomial, and bounds on its derivatives at every
configuration.

An entry M_jk is a sum of products of two vectors that each joint turns at most once
(`chain_derivatives`). So it is a polynomial of degree 2 or less in the cosine and sine of every
joint: M_jk = Σ_n c_n exp(i n · q), where n has an integer between -2 and 2 for each joint. The
first joint turns all that M depends on. Equidistant samples, five for each of the other joints,
give the coefficients by a discrete Fourier transform, without aliasing. A derivative by joints a,
b, … multiplies each term by i n_a · i n_b · …, and a term's size is that of its coefficient: the
derivative is at most Σ_n |n_a n_b …| |c_n|.

Parallel axes turn by the sum of their joints, which is one term: these bounds are near the greatest
values.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.fft import fftn

from joulepath.models.robot import Array

# samples of a joint
_SAMPLES = 5
# the samples of more joints than this are too many
_MOST_JOINTS = 7
# relative to the greatest entry: rounding of the samples and of their transform
_ROUNDING = 1e-12


@dataclass(frozen=True)
class InertiaSpectrum:
    """Sizes |n| (K, nq) of terms, and sums (K, nq, nq) [kg·m²] of the sizes of their
    coefficients."""

    waves: Array
    size: Array

    @classmethod
    def of(cls, inertia: Callable[[Array], Array], joints: int) -> InertiaSpectrum | None:
        """The terms of `inertia`, which takes configurations (n, nq) [rad]; None for more than 7
        joints.
        """
        if joints > _MOST_JOINTS:
            return None
        angles, turning = 2 * np.pi * np.arange(_SAMPLES) / _SAMPLES, joints - 1
        q = np.concatenate([np.zeros((_SAMPLES**turning, 1)), _grid(angles, turning)], axis=1)
        upper = np.triu_indices(joints)
        samples = inertia(q)[:, *upper].reshape(*(_SAMPLES for _ in range(turning)), -1)
        size = np.abs(fftn(samples, axes=range(turning))) / len(q)
        size += _ROUNDING / len(q) * np.abs(samples).max()
        # a bound takes no more of a term than its size and the sizes |n|: those of n and -n go
        # together
        for axis in range(turning):
            zero, one, two, minus_two, minus_one = np.moveaxis(size, axis, 0)
            size = np.stack([zero, one + minus_one, two + minus_two], axis=axis)
        together = size.reshape(-1, size.shape[-1])
        waves = np.concatenate(
            [np.zeros((len(together), 1)), _grid(np.arange(3.0), turning)], axis=1
        )
        full = np.zeros((len(waves), joints, joints))
        full[:, *upper] = together
        full[:, *upper[::-1]] = together
        return cls(waves, full)

    def bound(self, order: int) -> Array:
        """Bounds (nq,) * order + (nq, nq) [kg·m²] on the derivatives of M_jk by `order` ≥ 1
        joints."""
        count, joints = self.waves.shape
        product = self.waves
        for _ in range(order - 1):
            product = (product[:, :, None] * self.waves[:, None]).reshape(count, -1)
        return np.asarray(
            (product.T @ self.size.reshape(count, -1)).reshape((joints,) * (order + 2))
        )


def _grid(values: Array, joints: int) -> Array:
    """Every combination (n, joints) of these values."""
    axes = np.meshgrid(*(values for _ in range(joints)), indexing="ij")
    return np.stack(axes, axis=-1).reshape(-1, joints)
