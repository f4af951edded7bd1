"""States and parameters at which tests evaluate the kernel."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from models.robot import Array
from optimizer.prepared_problem import PreparedProblem
from tests.optimizer.moves import PAYLOAD, ROBOT, TILTED, problem

NODES = 40
TORQUE = 1e-9  # N·m, as symbolic inverse dynamics against Pinocchio

LOSSY = replace(  # the UR5e's inverter loss is unknown and zero: give it one, so that its terms are seen
    ROBOT.drives,
    inverter_constant=np.full(6, 0.7),
    inverter_linear=np.array([0.3, 0.3, 0.3, 0.5, 0.5, 0.5]),
    inverter_quadratic=np.full(6, 0.02),
)
TASK = PreparedProblem.of(
    problem(
        robot=replace(
            ROBOT, drives=LOSSY, electronics=replace(ROBOT.electronics, controller_power=9, regeneration=0.3)
        ),
        payload=PAYLOAD,
        gravity=TILTED,
    )
)


def states(seed: int = 1, count: int = NODES) -> Array:
    """Nodes (count, 18) inside the limits on position, speed and acceleration."""
    rng, limits = np.random.default_rng(seed), ROBOT.limits
    bounds = [np.pi * np.ones(6), limits.v_max, limits.a_max]
    return np.hstack([rng.uniform(-bound, bound, (count, 6)) for bound in bounds])
