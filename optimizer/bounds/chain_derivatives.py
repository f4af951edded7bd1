"""Gravity torques and joint-space inertia of many configurations, with bounds on their derivatives.

The bounds hold for every configuration. Let z_j be the axis and o_j the origin of joint j, m_i the
mass and c_i the centre of mass of link i, and S_j = Σ_{i≥j} m_i (c_i - o_j).

**Potential energy.** Its derivative by joints k_1 ≤ … ≤ k_n is -g · (z_k1 × (… (z_kn × S_kn))): a
joint turns everything beyond it, so that derivatives act from the last joint inwards. Its absolute
value is at most |g × z_k1| · |S_kn|, where |S_kn| ≤ Σ_{i≥kn} m_i · (lengths from o_kn to c_i). |g ×
z_k1| is at most |g|, and known for the first joint, whose axis does not move.

**Inertia.** M_jk = Σ_i (m_i J_ij · J_ik + z_j · I_i z_k) with J_ij = z_j × (c_i - o_j). By the same
rule, a derivative of J_ij is at most ρ_i of the last of its joints, with ρ_i(k) ≥ |c_i - o_k|. z_j
· I_i z_k contains the rotation of a joint at most twice, and the derivatives of a rotation of any
order have the norm 1: n derivatives are at most 2^n times the greatest principal moment. M_jk does
not depend on the joints up to the first of j and k, because they turn the remaining chain as a
whole. The bounds of `inertia_spectrum` are mostly lower.
"""

from __future__ import annotations

import ctypes
import threading
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from cachetools import LRUCache, cached

from joulepath.models.robot import Array
from joulepath.optimizer.bounds.inertia_spectrum import InertiaSpectrum
from joulepath.optimizer.kinematics.forward import joint_placements, link_frames
from joulepath.optimizer.kinematics.rigid_body_model import rigid_body_model
from joulepath.optimizer.kinematics.vectors import cross
from joulepath.optimizer.native.shared_library import address, library
from joulepath.optimizer.problem.arm import Arm


@dataclass(frozen=True)
class CacheSettings:
    """Sizes of the caches of bounds, which take as long to compute as a request."""

    spectra: int = 8
    """Number of chains whose inertia spectrum is kept."""
    bounds: int = 32
    """Number of bounds kept, of all chains and orders of derivatives."""


CACHES = CacheSettings()
_ARRAYS = ("placements", "mass", "lever", "inertia", "rotor", "gravity")
"""Fields of the struct `Chain` of the C library, in its order."""


class _Chain(ctypes.Structure):
    """The struct `Chain` of the C library."""

    _fields_ = [("nq", ctypes.c_long)] + [(name, ctypes.c_void_p) for name in _ARRAYS]


def _digest(chain: ChainDerivatives) -> bytes:
    """Key of the inertia of a chain."""
    return b"".join(
        each.tobytes() for each in (chain.placements, chain.mass, chain.lever, chain.inertia)
    )


def _by_order(chain: ChainDerivatives, order: int) -> tuple[int, bytes]:
    """Key of a bound on derivatives."""
    return order, _digest(chain) + chain.gravity.tobytes()


