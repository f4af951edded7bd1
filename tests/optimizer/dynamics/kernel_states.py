"""States and parameters at which tests evaluate the kernel."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics.kernel import Kernel
from joulepath.optimizer.dynamics.kernel_expressions import Parameters
from joulepath.optimizer.dynamics.plant import SMOOTHING
from joulepath.optimizer.prepared_problem import PreparedProblem
from tests.optimizer.moves import PAYLOAD, ROBOT, TILTED, problem

NODES = 40
TORQUE = 1e-9  # N·m, as symbolic inverse dynamics against Pinocchio

# the UR5e's inverter loss is unknown and zero: a positive one makes its terms visible
LOSSY = replace(
    ROBOT.drives,
    inverter_constant=np.full(6, 0.7),
    inverter_linear=np.array([0.3, 0.3, 0.3, 0.5, 0.5, 0.5]),
    inverter_quadratic=np.full(6, 0.02),
)
TASK = PreparedProblem.of(
    problem(
        robot=replace(
            ROBOT,
            drives=LOSSY,
            electronics=replace(ROBOT.electronics, controller_power=9, regeneration=0.3),
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


def places(name: str, nq: int = 6) -> Array:
    """Indices of a parameter in the packed vector."""
    fields = Parameters.__dataclass_fields__
    sizes = {field: symbol.numel() for field, symbol in vars(Parameters.symbols(nq)[0]).items()}
    return np.flatnonzero(Parameters(**{n: np.full(sizes[n], n == name) for n in fields}).pack())


def left_out(kernel: Kernel, y: Array, weight: Array, p: Array, dry: Array) -> Array:
    """The terms omitted from the kernel's Hessians (N, 18, 18), for dry friction (N, 6) or (6,)
    [N·m] of full size.

    It is the second derivative by v of dry · v / sqrt(v² + KNEE²), times the cost of friction, in
    its concave range. The cost of friction is the slope of the total cost by the parameter
    `coulomb`.
    """
    v, step = y[:, 6:12], 1e-6
    size = np.sqrt(v**2 + SMOOTHING.knee**2)
    concave = np.zeros((len(y), 18, 18))
    for j, k in enumerate(places("coulomb")):
        moved = step * np.eye(len(p))[k]
        slope = (kernel.value(y, p + moved)[0].copy() - kernel.value(y, p - moved)[0]) / (2 * step)
        bend = (
            -3 * SMOOTHING.knee**2 * v[:, j] / size[:, j] ** 5 * np.broadcast_to(dry, v.shape)[:, j]
        )
        concave[:, 6 + j, 6 + j] = weight * np.minimum(slope / (v[:, j] / size[:, j]) * bend, 0.0)
    return concave
