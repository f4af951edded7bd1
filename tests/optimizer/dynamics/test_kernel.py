"""The per-node functions against Pinocchio, plain formulas and finite differences; memory per
thread.
"""

from __future__ import annotations

import gc
import weakref
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from joulepath.models.robot import Array
from joulepath.optimizer.dynamics import kernel
from joulepath.optimizer.dynamics.kernel import Kernel, kernel_for
from joulepath.optimizer.dynamics.kernel_cache import compile_kernel
from joulepath.optimizer.dynamics.kernel_expressions import Parameters, build
from joulepath.optimizer.dynamics.kernel_functions import Interpreted
from joulepath.optimizer.dynamics.losses import drawn_power, power_flow
from tests.optimizer.dynamics.kernel_states import LOSSY, NODES, TASK, TORQUE, left_out, states
from tests.optimizer.moves import ROBOT, torques

# relative to the largest candidate; compiler and virtual machine evaluate the same few thousand
# operations
ROUNDING = 1e-12
# relative; the same power by another route, with corners rounded over a billionth of a watt
FORMULA = 1e-9
# relative to the largest candidate; central differences with a step of 1e-6 lose about 1e-6² · f'''
# and 1e-16 / 1e-6 · f
DIFFERENCE = 2e-6
STEP = 1e-6


def multipliers() -> Array:
    return np.random.default_rng(2).normal(size=(NODES, 6))


@pytest.fixture(scope="module")
def compiled() -> Kernel:
    compile_kernel(ROBOT)
    found = kernel_for(ROBOT)
    assert found.compiled
    return found


@pytest.fixture(scope="module")
def interpreted() -> Kernel:
    return Kernel(ROBOT, Interpreted(build(ROBOT)))


OBJECTIVES = {"electrical": 1.0}, {"mechanical": 1.0}, {"electrical": 1.0, "time": 1e4}


@pytest.mark.parametrize("weights", OBJECTIVES, ids=str)
def test_compiled_equals_interpreted(
    compiled: Kernel, interpreted: Kernel, weights: dict[str, float]
) -> None:
    y, p, weight = states(), TASK.parameters(**weights), np.linspace(0.1, 2.0, NODES)
    for name, given in {"node": (y, multipliers(), weight, p), "value": (y, p)}.items():
        ours = [array.copy() for array in getattr(compiled, name)(*given)]
        for mine, theirs in zip(ours, getattr(interpreted, name)(*given), strict=True):
            assert np.abs(mine - theirs).max() <= ROUNDING * np.abs(theirs).max()
    parts = y[:, :6], y[:, 6:12], y[:, 12:]
    assert compiled.torque(*parts, p) == pytest.approx(
        interpreted.torque(*parts, p), rel=ROUNDING, abs=ROUNDING
    )


@pytest.mark.parametrize(
    "count",
    [1, kernel.KERNEL.chunk_nodes - 1, kernel.KERNEL.chunk_nodes, kernel.KERNEL.chunk_nodes + 1],
)
def test_torques_are_pinocchios(compiled: Kernel, count: int) -> None:
    """For any number of samples, with payload and tilted gravity."""
    y = states(3, count)
    q, v, a = y[:, :6], y[:, 6:12], y[:, 12:]
    ours = compiled.torque(q, v, a, TASK.parameters())
    assert ours.shape == (count, 6)
    assert np.abs(ours - torques(TASK.problem, q, v, a)).max() < TORQUE


@pytest.mark.parametrize("kind", ["electrical", "mechanical", "time"])
def test_costs_are_the_reported_powers(compiled: Kernel, kind: str) -> None:
    """With almost sharp corners, costs equal reported powers from Pinocchio's torques: bus power, Σ
    |tau_j v_j|, or a price of time.
    """
    task, names = TASK.problem, list(Parameters.__dataclass_fields__)
    sharp = {"knee": task.arm.friction_law.knee, "width": 1e-9}
    p = TASK.parameters(**{kind: 2.5})
    p[-2:] = [sharp[name] for name in names[-2:]]
    y = states(4)
    v = y[:, 6:12]
    tau = torques(task, y[:, :6], v, y[:, 12:])
    flow = power_flow(tau, v, y[:, 12:], LOSSY, task.arm.friction_law)
    net = 36.7 + 9 + flow.joints.sum(axis=1)
    assert net.min() < 0 < net.max()  # both sides of the corner are seen
    expected = {
        "electrical": drawn_power(net, 0.3),
        "mechanical": np.abs(tau * v).sum(axis=1),
        "time": np.ones(NODES),
    }[kind]
    cost, tau_motor = compiled.value(y, p)
    assert cost == pytest.approx(2.5 * expected, rel=FORMULA, abs=1e-7)
    assert tau_motor == pytest.approx(flow.tau_motor, abs=TORQUE)


def differences(function: str, interpreted: Kernel, y: Array, p: Array) -> list[Array]:
    """Central differences (N, 3 nq, ...) of a function's outputs by y."""
    slopes: list[list[Array]] = []
    for i in range(y.shape[1]):
        step = np.zeros(y.shape[1])
        step[i] = STEP
        sides = []
        for side in (y + step, y - step):
            given = (
                (side, p) if function == "value" else (side, 0 * multipliers(), np.ones(len(y)), p)
            )
            sides.append([array.copy() for array in getattr(interpreted, function)(*given)])
        slopes.append([(up - down) / (2 * STEP) for up, down in zip(*sides, strict=True)])
    return [np.stack(each, axis=1) for each in zip(*slopes, strict=True)]


@pytest.mark.parametrize("weights", OBJECTIVES, ids=str)
def test_derivatives_are_the_slopes(compiled: Kernel, weights: dict[str, float]) -> None:
    """First derivatives against differences of the values, second derivatives against differences
    of the first.

    The concave terms of friction reversal are left out.
    """
    y, p = states(5), TASK.parameters(**weights)
    weight, multiplier = np.linspace(0.5, 1.5, NODES), multipliers()
    _, _, gradient, jacobian, hessian = (
        array.copy() for array in compiled.node(y, multiplier, weight, p)
    )
    cost_slope, tau_slope = differences("value", compiled, y, p)
    assert np.abs(gradient - cost_slope).max() < DIFFERENCE * np.abs(cost_slope).max()
    assert (
        np.abs(jacobian - tau_slope.transpose(0, 2, 1)).max() < DIFFERENCE * np.abs(tau_slope).max()
    )
    _, _, gradient_slope, jacobian_slope, _ = differences("node", compiled, y, p)
    expected = weight[:, None, None] * gradient_slope + np.einsum(
        "nj,nijk->nik", multiplier, jacobian_slope
    )
    concave = left_out(compiled, y, weight, p, TASK.friction.coulomb)
    assert np.abs(hessian + concave - expected).max() < DIFFERENCE * np.abs(expected).max()
    assert np.abs(hessian - hessian.transpose(0, 2, 1)).max() < ROUNDING * np.abs(hessian).max()


def test_each_thread_has_memory_of_its_own_until_it_ends(compiled: Kernel) -> None:
    """The results of one thread survive the calls of another, and are freed with the thread."""
    y, p = states(7), TASK.parameters(electrical=1.0)
    cost = compiled.value(y, p)[0]
    before = cost.copy()
    with ThreadPoolExecutor(1) as executor:
        memory = weakref.ref(executor.submit(lambda: compiled.value(y + 1.0, p)[0].base).result())
        assert (cost == before).all()
        assert memory() is not None
    gc.collect()
    assert memory() is None