@dataclass(frozen=True)
class ChainDerivatives:
    """A serial chain with payload under gravity."""

    placements: Array
    """Joints in the frames of the joints before them, shape (nq, 4, 4)."""
    mass: Array
    """Masses of the links, shape (nq,) [kg]."""
    lever: Array
    """Centres of mass in the joint frames, shape (nq, 3) [m]."""
    inertia: Array
    """Inertias about the centres of mass, shape (nq, 3, 3) [kg·m²]."""
    rotor: Array
    """Rotor inertias, shape (nq,) [kg·m²]."""
    gravity: Array
    """Gravity in the base frame, shape (3,) [m/s²]."""

    @classmethod
    def of(cls, arm: Arm) -> ChainDerivatives:
        """The chain of an arm."""
        model = rigid_body_model(arm)
        bodies = [model.inertias[i] for i in range(1, model.njoints)]
        return cls(
            joint_placements(model),
            np.array([body.mass for body in bodies]),
            np.array([body.lever for body in bodies]),
            np.array([body.inertia for body in bodies]),
            arm.drives.rotor_inertia,
            np.asarray(arm.gravity),
        )

    @cached_property
    def as_c(self) -> tuple[ctypes.Structure, list[Array]]:
        """The chain as a struct of the C library, and the arrays that it points to."""
        arrays = [np.ascontiguousarray(getattr(self, name), dtype=float) for name in _ARRAYS]
        return _Chain(self.nq, *map(address, arrays)), arrays

    @property
    def nq(self) -> int:
        """Number of joints."""
        return len(self.mass)

    @cached_property
    def _reach(self) -> Array:
        """Greatest distance of the centre of mass of link i from the origin of joint j ≤ i, (nq,
        nq) [m].
        """
        lengths = np.append(np.linalg.norm(self.placements[1:, :3, 3], axis=1), 0.0)
        reach = np.zeros((self.nq, self.nq))
        for i, j in product(range(self.nq), repeat=2):
            if j <= i:
                reach[i, j] = np.linalg.norm(self.lever[i]) + lengths[j:i].sum()
        return reach

    @cached(LRUCache(CACHES.bounds), key=_by_order, lock=threading.Lock())
    def potential_bound(self, order: int) -> Array:
        """Bounds on derivatives of the potential energy by `order` joints, (nq,) * order [J]."""
        moments = np.array([self.mass[j:] @ self._reach[j:, j] for j in range(self.nq)])
        leading = np.full(self.nq, np.linalg.norm(self.gravity))
        leading[0] = np.linalg.norm(np.cross(self.gravity, self.placements[0, :3, 2]))
        joints = np.indices((self.nq,) * order)
        return _shared(leading[joints.min(axis=0)] * moments[joints.max(axis=0)])

    @cached(LRUCache(CACHES.bounds), key=_by_order, lock=threading.Lock())
    def inertia_bound(self, order: int) -> Array:
        """Bounds on derivatives of M_jk by `order` ≥ 1 joints, (nq,) * order + (nq, nq) [kg·m²]."""
        joints = np.indices((self.nq,) * (order + 2))
        by, j, k = joints[:order], joints[order], joints[order + 1]
        changes = by.min(axis=0) > np.minimum(j, k)
        last = np.maximum(by.max(axis=0), np.maximum(j, k))
        principal = np.linalg.eigvalsh(self.inertia)[:, -1]
        bound = np.zeros(j.shape)
        for i in range(self.nq):
            products = np.zeros(j.shape)
            for acts_on_second in product((False, True), repeat=order):
                first, second = j, k
                for joint, on_second in zip(by, acts_on_second, strict=True):
                    if on_second:
                        second = np.maximum(second, joint)
                    else:
                        first = np.maximum(first, joint)
                products += self._reach[i][first] * self._reach[i][second]
            own = self.mass[i] * products + 2.0**order * principal[i]
            bound += np.where(changes & (last <= i), own, 0.0)
        return _shared(
            bound if self._spectrum is None else np.minimum(bound, self._spectrum.bound(order))
        )

    @cached_property
    def _spectrum(self) -> InertiaSpectrum | None:
        return _spectrum_of(self)

    def gravity_torque(self, q: Array) -> tuple[Array, Array]:
        """Gravity torques and their gradients at configurations q (n, nq) [rad].

        Returns:
            ∂U/∂q_j (n, nq) [N·m] and ∂²U/∂q_j∂q_k (n, nq, nq) [N·m/rad].
        """
        z, levers = self._levers(q)
        across = cross(np.broadcast_to(self.gravity, z.shape), z)
        return -levers @ self.gravity, _symmetric(-across @ levers.transpose(0, 2, 1))

    def gravity_curvature(self, q: Array) -> Array:
        """|g| |z_k × S_k| at configurations q (n, nq) [rad], shape (n, nq) [N·m].

        Whatever the joints up to k are, ∂³U / ∂q_j² ∂q_l is at most this for k = max(j, l).
        """
        levers = self._levers(q)[1]
        return np.asarray(np.linalg.norm(self.gravity) * np.linalg.norm(levers, axis=-1))

    def _levers(self, q: Array) -> tuple[Array, Array]:
        """Axes z_j, and z_j × S_j, at configurations q (n, nq) [rad], shape (n, nq, 3) each."""
        z, o, _, c = self._frames(q)
        outer = np.cumsum(self.mass[::-1])[::-1]
        moments = _outward_sums(self.mass[:, None] * c) - outer[:, None] * o
        return z, cross(z, moments)

    def joint_inertia(self, q: Array) -> Array:
        """Joint-space inertia M at configurations q (n, nq) [rad], with rotors, (n, nq, nq)
        [kg·m²].
        """
        q, M = np.ascontiguousarray(q, dtype=float), np.empty((len(q), self.nq, self.nq))
        library.joint_inertias(ctypes.addressof(self.as_c[0]), len(q), address(q), address(M))
        return M

    def _frames(self, q: Array) -> tuple[Array, Array, Array, Array]:
        """Frames of the joints at configurations q (n, nq) [rad].

        Returns:
            Axes and origins (n, nq, 3), rotations (n, nq, 3, 3), and centres of mass (n, nq, 3).
        """
        frames = link_frames(self.placements, q)[:, 1:]
        rotations = frames[..., :3, :3]
        centres = frames[..., :3, 3] + (rotations @ self.lever[:, :, None])[..., 0]
        return (
            np.ascontiguousarray(rotations[..., 2]),
            np.ascontiguousarray(frames[..., :3, 3]),
            rotations,
            centres,
        )


@cached(LRUCache(CACHES.spectra), key=_digest, lock=threading.Lock())
def _spectrum_of(chain: ChainDerivatives) -> InertiaSpectrum | None:
    """The inertia spectrum of a chain, cached."""
    return InertiaSpectrum.of(chain.joint_inertia, chain.nq)


def _shared(bound: Array) -> Array:
    """The array, made read-only because it is cached."""
    bound.flags.writeable = False
    return bound


def _outward_sums(each: Array) -> Array:
    """Sums over a link and all links beyond it, along axis 1."""
    return np.cumsum(each[:, ::-1], axis=1)[:, ::-1]


def _symmetric(upper: Array) -> Array:
    """Symmetric matrices (n, k, k) with given upper triangles."""
    return np.asarray(np.triu(upper) + np.triu(upper, 1).transpose(0, 2, 1))
