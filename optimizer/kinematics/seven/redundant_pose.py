"""One pose of an arm of the form `SphericalShoulder`: its configurations over the last angle, and
where there are any.

A `sheet` is one of the eight branches: the signs (shoulder, elbow, wrist), 1 or -1, of the angle χ
between the third axis and the first, of θ and of ψ. The module's text of `spherical_shoulder` has
the formulas.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import acos, atan2, hypot, remainder, tau

import numpy as np

from joulepath.models.robot import Array, Limits
from joulepath.optimizer.kinematics.angles import wrapped
from joulepath.optimizer.kinematics.seven.spherical_shoulder import SphericalShoulder, wave_parts
from joulepath.optimizer.kinematics.seven.spinors import Complex, unitary

# zeros of the polynomial this near the unit circle may be angles; nearer to each other than APART
# [rad] they are one
NEAR_CIRCLE, APART = 1e-4, 1e-9
# coefficients of less than this share of the greatest are rounding
NEGLIGIBLE = 1e-14
# a squared sine counts as zero from this below [1]: cosines are clipped to 1
ROUNDING = 1e-12
# rounding of an angle on a limit [rad]
ANGLE = 1e-9
# a squared sine is zero at an edge to this: an angle where it has a double zero is found to some
# 1e-8 rad
ZERO = 1e-7
# a squared distance [m²] that is none
TINY = 1e-12

# a real polynomial in exp(iq) and exp(-iq), by its coefficients of the powers of exp(iq) from 0 on:
# those of exp(-iq) are their conjugates. Plain numbers: several times as fast as arrays of so few
Polynomial = list[complex]
ONE: Polynomial = [1 + 0j]


@dataclass(frozen=True, eq=False)
class RedundantPose:
    """The flange of an arm of this form at T (4, 4)."""

    form: SphericalShoulder
    T: Array

    @cached_property
    def orientation(self) -> Array:
        """Rotation (3, 3) of the last link."""
        return self.form.last_link(self.T)[:3, :3]

    @cached_property
    def shoulder(self) -> Array:
        """S (3,) in the frame of the last link."""
        return self.form.shoulder_in_7(self.T)

    def from_wrist(self, q7: Array) -> Array:
        """v (3, n) [m] at q7 (n,) [rad]."""
        return np.asarray(self._wrist_waves @ angle_waves(np.cos(q7), np.sin(q7)))

    @cached_property
    def _wrist_waves(self) -> Array:
        """Coefficients (3, 3) [m] of 1, cos q7 and sin q7 in v, as columns."""
        x, y, z = self.shoulder.tolist()
        P = self.form.placements[6]
        waves = np.empty((3, 3))
        waves[:, 0] = P[:3, 3] + P[:3, 2] * z
        waves[2, 0] -= self.form.sixth
        waves[:, 1], waves[:, 2] = P[:3, 0] * x + P[:3, 1] * y, P[:3, 1] * x - P[:3, 0] * y
        return waves

    @cached_property
    def waves(self) -> Array:
        """Coefficients (2, 3) of 1, cos q7 and sin q7 in |v|² [m²] and in v_z [m]."""
        v = self._wrist_waves
        # the parts of cos and sin are at right angles, and as long as each other
        square = v[:, 0] @ v
        waves = np.array([2 * square, v[2]])
        waves[0, 0] = square[0] + v[:, 1] @ v[:, 1]
        return waves

    @cached_property
    def range_waves(self) -> tuple[Array, Array, Array]:
        """`wave_parts` of |v|² and v_z, and of v_x and v_y."""
        return wave_parts(self.waves, self._wrist_waves[:2])

    def angles(self, q7: Array, elbow: Array, wrist: Array) -> tuple[Array, Array]:
        """θ and ψ (n,) [rad] at q7 (n,) on sheets of these signs (n,); cosines beyond 1 count as
        1."""
        theta, psi, _ = self._angles_of(angle_waves(np.cos(q7), np.sin(q7)), elbow, wrist)
        return theta, psi

    def _angles_of(self, seventh: Array, elbow: Array, wrist: Array) -> tuple[Array, Array, Array]:
        """`angles` by the waves (3, n) of q7, and the waves (3, n) of θ."""
        form, (distance, v_z) = self.form, self.waves @ seventh
        cos = to_cosine((form.squares - distance) / (2 * form.rho * form.nu))
        fourth = angle_waves(cos, elbow * np.sqrt((1 - cos) * (1 + cos)))
        along = form.along_fifth @ fourth - form.fifth_in_6[2] * v_z
        reach = form.inclined * np.sqrt(np.maximum(distance - v_z * v_z, 0.0))
        across = np.sqrt(np.maximum((reach - along) * (reach + along), 0.0))
        return elbow * np.arccos(cos), wrist * np.arctan2(across, along), fourth

    def configurations(self, q7: Array, sheet: Array) -> Array:
        """Configurations (n, 7) [rad] in [-π, π] at q7 (n,) on sheets (n, 3)."""
        shoulder, elbow, wrist = sheet.T
        seventh = angle_waves(np.cos(q7), np.sin(q7))
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
        """Configurations (n, 7) [rad] with the given angles (n,). On a singularity the first joint
        (0) or the fifth (4) may have any angle (n,): that in `free`."""
        last = self.wrist(q7, theta, psi)
        free = {} if free is None else free
        if 4 in free:
            last[1] = free[4]
        return np.ascontiguousarray(self.completed(last, backwards(last), shoulder, free.get(0)).T)

    def wrist(self, q7: Array, theta: Array, psi: Array) -> Array:
        """The last four joint positions (4, n) [rad] at the given angles (n,)."""
        return self._last(
            q7,
            theta,
            psi,
            angle_waves(np.cos(q7), np.sin(q7)),
            angle_waves(np.cos(theta), np.sin(theta)),
        )

    def _last(self, q7: Array, theta: Array, psi: Array, seventh: Array, fourth: Array) -> Array:
        """`wrist` with the waves (3, n) of q7 and of θ."""
        form, v, S = self.form, self._wrist_waves @ seventh, self.form.shoulder_waves.T @ fourth
        last = np.empty((4, len(q7)))
        last[0], last[3] = form.q4_at_zero - theta, q7
        last[2] = psi - np.arctan2(v[1], v[0]) + form.fifth_azimuth
        # the fifth angle is between the azimuths of S, seen from both sides
        c, s = np.cos(last[2]), np.sin(last[2])
        v[0], v[1] = c * v[0] - s * v[1], s * v[0] + c * v[1]
        x, y = form.placements[5, :2, :3] @ v
        last[1] = np.arctan2(S[1] * x - S[0] * y, S[0] * x + S[1] * y)
        return last

    def completed(
        self, last: Array, back: Complex, shoulder: Array, q1: Array | None = None
    ) -> Array:
        """Joint positions (7, n) [rad] in [-π, π] with the last four (4, n), of which `back` (4, n)
        are the numbers e^{-iq}, and signs of the shoulder (n,)."""
        form, q, spinor = self.form, np.empty((7, len(shoulder))), self._spinors(back)
        size, phase = np.abs(spinor), np.arctan2(spinor.imag, spinor.real)
        # the other shoulder has the third axis lean to the other side; the turns left half of the
        # last angles out
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
        """The third axis in the frame of joint 1 at q1 = 0, x + iy (n,), at angles (n,)."""
        ahead, aside = self._spinors(backwards(self.wrist(q7, theta, psi)))
        return np.asarray(2 * ahead.conj() * aside)

    def _spinors(self, back: Complex) -> Complex:
        """Spinors (2, n), but for factors, of the rotation from joint 1 at q1 = 0 to link 3, with
        e^{-iq} of the last four joints (4, n)."""
        first, *others = self.form.backwards
        spinor = np.ones((2, back.shape[1]), dtype=complex)
        spinor[1] = back[0]
        for turn, each in zip(back[1:], (first, *others), strict=True):
            spinor = each @ spinor
            spinor[1] *= turn
        return np.asarray(self._from_last @ spinor)

    @cached_property
    def _from_last(self) -> Complex:
        """What carries spinors from the last link to joint 1 at q1 = 0."""
        return unitary(self.form.placements[0, :3, :3].T @ self.orientation)

    def elbows(self, limits: Limits | None) -> list[float]:
        """The signs of θ with which the fourth joint may be within the limits."""
        form, square, low, high = self.form, self.waves[0], -np.pi, np.pi
        if limits is not None:
            low, high = float(limits.q_min[3]), float(limits.q_max[3])
        size, scale = float(np.hypot(square[1], square[2])), 2 * form.rho * form.nu
        cosines = [
            (form.squares - float(square[0]) + side * size) / scale + side * ROUNDING
            for side in (1.0, -1.0)
        ]
        least, most = (acos(min(max(each, -1.0), 1.0)) for each in cosines)
        middle, half = (least + most) / 2, (most - least + high - low) / 2
        away = {
            elbow: remainder(form.q4_at_zero - elbow * middle - (low + high) / 2, tau)
            for elbow in (1.0, -1.0)
        }
        return [elbow for elbow, each in away.items() if abs(each) <= half + ANGLE]

    def intervals(self, elbow: float) -> list[tuple[float, float]]:
        """The intervals [rad] of q7, each within a turn, in which both sheets of this elbow are;
        (-π, π) if nothing bounds them. An interval may be one angle."""
        edges = self._edges
        own = self._excesses[0 if elbow > 0 else 1]
        if not len(edges):
            return [(-np.pi, np.pi)] if own[0] >= -ROUNDING else []
        at, between = own[: len(edges)], own[len(edges) :]
        inside = (between >= -ROUNDING).tolist()
        # an edge of the other elbow's sheets is none here
        bounds = np.abs(at) < ZERO
        if all(inside) and not bounds.any():
            return [(-np.pi, np.pi)]
        found = [
            (float(q7), float(q7))
            for k, q7 in enumerate(edges)
            if bounds[k] and not inside[k - 1] | inside[k]
        ]
        # from an edge on, so that no interval starts before the first one
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
        """The excess (2, k) at the edges, then between each and the next, for both elbows; without
        edges, anywhere.

        That is the lesser of sin²θ and of sin²ψ r²/|v|²: negative off the sheets.
        """
        form, edges, q7 = self.form, self._edges, np.zeros(max(2 * len(self._edges), 1))
        if len(edges):
            q7[: len(edges)], q7[len(edges) : -1] = edges, (edges[1:] + edges[:-1]) / 2
            q7[-1] = (edges[0] + 2 * np.pi + edges[-1]) / 2
        distance, v_z = self.waves @ angle_waves(np.cos(q7), np.sin(q7))
        cos = (form.squares - distance) / (2 * form.rho * form.nu)
        clipped = to_cosine(cos)
        k0, kc, ks = form.along_fifth
        aside = ks * np.sqrt((1 - clipped) * (1 + clipped))
        along = k0 + kc * clipped - form.fifth_in_6[2] * v_z + np.array([aside, -aside])
        reach = form.inclined**2 * np.maximum(distance - v_z * v_z, 0.0)
        return np.asarray(
            np.minimum(1 - cos * cos, (reach - along * along) / np.maximum(distance, TINY))
        )

    @cached_property
    def _edges(self) -> Array:
        """Angles (k,) [rad] in [-π, π), sorted, at which a sheet of any sign may end."""
        form, (square, height) = self.form, self.waves.tolist()
        scale = 2 * form.rho * form.nu
        cos = _wave((form.squares - square[0]) / scale, -square[1] / scale, -square[2] / scale)
        v_z, d2 = _wave(*height), _wave(*square)
        k0, kc, ks = form.along_fifth
        flat = _sum((kc, cos), (-float(form.fifth_in_6[2]), v_z), (k0, ONE))
        sin2, flat2 = _sum((1.0, ONE), (-1.0, _product(cos, cos))), _product(flat, flat)
        incline = form.inclined**2
        P = _sum((incline, d2), (-incline, _product(v_z, v_z)), (-1.0, flat2), (-(ks**2), sin2))
        if abs(ks) > ROUNDING:
            P = _sum((1.0, _product(P, P)), (-4 * ks**2, _product(flat2, sin2)))
        found = sorted([*_angles(P), *self._straight()])
        return np.array(
            [each for k, each in enumerate(found) if k == 0 or each - found[k - 1] > APART]
        )

    def _straight(self) -> list[float]:
        """Angles [rad] at which the elbow is stretched or folded, or nearly: |cos θ| = 1."""
        still, ahead, aside = self.waves[0].tolist()
        reach, size, phase = (
            2 * self.form.rho * self.form.nu,
            hypot(ahead, aside),
            atan2(aside, ahead),
        )
        if size <= NEGLIGIBLE * reach:
            return []
        cosines = [(self.form.squares - still + each) / size for each in (reach, -reach)]
        turned = [
            acos(min(max(each, -1.0), 1.0))
            for each in cosines
            if abs(each) < 1 + NEAR_CIRCLE**2 / 2
        ]
        return [remainder(phase + side * each, tau) for side in (1.0, -1.0) for each in turned]


def to_cosine(x: Array) -> Array:
    """x clipped to [-1, 1]: several times as fast as numpy's for few numbers."""
    return np.asarray(np.minimum(np.maximum(x, -1.0), 1.0))


