"""Settings of the bound of `holding`, and bounds on the derivatives of an arm that it needs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.bounds.chain_derivatives import ChainDerivatives
from joulepath.optimizer.problem.arm import Arm


@dataclass(frozen=True)
class HoldingBoundSettings:
    """Settings of the bound of holding; any values give a valid bound."""

    tau: float = 0.5
    """TAU of the proof."""
    rise_share: float = 0.35
    """Share of the convexity that Coulomb friction's rise may take."""
    sweeps: int = 3
    """Number of sweeps over the joints in search of the multipliers."""
    most_ratio: float = 4.0
    """Greatest ratio ρ; its inverse is the least."""
    scales: tuple[float, ...] = (0.9, 0.7, 0.5, 0.3, 0.15)
    """Shares of the multipliers of the quadratic model tried."""
    light_share: float = 0.05
    """Share of the holding work below which a joint does not count as loaded."""
    reductions: tuple[float, ...] = (0.5, 0.0)
    """Shares that multipliers are reduced to in turn in cells where convexity does not suffice."""


HOLDING = HoldingBoundSettings()
LEAST_DIVISOR = 1e-12
"""Least value of a divisor, far below any convexity or duration that occurs."""


@dataclass(frozen=True)
class HoldingModel:
    """An arm with bounds on the derivatives of its inertia and potential energy."""

    arm: Arm
    chain: ChainDerivatives
    loss: Array
    """Copper loss c, shape (nq,) [W/(N·m)²]."""

    @cached_property
    def inertia_change(self) -> Array:
        """Bounds on ∂M, shape (nq, nq, nq)."""
        return self.chain.inertia_bound(1)

    @cached_property
    def third_potential(self) -> Array:
        """Bounds on ∂³U, shape (nq, nq, nq)."""
        return self.chain.potential_bound(3)

    @cached_property
    def bent(self) -> Array:
        """Least second derivative of v curved asinh(v / speed), shape (nq,)."""
        law, v = self.arm.friction_law, self.arm.active_limits.v_max
        return law.loss_curvature(v) - 2 * law.viscous

    @cached_property
    def greatest(self) -> Array:
        """Greatest |ω| for which the proof holds, shape (nq,) [rad/s]."""
        law = self.arm.friction_law
        most = law.coulomb / (law.curved / law.speed + law.viscous + LEAST_DIVISOR)
        return np.asarray(np.where(law.curved > 0, np.minimum(most, law.speed), most))
