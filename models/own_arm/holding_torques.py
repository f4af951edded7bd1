"""Torques for an arm's own weight and acceleration, compared with the torque limits.

Many URDFs have placeholders for the efforts: 1, 100 or 1000 for all joints. Friction and rotor
inertia follow from the torque limits by `rules`, so a placeholder would invent joules.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from joulepath.models.own_arm.urdf_chain import Chain
from joulepath.models.robot import Array


@dataclass(frozen=True)
class TorqueSettings:
    """Settings of the comparison."""

    samples: int = 512
    """Number of configurations within the joint ranges at which torques are computed."""
    least_share: float = 0.1
    """Least torque that a joint needs, relative to the greatest of all joints: the last joint of a
    wrist bears nearly nothing, and is driven all the same."""
    placeholder: float = 8.0
    """Torque limit over the needed torque above which it is a placeholder; the bundled arms have
    0.4 to 6.3."""
    usual: float = 2.0
    """Usual torque limit over the needed torque, which replaces a placeholder in the rules."""


SETTINGS = TorqueSettings()


@dataclass(frozen=True)
class HoldingTorques:
    """Torques of the joints, every joint at its worst configuration, shape (nq,) [N·m].

    `holding` is that of gravity without a payload, `needed` that of gravity and the acceleration
    limit with the rated payload at the tip.
    """

    holding: Array
    needed: Array

    @staticmethod
    def of(chain: Chain, acceleration: Array, payload: float) -> HoldingTorques:
        """Torques of a chain with an upright root link.

        Args:
            chain: the chain.
            acceleration: acceleration limits (nq,) [rad/s²].
            payload: rated payload [kg].
        """
        bare = chain.model.copy()
        loaded = bare.copy()
        last = loaded.njoints - 1
        tip = pin.Inertia(payload, chain.T_tip[:3, 3], np.zeros((3, 3)))
        loaded.inertias[last] = loaded.inertias[last] + tip
        data, loaded_data = bare.createData(), loaded.createData()
        holding, needed = np.zeros(chain.nq), np.zeros(chain.nq)
        samples = np.random.default_rng(0).uniform(
            chain.q_min, chain.q_max, (SETTINGS.samples, chain.nq)
        )
        on_arm = chain.coupling.on_arm
        for q in chain.coupling.positions(samples):
            weight = np.abs(on_arm(pin.computeGeneralizedGravity(bare, data, q)))
            holding = np.maximum(holding, weight)
            weight = np.abs(on_arm(pin.computeGeneralizedGravity(loaded, loaded_data, q)))
            inertia = np.diag(on_arm(on_arm(pin.crba(loaded, loaded_data, q)).T))
            needed = np.maximum(needed, weight + inertia * acceleration)
        return HoldingTorques(holding, np.maximum(needed, SETTINGS.least_share * needed.max()))

    def ruling(self, tau_max: Array) -> Array:
        """Torques (nq,) [N·m] that friction, rotors and copper losses are ruled from: the limits
        (nq,), or the usual ones of such an arm instead of placeholders.
        """
        usual = SETTINGS.usual * self.needed
        return np.where(self._are_placeholders(tau_max), usual, tau_max)

    def warnings(self, joints: tuple[str, ...], tau_max: Array) -> list[str]:
        """Warnings of torque limits (nq,) [N·m] below or far above the arm's own torques."""
        weak = [
            f"Joint {joint!r} cannot hold the arm's own links everywhere: gravity takes up to "
            f"{torque:.3g} N·m, and its torque limit is {limit:.4g} N·m. If the URDF's `effort` is "
            "a placeholder, give `torque`; if the links are lighter, give `masses`."
            for joint, torque, limit in zip(joints, self.holding, tau_max, strict=True)
            if limit < torque
        ]
        strong = [
            f"Joint {joint!r} has a torque limit of {limit:.4g} N·m, and the arm with its "
            f"payload needs {torque:.3g} N·m for gravity and acceleration. It is likely a "
            f"placeholder: friction, rotor and copper loss are estimated from {SETTINGS.usual:g} "
            "times the needed torque. Give `torque` or `drives`."
            for joint, torque, limit, is_placeholder in zip(
                joints, self.needed, tau_max, self._are_placeholders(tau_max), strict=True
            )
            if is_placeholder
        ]
        return weak + strong

    def _are_placeholders(self, tau_max: Array) -> Array:
        return np.asarray(tau_max > SETTINGS.placeholder * self.needed)