def angle_waves(c: Array, s: Array) -> Array:
    """1, cosine and sine (3, n) of angles (n,), of these two."""
    waves = np.empty((3, len(c)))
    waves[0], waves[1], waves[2] = 1.0, c, s
    return waves


def backwards(q: Array) -> Complex:
    """The numbers e^{-iq} of angles q [rad]."""
    found = np.empty(q.shape, dtype=complex)
    found.real, found.imag = np.cos(q), -np.sin(q)
    return found


def _wave(a: float, b: float, c: float) -> Polynomial:
    """a + b cos q + c sin q."""
    return [complex(a), complex(b, -c) / 2]


def _sum(*terms: tuple[float, Polynomial]) -> Polynomial:
    """The sum of polynomials, each times a factor."""
    total = [0j] * max(len(each) for _, each in terms)
    for factor, each in terms:
        for k, coefficient in enumerate(each):
            total[k] += factor * coefficient
    return total


def _product(p: Polynomial, r: Polynomial) -> Polynomial:
    """The product of two polynomials."""
    total = [0j] * (len(p) + len(r) - 1)
    for k, a in enumerate(p):
        for j, b in enumerate(r):
            total[k + j] += a * b
            # that with the other power of opposite sign; of both, the one that is not negative
            if k and j:
                other = a * b.conjugate() if k >= j else a.conjugate() * b
                total[abs(k - j)] += other if k != j else 2 * other.real
    return total


def _angles(polynomial: Polynomial) -> list[float]:
    """The angles q [rad] at which a polynomial is zero, or nearly."""
    size = [abs(each) for each in polynomial]
    least, degree = NEGLIGIBLE * max(size), len(size) - 1
    while degree and size[degree] <= least:
        degree -= 1
    if not degree:
        return []
    # by falling powers; the eigenvalues of the companion are the zeros
    falling = [*polynomial[degree:0:-1], *(each.conjugate() for each in polynomial[: degree + 1])]
    companion = np.eye(2 * degree, k=-1, dtype=complex)
    companion[0] = [-each / falling[0] for each in falling[1:]]
    return [
        atan2(root.imag, root.real)
        for root in np.linalg.eigvals(companion).tolist()
        if abs(abs(root) - 1) < NEAR_CIRCLE
    ]
