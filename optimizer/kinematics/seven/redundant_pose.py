"""One pose of an arm of the form `SphericalShoulder`: its configurations over the last angle, and
their intervals.

A branch is given by three `signs` (shoulder, elbow, wrist), 1 or -1, of the angle χ between the
third axis and the first, of θ and of ψ. The module `spherical_shoulder` has the formulas.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.seven.interval_edges import interval_edges
from joulepath.optimizer.kinematics.seven.spherical_shoulder import (
    SphericalShoulder,
    harmonic_parts,
)
from joulepath.optimizer.kinematics.seven.spinors import Complex, unitary


@dataclass(frozen=True)
class PoseSettings:
    """Tolerances of the intervals of the last angle."""

    rounding: float = 1e-12
    """Squared sine down to which, below zero, it counts as zero: cosines are clipped to 1."""
    edge: float = 1e-7
    """Largest squared sine at an edge of an interval: the angle of a double zero is found to some
    1e-8 rad.
    """
    least_square: float = 1e-12
    """Smallest squared distance that divides [m²]."""


SETTINGS = PoseSettings()


@dataclass(frozen=True, eq=False)
class RedundantPose:
    """Arm of the form `SphericalShoulder` with its flange at the pose T (4, 4)."""

    form: SphericalShoulder
    T: Array

    @cached_property
    def orientation(self) -> Array:
        """Rotation (3, 3) of the last link."""
        return self.form.last_link(self.T)[:3, :3]

    @cached_property
    def shoulder(self) -> Array:
        """Position (3,) [m] of S in the frame of the last link."""
        return self.form.shoulder_in_7(self.T)

    def from_wrist(self, q7: Array) -> Array:
        """Vector v (3, n) [m] at last angles q7 (n,) [rad]."""
        return np.asarray(self._wrist_harmonics @ harmonics(np.cos(q7), np.sin(q7)))

    @cached_property
    def _wrist_harmonics(self) -> Array:
        """Coefficients (3, 3) [m] of 1, cos q7 and sin q7 in v, as columns."""
        x, y, z = self.shoulder.tolist()
        P = self.form.placements[6]
        rows = np.empty((3, 3))
        rows[:, 0] = P[:3, 3] + P[:3, 2] * z
        rows[2, 0] -= self.form.sixth
        rows[:, 1], rows[:, 2] = P[:3, 0] * x + P[:3, 1] * y, P[:3, 1] * x - P[:3, 0] * y
        return rows

    @cached_property
    def coefficients(self) -> Array:
        """Coefficients (2, 3) of 1, cos q7 and sin q7 in |v|² [m²] and in v_z [m]."""
        v = self._wrist_harmonics
        # The vectors of cos and sin are perpendicular and have the same length.
        square = v[:, 0] @ v
        rows = np.array([2 * square, v[2]])
        rows[0, 0] = square[0] + v[:, 1] @ v[:, 1]
        return rows

    @cached_property
    def range_harmonics(self) -> tuple[Array, Array, Array]:
        """`harmonic_parts` of |v|² and v_z, and of v_x and v_y."""
        return harmonic_parts(self.coefficients, self._wrist_harmonics[:2])

    def angles(self, q7: Array, elbow: Array, wrist: Array) -> tuple[Array, Array]:
        """Angles θ and ψ (n,) [rad] at last angles q7 (n,) on branches with these signs (n,).

        Cosines beyond 1 count as 1.
        """
        theta, psi, _ = self._angles_of(harmonics(np.cos(q7), np.sin(q7)), elbow, wrist)
        return theta, psi

    def _angles_of(self, seventh: Array, elbow: Array, wrist: Array) -> tuple[Array, Array, Array]:
        """Angles θ and ψ from the harmonics (3, n) of q7, and the harmonics (3, n) of θ."""
        form, (distance, v_z) = self.form, self.coefficients @ seventh
        cos = to_cosine((form.squares - distance) / (2 * form.rho * form.nu))
        fourth = harmonics(cos, elbow * np.sqrt((1 - cos) * (1 + cos)))
        along = form.along_fifth @ fourth - form.fifth_in_6[2] * v_z
        reach = form.inclined * np.sqrt(np.maximum(distance - v_z * v_z, 0.0))
        across = np.sqrt(np.maximum((reach - along) * (reach + along), 0.0))
        return elbow * np.arccos(cos), wrist * np.arctan2(across, along), fourth

    def configurations(self, q7: Array, signs: Array) -> Array:
        """Configurations (n, 7) [rad] in [-π, π] at last angles q7 (n,) on branches with signs
        (n, 3).
        """
        shoulder, elbow, wrist = signs.T
        seventh = harmonics(np.cos(q7), np.sin(q7))
        theta, psi, fourth = self._angles_of(seventh, elbow, wrist)
        last = self._last(q7, theta, psi, seventh, fourth)
        return np.ascontiguousarray(self.completed(last, backwards(last), shoulder).T)

    def at_angles(
        self,
        q7: Array,
        theta: Array,
        psi: Array,
        shoulder: Array,
        free: dict[int, Array] | None = None,
    ) -> Array:
        """Configurations (n, 7) [rad] with given angles (n,) [rad].

        At a singularity, `free` gives the arbitrary angles (n,) [rad] of the first joint (key 0) or
        the fifth joint (key 4).
        """
        last = self.wrist(q7, theta, psi)
        free = {} if free is None else free
        if 4 in free:
            last[1] = free[4]
        return np.ascontiguousarray(self.completed(last, backwards(last), shoulder, free.get(0)).T)

    def wrist(self, q7: Array, theta: Array, psi: Array) -> Array:
        """Positions (4, n) [rad] of the last four joints at given angles (n,) [rad]."""
        return self._last(
            q7,
            theta,
            psi,
            harmonics(np.cos(q7), np.sin(q7)),
            harmonics(np.cos(theta), np.sin(theta)),
        )

    def _last(self, q7: Array, theta: Array, psi: Array, seventh: Array, fourth: Array) -> Array:
        """The result of `wrist` from the harmonics (3, n) of q7 and of θ."""
        form = self.form
        v = self._wrist_harmonics @ seventh
        S = self.form.shoulder_harmonics.T @ fourth
        last = np.empty((4, len(q7)))
        last[0], last[3] = form.q4_at_zero - theta, q7
        last[2] = psi - np.arctan2(v[1], v[0]) + form.fifth_azimuth
        # The fifth angle is between the azimuths of S, seen from both sides.
        c, s = np.cos(last[2]), np.sin(last[2])
        v[0], v[1] = c * v[0] - s * v[1], s * v[0] + c * v[1]
        x, y = form.placements[5, :2, :3] @ v
        last[1] = np.arctan2(S[1] * x - S[0] * y, S[0] * x + S[1] * y)
        return last

    def completed(
        self, last: Array, back: Complex, shoulder: Array, q1: Array | None = None
    ) -> Array:
        """Joint positions (7, n) [rad] in [-π, π] from the last four.

        Args:
            last: positions of the last four joints, shape (4, n) [rad].
            back: complex numbers e^{-iq} of `last`, shape (4, n).
            shoulder: signs of the shoulder, shape (n,).
            q1: first angles (n,) [rad] at the shoulder's singularity.
        """
        form, q, spinor = self.form, np.empty((7, len(shoulder))), self._spinors(back)
        size, phase = np.abs(spinor), np.arctan2(spinor.imag, spinor.real)
        # With the other shoulder the third axis leans to the other side. The spinors omit half of
        # the sum of the last angles.
        left, out = np.pi / 2 * (1 - shoulder), np.add.reduce(last, axis=0)
        azimuth = phase[1] - phase[0] if q1 is None else q1 + form.lean_azimuth - left
        if q1 is None:
            turn = phase[0] + phase[1]
        else:
            half = np.exp(0.5j * azimuth)
            turn = 2 * np.angle(size[0] * half * spinor[0] + size[1] * half.conj() * spinor[1])
        q[0], q[2] = azimuth + (left - form.lean_azimuth), left - form.twist - turn - out
        q[1] = 2 * shoulder * np.arctan2(size[1], size[0]) - form.lean_at_zero
        q[3:] = last
        return np.asarray(np.minimum(np.maximum(wrapped(q), -np.pi), np.pi))

    def third_axis(self, q7: Array, theta: Array, psi: Array) -> Complex:
        """Third axis in the frame of joint 1 at q1 = 0, as x + iy (n,), at given angles (n,)
        [rad].
        """
        ahead, aside = self._spinors(backwards(self.wrist(q7, theta, psi)))
        return np.asarray(2 * ahead.conj() * aside)

    def _spinors(self, back: Complex) -> Complex:
        """Spinors (2, n), up to a factor, of the rotation from joint 1 at q1 = 0 to link 3, from
        e^{-iq} (4, n) of the last four joints.
        """
        first, *others = self.form.backwards
        spinor = np.ones((2, back.shape[1]), dtype=complex)
        spinor[1] = back[0]
        for turn, each in zip(back[1:], (first, *others), strict=True):
            spinor = each @ spinor
            spinor[1] *= turn
        return np.asarray(self._from_last @ spinor)

    @cached_property
    def _from_last(self) -> Complex:
        """Unitary matrix that carries spinors from the last link to joint 1 at q1 = 0."""
        return unitary(self.form.placements[0, :3, :3].T @ self.orientation)

    def intervals(self, elbow: float) -> list[tuple[float, float]]:
        """Intervals [rad] of q7, each within a turn, with configurations on both branches of an
        elbow.

        An interval may be a single angle. A whole turn is (-π, π).
        """
        edges = self._edges
        own = self._excesses[0 if elbow > 0 else 1]
        if not len(edges):
            return [(-np.pi, np.pi)] if own[0] >= -SETTINGS.rounding else []
        at, between = own[: len(edges)], own[len(edges) :]
        inside = (between >= -SETTINGS.rounding).tolist()
        # An edge of the branches with the other elbow is no edge here.
        bounds = np.abs(at) < SETTINGS.edge
        if all(inside) and not bounds.any():
            return [(-np.pi, np.pi)]
        found = [
            (float(q7), float(q7))
            for k, q7 in enumerate(edges)
            if bounds[k] and not inside[k - 1] | inside[k]
        ]
        # Starting at an edge, so that no interval begins before the first one.
        first = int(bounds.argmax())
        start: float | None = None
        for k in [*range(first, len(edges)), *range(first)]:
            if start is not None and (bounds[k] or not inside[k]):
                found.append(
                    (start, float(edges[k] if edges[k] >= start else edges[k] + 2 * np.pi))
                )
                start = None
            if inside[k] and start is None:
                start = float(edges[k])
        if start is not None:
            end = float(edges[first])
            found.append((start, end if end > start else end + 2 * np.pi))
        return found

    @cached_property
    def _excesses(self) -> Array:
        """Excess (2, k) at the edges, then between consecutive edges, for both elbows; without
        edges, at one angle.

        The excess is the smaller one of sin²θ and of sin²ψ r²/|v|², negative outside the intervals.
        """
        form, edges, q7 = self.form, self._edges, np.zeros(max(2 * len(self._edges), 1))
        if len(edges):
            q7[: len(edges)], q7[len(edges) : -1] = edges, (edges[1:] + edges[:-1]) / 2
            q7[-1] = (edges[0] + 2 * np.pi + edges[-1]) / 2
        distance, v_z = self.coefficients @ harmonics(np.cos(q7), np.sin(q7))
        cos = (form.squares - distance) / (2 * form.rho * form.nu)
        clipped = to_cosine(cos)
        k0, kc, ks = form.along_fifth
        aside = ks * np.sqrt((1 - clipped) * (1 + clipped))
        along = k0 + kc * clipped - form.fifth_in_6[2] * v_z + np.array([aside, -aside])
        reach = form.inclined**2 * np.maximum(distance - v_z * v_z, 0.0)
        return np.asarray(
            np.minimum(
                1 - cos * cos, (reach - along * along) / np.maximum(distance, SETTINGS.least_square)
            )
        )

    @cached_property
    def _edges(self) -> Array:
        """Sorted angles (k,) [rad] in [-π, π) that may end an interval of any branch."""
        return interval_edges(self.form, self.coefficients)


def to_cosine(x: Array) -> Array:
    """x clipped to [-1, 1], several times faster than np.clip for few numbers."""
    return np.asarray(np.minimum(np.maximum(x, -1.0), 1.0))


def harmonics(c: Array, s: Array) -> Array:
    """Harmonics 1, cosine and sine (3, n) of angles (n,), from their cosines and sines."""
    rows = np.empty((3, len(c)))
    rows[0], rows[1], rows[2] = 1.0, c, s
    return rows


def backwards(q: Array) -> Complex:
    """Complex numbers e^{-iq} of angles q [rad]."""
    found = np.empty(q.shape, dtype=complex)
    found.real, found.imag = np.cos(q), -np.sin(q)
    return found
