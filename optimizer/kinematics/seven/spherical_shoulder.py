"""Closed form of arms of seven joints whose first three axes meet in one point, the shoulder S, at
right angles, and whose fifth and sixth axes meet in another, the wrist W.

Franka's arms are of this form, KUKA's LBR iiwa and UFACTORY's xArm 7, too. With the last angle
given, six joints are left, and the pose leaves them eight configurations at most:

- Seen from link 6, S is at v(q7) from W: it turns about the last axis. Its distance from W depends
  on the fourth angle
  alone: |v|² = E - 2 ρ ν cos θ with θ = const - q4. The two signs of θ are the two parts of the
      `elbow`.
- Along the fifth axis, S is at c(θ) from W. This axis turns about the sixth, which it makes an
  angle with whose cosine
  is e: r cos ψ = (c - e v_z) / sqrt(1 - e²), with ψ = q6 + const + the azimuth of v, and r its
  distance from the sixth
  axis. The two signs of ψ are the two parts of the `wrist`.
- The azimuth of S about the fifth axis gives q5; what is left of the orientation gives the first
  three angles, in two
  ways: with the second angle on either side of the singularity of the `shoulder`.

So a pose is reached on curves over q7, one for each of the eight branches and for each interval in
which the cosines are at most 1 (`intervals`). These are exact: no curve is missed. With f(q7) = a +
b cos q7 + c sin q7 for |v|² and v_z, cos θ is of this kind, and sin²θ and sin²ψ, times r², are
trigonometric polynomials but for the sign of sin θ; their zeros are those of a polynomial of degree
8. The idea of locking q7 for Franka's arms is that of Y. He and S. Liu, "Analytical inverse
kinematics for Franka Emika Panda" (2021); here for the whole family, and over all of q7.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pinocchio as pin

from joulepath.models.robot import Array
from joulepath.optimizer.kinematics.chain import Chain
from joulepath.optimizer.kinematics.seven.spinors import Complex, unitary

# greatest distance [m] of axes that meet, and cosine of axes at right angles
EQUAL = 1e-9
# distance [m] from the fifth axis at which the shoulder is on it; angles from which it is sought
# there, and steps
ALIGNED, ALIGNED_STARTS, ALIGNED_STEPS = 1e-12, 8, 20
# what ranges of waves are widened by, for rounding [m² or m]
WIDENED = 1e-14


@dataclass(frozen=True, eq=False)
class SphericalShoulder:
    """The lengths and angles of the module's text, of one arm.

    `placements` (7, 4, 4): each joint in the frame of the link before. `shoulder` (3,): S in the
    base frame. `upper`, `fifth`, `sixth` [m]: where S lies on the third axis, W on the fifth and on
    the sixth.
    """

    placements: Array
    T_last_flange: Array
    shoulder: Array
    upper: float
    fifth: float
    sixth: float

    @classmethod
    def of(cls, model: pin.Model) -> SphericalShoulder | None:
        """The form of a Pinocchio model with a frame `flange`; None if its axes do not meet in this
        way.
        """
        return cls.of_chain(Chain.of(model)) if model.nq == model.nv == 7 else None

    @classmethod
    def of_chain(cls, chain: Chain) -> SphericalShoulder | None:
        """The form of a chain of seven joints; None if its axes do not meet in this way."""
        P = chain.placements
        first, second, third = (_meeting(P[k]) for k in (1, 2, 5))
        square = max(abs(P[1][2, 2]), abs(P[2][2, 2]))
        if (
            first is None
            or second is None
            or third is None
            or square > EQUAL
            or abs(first[1] - second[0]) > EQUAL
        ):
            return None
        shoulder = P[0] @ [0.0, 0.0, first[0], 1.0]
        form = cls(P, chain.T_last_flange, shoulder[:3], second[1], third[0], third[1])
        return form if min(form.rho * form.nu, form.inclined) > EQUAL else None

    @cached_property
    def backwards(self) -> tuple[Complex, Complex, Complex]:
        """What carries spinors of the rotation from a link to link 3 to the link before: to links
        5, 6 and 7, each from behind the turn of the joint between. The first one is for (1,
        e^{-iq4}), with the way from link 3 to joint 4.
        """
        third, *others = (unitary(each).conj().T for each in self.placements[3:, :3, :3])
        return others[0] * third[:, 0], others[1], others[2]

    @cached_property
    def _wrist_in_4(self) -> Array:
        """W in the frame of link 4."""
        return np.asarray(self.placements[4][:3, 3] + self.fifth * self.placements[4][:3, 2])

    @cached_property
    def _shoulder_in_3(self) -> Array:
        """S in the frame of joint 4 at q4 = 0."""
        P = self.placements[3]
        return np.asarray(P[:3, :3].T @ ([0.0, 0.0, self.upper] - P[:3, 3]))

    @cached_property
    def rho(self) -> float:
        """Distance [m] of S from the fourth axis."""
        return float(np.hypot(*self._shoulder_in_3[:2]))

    @cached_property
    def nu(self) -> float:
        """Distance [m] of W from the fourth axis."""
        return float(np.hypot(*self._wrist_in_4[:2]))

    @cached_property
    def q4_at_zero(self) -> float:
        """The fourth angle [rad] at θ = 0, where S and W are nearest."""
        m, n = self._shoulder_in_3, self._wrist_in_4
        return float(np.arctan2(m[1], m[0]) - np.arctan2(n[1], n[0]))

    @cached_property
    def squares(self) -> float:
        """E [m²]."""
        along = self._shoulder_in_3[2] - self._wrist_in_4[2]
        return float(self.rho**2 + self.nu**2 + along**2)

    @cached_property
    def along_fifth(self) -> tuple[float, float, float]:
        """k0, kc, ks [m] of c(θ) = k0 + kc cos θ + ks sin θ."""
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
    def range_waves(self) -> tuple[Array, Array, Array]:
        """`wave_parts` of c, and of x and y of S."""
        return wave_parts(np.array([self.along_fifth]), self.shoulder_waves.T[:2])

    @cached_property
    def inclined(self) -> float:
        """Sine of the angle between the fifth and the sixth axis."""
        return float(np.hypot(*self.fifth_in_6[:2]))

    def shoulder_in_7(self, T: Array) -> Array:
        """S (3,) in the frame of the last link with the flange at T (4, 4)."""
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
        """χ [rad], the angle of the third axis from the first, at a second angle of zero."""
        first, third = self.placements[1][2], self.placements[2][:, 2]
        return float(np.arctan2(third[1], third[0]) - np.arctan2(first[1], first[0]))

    @cached_property
    def lean_azimuth(self) -> float:
        """Azimuth [rad], in the frame of link 1, of the direction that the third axis leans towards
        if χ > 0.
        """
        first = self.placements[1][2]
        lean = self.placements[1][:3, :3] @ [-first[1], first[0], 0.0]
        return float(np.arctan2(lean[1], lean[0]))

    @cached_property
    def twist(self) -> float:
        """ψ [rad] at a third angle of zero, in R_z(φ) R_y(χ) R_z(ψ) for the rotation from joint 1
        to link 3, with φ the azimuth of the lean."""
        R = self.placements[1, :3, :3] @ self.placements[2, :3, :3]
        # the image of x before the turn by ψ, seen from link 3
        azimuth, chi = self.lean_azimuth, self.lean_at_zero
        ahead = R.T @ [np.cos(chi) * np.cos(azimuth), np.cos(chi) * np.sin(azimuth), -np.sin(chi)]
        return -float(np.arctan2(ahead[1], ahead[0]))

    def lean(self, q2: Array) -> Array:
        """χ (n,) [rad] at the second angle q2 (n,)."""
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
        """The angles θ [rad] at which the fifth axis meets the shoulder, as it does where an arm
        without offsets is stretched or folded."""
        found: list[float] = []
        for theta in np.linspace(-np.pi, np.pi, ALIGNED_STARTS, endpoint=False):
            for _ in range(ALIGNED_STEPS):
                across, ahead = self.shoulder_about_fifth(np.array([theta, theta + np.pi / 2]))[
                    :, :2
                ]
                # a turn by a right angle gives the derivative, but for what does not turn
                slope = ahead - self.shoulder_about_fifth(np.array([theta - np.pi / 2]))[0, :2]
                theta -= 2 * float(across @ slope) / max(float(slope @ slope), EQUAL)
            away = np.abs(np.angle(np.exp(1j * (np.array(found) - theta))))
            if float(np.hypot(*across)) < ALIGNED and away.min(initial=np.inf) > np.sqrt(ALIGNED):
                found.append(float(theta))
        return tuple(found)

    def shoulder_about_fifth(self, theta: Array) -> Array:
        """S (n, 3) [m] from W, in the frame of joint 5 at q5 = 0, at θ (n,) [rad]."""
        still, cosine, sine = self.shoulder_waves
        return np.asarray(still + np.cos(theta)[:, None] * cosine + np.sin(theta)[:, None] * sine)

    @cached_property
    def shoulder_waves(self) -> Array:
        """Coefficients (3, 3) [m] of 1, cos θ and sin θ in `shoulder_about_fifth`."""
        n = self._wrist_in_4
        towards = np.arctan2(n[1], n[0])
        c, s = self.rho * np.cos(towards), self.rho * np.sin(towards)
        waves = np.array([[-n[0], -n[1], self._shoulder_in_3[2] - n[2]], [c, s, 0.0], [-s, c, 0.0]])
        return np.asarray(waves @ self.placements[4][:3, :3])


def wave_parts(waves: Array, others: Array) -> tuple[Array, Array, Array]:
    """What bounds waves a + b cos x + c sin x, (m, 3), with other ones (k, 3).

    Means (m, 2, 1), negative and positive, widened for rounding. Sizes |(b, c)| (m, 1, 1). And
    coefficients (3m + k, 3): where a wave is a + size cos y, those of -size cos y and size cos y,
    wave by wave, then those of size sin y, then those of the others.
    """
    m = len(waves)
    parts = np.zeros((3 * m + len(others), 3))
    parts[1 : 2 * m : 2, 1:] = waves[:, 1:]
    parts[: 2 * m : 2, 1:] = -waves[:, 1:]
    parts[2 * m : 3 * m, 1], parts[2 * m : 3 * m, 2] = -waves[:, 2], waves[:, 1]
    parts[3 * m :] = others
    mean = waves[:, 0, None] * (-1.0, 1.0) + WIDENED
    return mean[:, :, None], np.hypot(waves[:, 1], waves[:, 2])[:, None, None], parts


def _meeting(P: Array) -> tuple[float, float] | None:
    """Where [m] two successive joint axes meet, on the first and on the second of them; None if
    they do not.

    P (4, 4) is the second joint in the frame of the first one's link.
    """
    p, z = P[:3, 3], P[:3, 2]
    across = float(np.hypot(z[0], z[1]))
    if across < EQUAL:
        return None
    second = -float(p[:2] @ z[:2]) / across**2
    point = p + second * z
    return (float(point[2]), second) if float(np.hypot(*point[:2])) < EQUAL else None
