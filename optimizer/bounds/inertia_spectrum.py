"""The joint-space inertia as a trigonometric polynomial, with bounds on its derivatives.

An entry M_jk is a sum of products of two vectors, and a joint turns either vector at most once
(`chain_derivatives`). So it is a polynomial of degree 2 or less in the cosine and sine of every
joint: M_jk = Σ_n c_n exp(i n · q) with n between -2 and 2 for every joint. M does not depend on the
first joint, which turns the whole arm. A discrete Fourier transform of five equidistant samples for
every other joint gives the coefficients without aliasing. A derivative by joints a, b, … multiplies
a term by i n_a · i n_b · …, and the absolute value of a term is that of its coefficient: the
derivative is at most Σ_n |n_a n_b …| |c_n|.

Joints with parallel axes turn the arm by the sum of their angles, a single term: then the bounds
are near the greatest values.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.fft import fftn

from joulepath.models.robot import Array

SAMPLES_PER_JOINT = 5
"""Samples of each joint: 2 · 2 + 1 for a polynomial of degree 2."""


@dataclass(frozen=True)
class SpectrumSettings:
    """Settings of the spectrum of an inertia."""

    most_joints: int = 7
    """Largest number of joints: there are 5^(joints - 1) samples."""
    rounding: float = 1e-12
    """Rounding error of the samples and their transform, relative to the greatest entry."""


SPECTRUM = SpectrumSettings()


@dataclass(frozen=True)
class InertiaSpectrum:
    """Terms of the joint-space inertia, those of n and -n together."""

    waves: Array
    """|n| of each term, shape (K, nq)."""
    size: Array
    """Sums of the absolute values of coefficients, shape (K, nq, nq) [kg·m²]."""

    @classmethod
    def of(cls, inertia: Callable[[Array], Array], joints: int) -> InertiaSpectrum | None:
        """The spectrum of an inertia; None for more than `SpectrumSettings.most_joints` joints.

        Args:
            inertia: inertia (n, nq, nq) [kg·m²] of configurations (n, nq) [rad].
            joints: number of joints nq.
        """
        if joints > SPECTRUM.most_joints:
            return None
        angles, turning = 2 * np.pi * np.arange(SAMPLES_PER_JOINT) / SAMPLES_PER_JOINT, joints - 1
        q = np.concatenate(
            [np.zeros((SAMPLES_PER_JOINT**turning, 1)), _grid(angles, turning)], axis=1
        )
        upper = np.triu_indices(joints)
        samples = inertia(q)[:, *upper].reshape(*(SAMPLES_PER_JOINT for _ in range(turning)), -1)
        size = np.abs(fftn(samples, axes=range(turning))) / len(q)
        size += SPECTRUM.rounding / len(q) * np.abs(samples).max()
        # bounds need only |n| and |c_n|: terms of n and -n are merged
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
        """Bounds on the derivatives of M_jk, shape (nq,) * order + (nq, nq) [kg·m²].

        Args:
            order: number of joints by which M is derived, at least 1.
        """
        count, joints = self.waves.shape
        product = self.waves
        for _ in range(order - 1):
            product = (product[:, :, None] * self.waves[:, None]).reshape(count, -1)
        return np.asarray(
            (product.T @ self.size.reshape(count, -1)).reshape((joints,) * (order + 2))
        )


def _grid(values: Array, joints: int) -> Array:
    """Every combination of values of joints, shape (n, joints)."""
    if not joints:
        return np.zeros((1, 0))
    axes = np.meshgrid(*(values for _ in range(joints)), indexing="ij")
    return np.stack(axes, axis=-1).reshape(-1, joints)
