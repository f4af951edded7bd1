"""Closed form of seven-joint arms with a spherical shoulder.

The first three axes meet in one point, the shoulder S, at right angles; the fifth and sixth axes
meet in another point, the wrist W. Franka's arms, KUKA's LBR iiwa and UFACTORY's xArm 7 are of this
form. With a given last angle, six joints remain, and a pose has at most eight configurations:

- Seen from link 6, S is at v(q7) from W: it turns about the last axis. Its distance from W depends
  on the fourth angle alone: |v|² = E - 2 ρ ν cos θ with θ = const - q4. The two signs of θ are the
  two parts of the `elbow`.
- Along the fifth axis, S is at c(θ) from W. The fifth axis turns about the sixth, at an angle with
  the cosine e: r cos ψ = (c - e v_z) / sqrt(1 - e²), with ψ = q6 + const + the azimuth of v, and r
  the distance of S from the sixth axis. The two signs of ψ are the two parts of the `wrist`.
- The azimuth of S about the fifth axis gives q5. The rest of the orientation gives the first three
  angles, in two ways: with the second angle on either side of the singularity of the `shoulder`.

So a pose is reached on curves over q7, one for each of the eight branches and each interval with
both cosines at most 1 (`intervals`). The intervals are exact: no curve is missed. |v|² and v_z are
sinusoids f(q7) = a + b cos q7 + c sin q7, and so is cos θ; sin²θ and sin²ψ, times r², are
trigonometric polynomials except for the sign of sin θ. Their zeros are zeros of a polynomial of
degree 8. The idea of locking q7 for Franka's arms is due to Y. He and S. Liu, "Analytical inverse
kinematics for Franka Emika Panda" (2021); here it covers the whole family, and all of q7.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.seven.spinors import Complex, unitary


@dataclass(frozen=True)
class ShoulderSettings:
    """Tolerances of the form."""

    equal: float = 1e-9
    """Largest distance of axes that meet [m], and largest cosine of perpendicular axes."""
    aligned: float = 1e-12
    """Largest distance of the shoulder from the fifth axis on which it lies [m]."""
    aligned_starts: int = 8
    """Number of start angles in the search for alignment."""
    aligned_steps: int = 20
    """Newton steps of this search."""
    widening: float = 1e-14
    """Margin of the ranges of sinusoids, for rounding [m² or m]."""


SETTINGS = ShoulderSettings()


@dataclass(frozen=True, eq=False)
class SphericalShoulder:
    """Lengths and angles of one arm of this form.

    `placements` (7, 4, 4) are the poses of the joints, each in the frame of the previous link.
    `shoulder` (3,) [m] is S in the base frame. `upper`, `fifth` and `sixth` [m] are the positions
    of S on the third axis, and of W on the fifth and the sixth axis.
    """

    placements: Array
    T_last_flange: Array
    shoulder: Array
    upper: float
    fifth: float
    sixth: float

    @classmethod
    def of(cls, model: pin.Model) -> SphericalShoulder | None:
        """Form of a Pinocchio model with a frame `flange`; None if its axes do not meet in this
        way.
        """
        return cls.of_chain(Chain.of(model)) if model.nq == model.nv == 7 else None

    @classmethod
    def of_chain(cls, chain: Chain) -> SphericalShoulder | None:
        """Form of a chain of seven joints; None if its axes do not meet in this way."""
        P = chain.placements
        first, second, third = (_meeting(P[k]) for k in (1, 2, 5))
        square = max(abs(P[1][2, 2]), abs(P[2][2, 2]))
        if (
            first is None
            or second is None
            or third is None
            or square > SETTINGS.equal
            or abs(first[1] - second[0]) > SETTINGS.equal
        ):
            return None
        shoulder = P[0] @ [0.0, 0.0, first[0], 1.0]
        form = cls(P, chain.T_last_flange, shoulder[:3], second[1], third[0], third[1])
        return form if min(form.rho * form.nu, form.inclined) > SETTINGS.equal else None

    @cached_property
    def backwards(self) -> tuple[Complex, Complex, Complex]:
        """Matrices that carry the spinor of the rotation from a link to link 3 to the previous
        link.

        They lead to links 5, 6 and 7, each from behind the turn of the joint between. The first one
        applies to (1, e^{-iq4}) and includes the rotation from link 3 to joint 4.
        """
        third, *others = (unitary(each).conj().T for each in self.placements[3:, :3, :3])
        return others[0] * third[:, 0], others[1], others[2]

    @cached_property
    def _wrist_in_4(self) -> Array:
        """Position (3,) [m] of W in the frame of link 4."""
        return np.asarray(self.placements[4][:3, 3] + self.fifth * self.placements[4][:3, 2])

    @cached_property
    def _shoulder_in_3(self) -> Array:
        """Position (3,) [m] of S in the frame of joint 4 at q4 = 0."""
        P = self.placements[3]
        return np.asarray(P[:3, :3].T @ ([0.0, 0.0, self.upper] - P[:3, 3]))

    @cached_property
    def rho(self) -> float:
        """Distance ρ [m] of S from the fourth axis."""
        return float(np.hypot(*self._shoulder_in_3[:2]))

    @cached_property
    def nu(self) -> float:
        """Distance ν [m] of W from the fourth axis."""
        return float(np.hypot(*self._wrist_in_4[:2]))

    @cached_property
    def q4_at_zero(self) -> float:
        """Fourth angle [rad] at θ = 0, with S and W nearest to each other."""
        m, n = self._shoulder_in_3, self._wrist_in_4
        return float(np.arctan2(m[1], m[0]) - np.arctan2(n[1], n[0]))

    @cached_property
    def squares(self) -> float:
        """Constant E [m²] of |v|²."""
        along = self._shoulder_in_3[2] - self._wrist_in_4[2]
        return float(self.rho**2 + self.nu**2 + along**2)

    @cached_property
    def along_fifth(self) -> tuple[float, float, float]:
        """Coefficients k0, kc, ks [m] of c(θ) = k0 + kc cos θ + ks sin θ."""
        axis, m, n = self.placements[4][:3, 2], self._shoulder_in_3, self._wrist_in_4
        turned = np.arctan2(n[1], n[0])
        cos, sin = np.cos(turned), np.sin(turned)
        return (
            float(axis[2] * m[2] - axis @ n),
            float(self.rho * (axis[0] * cos + axis[1] * sin)),
            float(self.rho * (axis[1] * cos - axis[0] * sin)),
        )

    @cached_property
    def fifth_in_6(self) -> Array:
        """Direction (3,) of the fifth axis in the frame of link 6 at q6 = 0."""
        return np.asarray(self.placements[5][2, :3])

    @cached_property
    def range_harmonics(self) -> tuple[Array, Array, Array]:
        """`harmonic_parts` of c, and of the components x and y of S."""
        return harmonic_parts(np.array([self.along_fifth]), self.shoulder_harmonics.T[:2])

    @cached_property
    def inclined(self) -> float:
        """Sine of the angle between the fifth and the sixth axis."""
        return float(np.hypot(*self.fifth_in_6[:2]))

    def shoulder_in_7(self, T: Array) -> Array:
        """Position (3,) [m] of S in the frame of the last link with the flange at T (4, 4)."""
        T7 = self.last_link(T)
        return np.asarray(T7[:3, :3].T @ (self.shoulder - T7[:3, 3]))

    def last_link(self, T: Array) -> Array:
        """Pose (4, 4) of the last link with the flange at T (4, 4)."""
        R, p = self.T_last_flange[:3, :3], self.T_last_flange[:3, 3]
        T7 = np.eye(4)
        T7[:3, :3] = T[:3, :3] @ R.T
        T7[:3, 3] = T[:3, 3] - T7[:3, :3] @ p
        return T7

    @cached_property
    def lean_at_zero(self) -> float:
        """Angle χ [rad] of the third axis from the first, at a second angle of zero."""
        first, third = self.placements[1][2], self.placements[2][:, 2]
        return float(np.arctan2(third[1], third[0]) - np.arctan2(first[1], first[0]))

    @cached_property
    def lean_azimuth(self) -> float:
        """Azimuth [rad], in the frame of link 1, of the direction that the third axis leans to for
        χ > 0.
        """
        first = self.placements[1][2]
        lean = self.placements[1][:3, :3] @ [-first[1], first[0], 0.0]
        return float(np.arctan2(lean[1], lean[0]))

    @cached_property
    def twist(self) -> float:
        """Angle ψ [rad] at a third angle of zero, in R_z(φ) R_y(χ) R_z(ψ) for the rotation from
        joint 1 to link 3, with the azimuth φ of the lean.
        """
        R = self.placements[1, :3, :3] @ self.placements[2, :3, :3]
        # Image of x before the turn by ψ, seen from link 3.
        azimuth, chi = self.lean_azimuth, self.lean_at_zero
        ahead = R.T @ [np.cos(chi) * np.cos(azimuth), np.cos(chi) * np.sin(azimuth), -np.sin(chi)]
        return -float(np.arctan2(ahead[1], ahead[0]))

    def lean(self, q2: Array) -> Array:
        """Angle χ (n,) [rad] at the second angle q2 (n,) [rad]."""
        return np.asarray(q2 + self.lean_at_zero)

    @cached_property
    def fifth_azimuth(self) -> float:
        """Azimuth [rad] of the fifth axis in the frame of link 6 at q6 = 0."""
        return float(np.arctan2(self.fifth_in_6[1], self.fifth_in_6[0]))

    @cached_property
    def sixth_azimuth(self) -> float:
        """Azimuth [rad] of the sixth axis in the frame of link 5."""
        return float(np.arctan2(self.placements[5][1, 2], self.placements[5][0, 2]))

    @cached_property
    def aligned(self) -> tuple[float, ...]:
        """Angles θ [rad] with the shoulder on the fifth axis, as in a stretched or folded arm
        without offsets.
        """
        found: list[float] = []
        for theta in np.linspace(-np.pi, np.pi, SETTINGS.aligned_starts, endpoint=False):
            for _ in range(SETTINGS.aligned_steps):
                across, ahead = self.shoulder_about_fifth(np.array([theta, theta + np.pi / 2]))[
                    :, :2
                ]
                # A turn by a right angle gives the derivative, except for the constant part.
                slope = ahead - self.shoulder_about_fifth(np.array([theta - np.pi / 2]))[0, :2]
                theta -= 2 * float(across @ slope) / max(float(slope @ slope), SETTINGS.equal)
            away = np.abs(np.angle(np.exp(1j * (np.array(found) - theta))))
            if float(np.hypot(*across)) < SETTINGS.aligned and away.min(initial=np.inf) > np.sqrt(
                SETTINGS.aligned
            ):
                found.append(float(theta))
        return tuple(found)

    def shoulder_about_fifth(self, theta: Array) -> Array:
        """Position S (n, 3) [m] relative to W, in the frame of joint 5 at q5 = 0, at θ (n,)
        [rad].
        """
        still, cosine, sine = self.shoulder_harmonics
        return np.asarray(still + np.cos(theta)[:, None] * cosine + np.sin(theta)[:, None] * sine)

    @cached_property
    def shoulder_harmonics(self) -> Array:
        """Coefficients (3, 3) [m] of 1, cos θ and sin θ in `shoulder_about_fifth`."""
        n = self._wrist_in_4
        towards = np.arctan2(n[1], n[0])
        c, s = self.rho * np.cos(towards), self.rho * np.sin(towards)
        coefficients = np.array(
            [[-n[0], -n[1], self._shoulder_in_3[2] - n[2]], [c, s, 0.0], [-s, c, 0.0]]
        )
        return np.asarray(coefficients @ self.placements[4][:3, :3])


def harmonic_parts(coefficients: Array, others: Array) -> tuple[Array, Array, Array]:
    """Arrays that bound sinusoids a + b cos x + c sin x over intervals.

    Args:
        coefficients: coefficients (m, 3) of the bounded sinusoids.
        others: coefficients (k, 3) of sinusoids to evaluate only.

    Returns:
        Means (m, 2, 1), negative and positive, widened for rounding; amplitudes |(b, c)| (m, 1, 1);
        and coefficients (3m + k, 3). With a sinusoid written as a + size cos y, the coefficients
        are those of -size cos y and size cos y, sinusoid by sinusoid, then those of size sin y,
        then `others`.
    """
    m = len(coefficients)
    parts = np.zeros((3 * m + len(others), 3))
    parts[1 : 2 * m : 2, 1:] = coefficients[:, 1:]
    parts[: 2 * m : 2, 1:] = -coefficients[:, 1:]
    parts[2 * m : 3 * m, 1], parts[2 * m : 3 * m, 2] = -coefficients[:, 2], coefficients[:, 1]
    parts[3 * m :] = others
    mean = coefficients[:, 0, None] * (-1.0, 1.0) + SETTINGS.widening
    return mean[:, :, None], np.hypot(coefficients[:, 1], coefficients[:, 2])[:, None, None], parts


def _meeting(P: Array) -> tuple[float, float] | None:
    """Positions [m] of the meeting point of two successive joint axes, on the first and on the
    second axis.

    Args:
        P: pose (4, 4) of the second joint in the frame of the first link.

    Returns:
        The two positions; None if the axes do not meet.
    """
    p, z = P[:3, 3], P[:3, 2]
    across = float(np.hypot(z[0], z[1]))
    if across < SETTINGS.equal:
        return None
    second = -float(p[:2] @ z[:2]) / across**2
    point = p + second * z
    return (float(point[2]), second) if float(np.hypot(*point[:2])) < SETTINGS.equal else None
